"""The least of T(x) + |v - x| over the points x of a facet, with T of second order on it."""

import cython
from cython.cimports.heat_igl.kernels.sweep.facets import (
    MOST_HALVINGS,
    MOST_STEPS,
    PLACED,
    invert,
    model,
    multiply,
    on_interval,
)
from cython.cimports.libc.math import INFINITY, asinh, sqrt


@cython.cclass
class Facet:
    """The facet opposite a corner v of a triangle, p = 2, or of a tetrahedron, p = 3.

    Of its corners, `D` are the distances less `start`, and `sag[i][j]` is by how much the square of T sags below that
    of the linear function between two of them. In one metric (q = 1), `product` has the scalar products of the vectors
    from v to the corners; else `W` has the velocity at v and the corners (q = p + 1). The best place has the shares
    `share`. For p = 2 the third of each is 0.
    """

    def along_edges(self):
        """The least value along an edge to v; sets `share`."""
        at: cython.int = 0
        best: cython.double = INFINITY
        for i in range(3):
            self.share[i] = 0.0
        for i in range(self.p):
            self.share[i] = 1.0
            value: cython.double = self.start + self.D[i] + self.length(self.share)
            self.share[i] = 0.0
            if value < best:
                best, at = value, i
        self.share[at] = 1.0
        return best

    def length(self, x):
        """|v - x| for shares x, with its derivatives `g` by these.

        Velocity W, the inverse root of the metric, is linear between the corners. With W in the middle, a straight line
        e takes the time |W^-1 e|; where fibres turn, so does a path that goes along them. Where the mean velocity s
        grows from a to b, the time is 2 asinh(c l / 2) / c with l = |W^-1 e| (a + b) / (2 sqrt(a b)), and c the length
        of the gradient of s: on circles, which are shortest where W is a linear factor (hyperbolic space).
        """
        if self.q == 1:
            m = cython.address(self.product[0])
            for i in range(3):
                self.g[i] = m[3 * i] * x[0] + m[3 * i + 1] * x[1] + m[3 * i + 2] * x[2]
            square: cython.double = x[0] * self.g[0] + x[1] * self.g[1] + x[2] * self.g[2]
            if not square > 0.0:
                return 0.0
            self.near = sqrt(square)
            for i in range(3):
                self.g[i] /= self.near
                self.own[i] = self.g[i]
            return self.near
        e: cython.double[3]
        W: cython.double[6]
        for k in range(3):
            e[k] = x[0] * self.E[0][k] + x[1] * self.E[1][k] + x[2] * self.E[2][k]
        for k in range(6):
            W[k] = 0.5 * (self.W[0][k] + x[0] * self.W[1][k] + x[1] * self.W[2][k] + x[2] * self.W[3][k])
        I = cython.address(self.inverse[0])
        invert(W, I)
        multiply(I, e, self.w)
        self.near = sqrt(self.w[0] * self.w[0] + self.w[1] * self.w[1] + self.w[2] * self.w[2])
        if not self.near > 0.0:
            return 0.0
        multiply(I, self.w, self.u)
        sv: cython.double = self.s[0]
        sx: cython.double = x[0] * self.s[1] + x[1] * self.s[2] + x[2] * self.s[3]
        self.sx = sx
        # Divisions take longer than the rest: one for each root.
        per: cython.double = 0.5 / sqrt(sv * sx)
        self.even = self.near * (sv + sx) * per
        half: cython.double = 0.5 * self.growth * self.even
        self.bent = 1.0 / sqrt(1.0 + half * half)
        self.factor = self.bent * (sv + sx) * per
        self.factor_1 = 0.5 * self.bent * (sx - sv) * per / sx
        per = 1.0 / self.near
        for i in range(3):
            self.u[i] *= per
        for i in range(self.p):
            multiply(cython.address(self.W[i + 1][0]), self.w, e)
            for k in range(3):
                self.a[i][k] = self.E[i][k] - 0.5 * e[k]
            self.own[i] = self.u[0] * self.a[i][0] + self.u[1] * self.a[i][1] + self.u[2] * self.a[i][2]
            self.g[i] = self.factor * self.own[i] + self.near * self.factor_1 * self.s[i + 1]
        # Of small arguments asinh has no digits.
        return self.even * (asinh(half) / half if half > 1e-4 else 1.0 - half * half / 6.0)

    def lean(self, i):
        """What the last `length` gains by moving v towards corner i."""
        if self.q == 1:
            return -self.own[i]
        d: cython.double[6]
        e: cython.double[3]
        for k in range(6):
            d[k] = 0.5 * (self.W[i + 1][k] - self.W[0][k])
        multiply(d, self.w, e)
        gain: cython.double = 0.0
        for k in range(3):
            gain -= self.u[k] * (self.E[i][k] + e[k])
        return self.factor * gain - self.near * self.factor_1 * self.sx / self.s[0] * (self.s[i + 1] - self.s[0])

    def value(self, x, L):
        """T(x) + |v - x| for shares x of the corners, with `length` L, inf if there is none; adds to `g` those of T."""
        mean: cython.double = x[0] * self.D[0] + x[1] * self.D[1] + x[2] * self.D[2]
        square: cython.double = mean * mean
        for i in range(3):
            self.rise[i] = 0.5 * (x[0] * self.sag[i][0] + x[1] * self.sag[i][1] + x[2] * self.sag[i][2])
            square -= x[i] * self.rise[i]
        if not (square > 0.0 and L > 0.0):
            return INFINITY
        self.T = sqrt(square)
        per: cython.double = 1.0 / self.T
        for i in range(3):
            self.rise[i] = (mean * self.D[i] - self.rise[i]) * per
            self.g[i] += self.rise[i]
        return self.start + self.T + L

    def curve(self):
        """Set the second derivatives `H` of the last `value`, once."""
        e: cython.double[3]
        # The velocity at each corner times u.
        Wu: cython.double[3][3]
        bend: cython.double = 0.0
        turn: cython.double = 0.0
        per_T: cython.double = 1.0 / self.T
        per_near: cython.double = 1.0 / self.near
        if self.q > 1:
            turn = 0.25 * self.growth * self.growth * self.even * self.bent
            bend = self.near * self.bent * (3.0 * self.s[0] - self.sx)
            bend /= 8.0 * self.sx * self.sx * sqrt(self.s[0] * self.sx)
        for i in range(self.p):
            if self.q > 1:
                multiply(cython.address(self.inverse[0]), cython.address(self.a[i][0]), e)
                for k in range(3):
                    self.a[i][k] = e[k]
                multiply(cython.address(self.W[i + 1][0]), cython.address(self.u[0]), cython.address(Wu[i][0]))
            for j in range(i + 1):
                found: cython.double = self.D[i] * self.D[j] - 0.5 * self.sag[i][j] - self.rise[i] * self.rise[j]
                found *= per_T
                across: cython.double = -self.own[i] * self.own[j]
                if self.q == 1:
                    found += (across + self.product[3 * i + j]) * per_near
                else:
                    mixed: cython.double = 0.0
                    for k in range(3):
                        across += self.a[i][k] * self.a[j][k]
                        mixed += Wu[i][k] * self.a[j][k] + Wu[j][k] * self.a[i][k]
                    across = across * per_near - 0.5 * mixed
                    mixed = self.own[i] * self.s[j + 1] + self.own[j] * self.s[i + 1]
                    found += self.factor * across + self.factor_1 * mixed + bend * self.s[i + 1] * self.s[j + 1]
                    found -= turn * (self.g[i] - self.rise[i]) * (self.g[j] - self.rise[j])
                self.H[i][j] = self.H[j][i] = found

    def newton(self, L, limit):
        """The least value over the facet, by Newton's method from `share`, which is changed; inf if not below `limit`.

        It begins after `length` L there. Values are convex, so that none is below a tangent plane.
        """
        x: cython.double[3]
        y: cython.double[3]
        for i in range(3):
            x[i] = self.share[i]
        best: cython.double = self.value(x, L)
        if best == INFINITY:
            # The linear place is on the other side of what T allows: begin in the middle.
            for i in range(self.p):
                x[i] = self.share[i] = 1.0 / self.p
            best = self.value(x, self.length(x))
        is_last: cython.bint = False
        for _step in range(MOST_STEPS):
            low: cython.double = INFINITY
            at: cython.double = 0.0
            for i in range(self.p):
                low = min(low, self.g[i])
                at += self.g[i] * x[i]
            if best + low - at >= limit:
                return INFINITY
            if best == INFINITY or is_last:
                return best
            self.curve()
            db: cython.double = 0.0
            de: cython.double = 0.0
            if self.p == 2:
                bend: cython.double = self.H[0][0] - 2.0 * self.H[0][1] + self.H[1][1]
                db = on_interval(self.g[1] - self.g[0], bend, -x[1], x[0])
            else:
                db, de = self.on_triangle(x)
            slope: cython.double = (self.g[1] - self.g[0]) * db + (self.g[2] - self.g[0]) * de
            # Nor is that at the next place, and with a quadratic function it is the least.
            if best + slope >= limit:
                return INFINITY
            is_last = -slope <= PLACED * self.near
            for _half in range(1 if is_last else MOST_HALVINGS):
                y[0], y[1], y[2] = max(x[0] - db - de, 0.0), max(x[1] + db, 0.0), max(x[2] + de, 0.0)
                value: cython.double = self.value(y, self.length(y))
                if value < best:
                    break
                db *= 0.5
                de *= 0.5
            if not value < best:
                break
            best = value
            for i in range(3):
                x[i] = self.share[i] = y[i]
        return best

    def on_triangle(self, x):
        """The step, in shares of the last two corners, to the least value of the quadratic model on the triangle."""
        gb: cython.double = self.g[1] - self.g[0]
        ge: cython.double = self.g[2] - self.g[0]
        bb: cython.double = self.H[1][1] - 2.0 * self.H[0][1] + self.H[0][0]
        ee: cython.double = self.H[2][2] - 2.0 * self.H[0][2] + self.H[0][0]
        be: cython.double = self.H[1][2] - self.H[0][1] - self.H[0][2] + self.H[0][0]
        det: cython.double = bb * ee - be * be
        db: cython.double = 0.0
        de: cython.double = 0.0
        if bb > 0.0 and det > 0.0:
            db = (be * ge - ee * gb) / det
            de = (be * gb - bb * ge) / det
            if x[1] + db >= 0.0 and x[2] + de >= 0.0 and db + de <= x[0]:
                return db, de
        # On the three edges.
        one: cython.double = on_interval(gb - be * x[2], bb, -x[1], 1.0 - x[1])
        two: cython.double = -x[2]
        least: cython.double = model(gb, ge, bb, be, ee, one, two)
        db, de = one, two
        one, two = -x[1], on_interval(ge - be * x[1], ee, -x[2], 1.0 - x[2])
        value: cython.double = model(gb, ge, bb, be, ee, one, two)
        if value < least:
            least, db, de = value, one, two
        # With no share of the first corner: db + de = x[0].
        one = on_interval(gb - ge + (be - ee) * x[0], bb - 2.0 * be + ee, -x[1], 1.0 - x[1])
        two = x[0] - one
        if model(gb, ge, bb, be, ee, one, two) < least:
            db, de = one, two
        return db, de
