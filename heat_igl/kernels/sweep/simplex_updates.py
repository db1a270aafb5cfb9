"""The least of T(x) + |v - x| over the facet opposite a corner v: with T linear, and of second order by slopes."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.sweep import facets
from cython.cimports.heat_igl.kernels.sweep.facets import Facet, gradient, mean_velocity, pair, squares_of
from cython.cimports.heat_igl.kernels.sweep.simplex_updates import EQUAL, FETCH, edge_length
from cython.cimports.libc.math import INFINITY, fabs, log, sqrt


@cython.final
@cython.cclass
class SimplexUpdate(Facet):
    """Triangles, p = 2, or tetrahedra, p = 3, with a metric on each, or one at each of their corners.

    Parameters
    ----------
    corners : (m, p + 1) int32
        Vertices of each simplex.
    velocity : (k, 6) float64 or None
        The inverse root of metrics, whose entries on and above the diagonal come row by row. None if each simplex has
        one metric (q = 1).
    rows, inverse : (m, p + 1) int32, (k, 6) float64, or None
        If not (q = p + 1), the row of these at each corner; velocity is linear in between. Its inverse.
    mean : (m, pairs) float64
        Squared distances in one metric for each simplex, in which T is found that is linear; pairs of corners in the
        order of `np.tril_indices`.
    widest, slack : (m,) float64
        The square of the longest edge, and by which factor lengths may be shorter than in the mean metric.
    growth : (m,) float64
        If q > 1, the length of the gradient of the mean velocity, in the metric of the centre.
    V : (n, 3) float64
        Positions.
    """

    def __init__(self, corners, velocity, rows, inverse, mean, widest, slack, growth, V):
        self.corners, self.velocity, self.inverses, self.rows, self.V = corners, velocity, inverse, rows, V
        self.mean, self.widest, self.slack, self.growths = mean, widest, slack, growth
        self.p, self.q = corners.shape[1] - 1, 1 if rows is None else corners.shape[1]

    def edge_lengths(self):
        """The lengths (m, pairs) of the edges in each simplex, pairs in the order of those of `mean`."""
        found = np.empty_like(self.mean)
        lengths: cython.double[:, ::1] = found
        with cython.nogil:
            for s in range(self.corners.shape[0]):
                for i in range(self.p + 1):
                    for j in range(i):
                        lengths[s, pair(i, j)] = edge_length(self, s, i, j)
        return found

    def face(self, s, c):
        """Look at the facet opposite corner c of s: sets `side`, `at` and `level`, returns the least distance."""
        nearest: cython.double = INFINITY
        of = cython.address(self.corners[s, 0])
        for k in range(self.p):
            self.side[k] = k + (k >= c)
            self.at[k] = of[k + (k >= c)]
            self.level[k] = self.d[self.at[k]]
            nearest = min(nearest, self.level[k])
        return nearest

    def linear(self, s, c, limit):
        """The least value at corner c of simplex s with T linear, inf if it is not below `limit`; sets `share`."""
        self.share[0] = self.share[1] = self.share[2] = 0.0
        least: cython.double = limit
        if self.p == 2:
            least = self.over_edge(s, c, 0, 1, least)
        elif not self.across(s, c, cython.address(least)):
            # Values are convex: the least one is on an edge beyond which that over the whole plane lies.
            is_within: cython.bint[3]
            for k in range(3):
                is_within[k] = self.share[k] > 0.0
            for k in range(3):
                i: cython.int = 1 if k == 0 else 0
                j: cython.int = 1 if k == 2 else 2
                if not is_within[k]:
                    least = self.over_edge(s, c, i, j, least)
        return least if least < limit else INFINITY

    def over_edge(self, s, c, i, j, least):
        """The smaller of `least` and the least value over the edge between two corners of `side`; then sets `share`."""
        sq = cython.address(self.mean[s, 0])
        base: cython.double = sq[pair(self.side[j], self.side[i])]
        to: cython.double = sq[pair(c, self.side[i])]
        rise: cython.double = self.level[j] - self.level[i]
        rest: cython.double = base - rise * rise
        # From corner i, along the edge to corner j: at one of them if T is steeper than the metric allows.
        along: cython.double = -rise
        far: cython.double = 0.0
        if rest > 0.0:
            along = 0.5 * (base + to - sq[pair(c, self.side[j])])
            height: cython.double = max(to * base - along * along, 0.0)
            # Over the whole line the least value is above that at corner i by (rise along + sqrt(height rest)) / base.
            room: cython.double = (least - self.level[i]) * base - rise * along
            if not room > 0.0 or height * rest >= room * room:
                return least
            far = sqrt(height / rest)
            along -= far * rise
        if not along > 0.0:
            along, value = 0.0, self.level[i] + sqrt(to)
        elif along < base and rest > 0.0:
            along /= base
            value = self.level[i] + rise * along + far
        else:
            along, value = 1.0, self.level[j] + sqrt(sq[pair(c, self.side[j])])
        if not value < least:
            return least
        for k in range(3):
            self.share[k] = 0.0
        self.share[i], self.share[j] = 1.0 - along, along
        return value

    def across(self, s, c, least):
        """Whether no value over an edge of the triangle of `side` is below `least`; sets `share`.

        That is so if the value over the whole plane is not, or lies inside the triangle and is `least` then. Else
        shares are those where it lies, 0 if there is no such place.
        """
        sq = cython.address(self.mean[s, 0])
        to: cython.double = sq[pair(c, self.side[0])]
        bb: cython.double = sq[pair(self.side[1], self.side[0])]
        ee: cython.double = sq[pair(self.side[2], self.side[0])]
        be: cython.double = 0.5 * (bb + ee - sq[pair(self.side[2], self.side[1])])
        det: cython.double = bb * ee - be * be
        b: cython.double = self.level[1] - self.level[0]
        e: cython.double = self.level[2] - self.level[0]
        if not det > 0.0:
            return False
        det = 1.0 / det
        wb: cython.double = 0.5 * (bb + to - sq[pair(c, self.side[1])])
        we: cython.double = 0.5 * (ee + to - sq[pair(c, self.side[2])])
        # The foot of v on the plane, and the slope of T there, in shares of b and e.
        fb: cython.double = (ee * wb - be * we) * det
        fe: cython.double = (bb * we - be * wb) * det
        height: cython.double = max(to - fb * wb - fe * we, 0.0)
        room: cython.double = least[0] - min(self.level[0], min(self.level[1], self.level[2]))
        if height >= room * room:
            return True
        gb: cython.double = (ee * b - be * e) * det
        ge: cython.double = (bb * e - be * b) * det
        rest: cython.double = 1.0 - gb * b - ge * e
        if not rest > 0.0:
            return False
        far: cython.double = sqrt(height / rest)
        fb -= far * gb
        fe -= far * ge
        value: cython.double = self.level[0] + b * fb + e * fe + far
        if value >= least[0]:
            return True
        self.share[0], self.share[1], self.share[2] = 1.0 - fb - fe, fb, fe
        if not (fb > 0.0 and fe > 0.0 and fb + fe < 1.0):
            return False
        least[0] = value
        return True

    def through(self, s, c, best, far):
        """The value at corner c of second order through simplex s, inf if it cannot be below `best`; sets `share`.

        Its lower bound is what T linear and the nearest corner say, with some margin. It is also inf if corner `far`,
        which is farther than c, at `best`, can lower none. That is -1 if there is no such corner.
        """
        nearest: cython.double = self.face(s, c)
        farther: cython.double = self.level[0] + self.level[1] + self.level[2]  # the third of a triangle is 0
        # A corner was not reached yet.
        if farther == INFINITY:
            return INFINITY
        above: cython.double = nearest - best
        # Between corners at one distance from a point, the square is less by at most a third of a squared edge.
        most: cython.double = 0.5 * self.widest[s]
        near: cython.double = nearest - self.start
        if near * near <= most:
            near = max(near, sqrt(most))
        # Where T sags by no more than `above`.
        if above >= near or above * (2.0 * near - above) >= most:
            return INFINITY
        if far >= 0 and (self.d[self.corners[s, far]] - best) * (best - self.start) >= most:
            # With T linear, it lowers values only if angles at c are obtuse, beyond rounding.
            sq = cython.address(self.mean[s, 0])
            to: cython.double = sq[pair(c, far)] * (1.0 + EQUAL)
            is_obtuse: cython.bint = False
            for i in range(self.p):
                at: cython.int = self.side[i]
                is_obtuse |= at != far and to + sq[pair(c, at)] < sq[pair(at, far)]
            if not is_obtuse:
                return INFINITY
        room: cython.double = (near - sqrt(max(near * near - most, 0.0)) - above) / self.slack[s]
        for i in range(self.q if self.q > 1 else 0):
            FETCH(cython.address(self.velocity[self.rows[s, i], 0]))
            FETCH(cython.address(self.inverses[self.rows[s, i], 0]))
        least: cython.double = self.linear(s, c, nearest + room)
        if least == INFINITY:
            return INFINITY
        self.lay(s, c)
        return self.sagging(s, self.weight[self.corners[s, c]], best, nearest + self.slack[s] * (least - nearest))

    def lay(self, s, c):
        """What `Facet` knows of s and its metric, after `face`."""
        near = cython.address(self.V[self.corners[s, c], 0])
        for i in range(self.p):
            to = cython.address(self.V[self.at[i], 0])
            for k in range(3):
                self.E[i][k] = to[k] - near[k]
        if self.q == 1:
            sq = cython.address(self.mean[s, 0])
            m = cython.address(self.product[0])
            for i in range(self.p):
                m[4 * i] = sq[pair(c, self.side[i])]
                for j in range(i):
                    between: cython.double = m[4 * i] + m[4 * j] - sq[pair(self.side[i], self.side[j])]
                    m[3 * i + j] = m[3 * j + i] = 0.5 * between
            return
        self.growth = self.growths[s]
        for i in range(4):  # the fourth of a triangle has the share 0
            at: cython.int = c if i == 0 or i > self.p else self.side[i - 1]
            self.W[i] = cython.address(self.velocity[self.rows[s, at], 0])
            self.s[i] = mean_velocity(self.W[i])

    def sagging(self, s, weight, limit, least):
        """The least value with T of second order, times `weight`, after `lay` and from `share`, which it sets.

        It may be inf if it is not below `limit`; with T linear it is `least` or more.
        """
        near: cython.double = INFINITY
        deep: cython.double = 0.0
        x: cython.double[3]
        for i in range(self.p):
            self.D[i] = self.level[i] - self.start
            near = min(near, self.D[i])
        is_source: cython.bint = not near > 0.0
        if is_source and self.q > 1:
            # T is not linear on an edge to the source, and its square not quadratic.
            return self.along_edges()
        for i in range(self.p):
            x[i] = self.trust(s, i)
            for j in range(i):
                sag: cython.double = self.sag_between(s, i, j, x[i] - x[j], min(x[i], x[j]))
                self.sag[i][j] = self.sag[j][i] = weight * sag
                # Products of two shares add up to a third at most.
                deep = max(deep, self.sag[i][j] / 3.0)
        near = max(near, sqrt(deep))
        if least - near + sqrt(near * near - deep) >= limit:
            return INFINITY
        L: cython.double = self.length(self.share)
        best: cython.double = self.newton(L, limit)
        if is_source:
            # Straight from the source, where the square of T may have no derivatives.
            for i in range(3):
                x[i] = self.share[i]
            straight: cython.double = self.along_edges()
            if straight < best:
                return straight
            for i in range(3):
                self.share[i] = x[i]
        return best

    def sag_between(self, s, i, j, more, trusted):
        """By how much the squared distance between two corners sags below that of T linear, over their shares.

        The squared distance from one point in one metric is a quadratic function, found from the slopes at both ends.
        Where these contradict the values, it sags less. T may not be steeper at the ends than the metric allows.

        Parameters
        ----------
        s, i, j
            The simplex, and the two corners of `side`.
        more, trusted
            By how much the slope at i is trusted more than that at j, and the smaller trust of both.
        """
        v: cython.int = self.at[i]
        u: cython.int = self.at[j]
        if not (self.is_sloped[v] and self.is_sloped[u]):
            return 0.0
        Di: cython.double = self.D[i]
        Dj: cython.double = self.D[j]
        x = cython.address(self.V[v, 0])
        y = cython.address(self.V[u, 0])
        e: cython.double[3]
        e[0], e[1], e[2] = y[0] - x[0], y[1] - x[1], y[2] - x[2]
        x, y = cython.address(self.slope[v, 0]), cython.address(self.slope[u, 0])
        at_i: cython.double = 2.0 * Di * (x[0] * e[0] + x[1] * e[1] + x[2] * e[2])
        at_j: cython.double = 2.0 * Dj * (y[0] * e[0] + y[1] * e[1] + y[2] * e[2])
        rise: cython.double = Dj * Dj - Di * Di
        # A slope of another metric is replaced by what the other end says, unless T would fall below both ends.
        if more > 0.0:
            at_j += more * ((2.0 * rise - at_i if rise > 0.0 else min(2.0 * rise - at_i, 0.0)) - at_j)
        else:
            at_i -= more * ((2.0 * rise - at_j if rise < 0.0 else max(2.0 * rise - at_j, 0.0)) - at_i)
        level: cython.double = (Dj - Di) * (Dj - Di)
        sag: cython.double = 0.5 * (at_j - at_i) - level
        doubt: cython.double = rise - 0.5 * (at_i + at_j)
        if fabs(doubt) >= fabs(sag):
            return 0.0
        sag -= fabs(doubt) * max(fabs(doubt / sag), 1.0 - trusted) * (1.0 if sag > 0.0 else -1.0)
        # T above that of first order makes distances longer: if both slopes say so, or one of this very metric, as at a
        # border between two metrics, where the wave at the other end came through the border.
        if sag < 0.0 and trusted + fabs(more) < 1.0 - EQUAL:
            sag *= trusted
        # Twice the length of the edge; at no corner is its square less than half of that in the mean with the slack.
        one: cython.double = 2.0 * sqrt(self.mean[s, pair(self.side[i], self.side[j])])
        two: cython.double = one
        if self.q > 1:
            one *= sqrt(0.5) * self.slack[s]
            if max(rise - Di * one, -Dj * one - rise) <= sag + level <= min(rise + Di * one, Dj * one - rise):
                return sag
            squares_of(cython.address(self.inverses[self.rows[s, self.side[i]], 0]), e, 1, cython.address(one))
            squares_of(cython.address(self.inverses[self.rows[s, self.side[j]], 0]), e, 1, cython.address(two))
            one, two = 2.0 * sqrt(one), 2.0 * sqrt(two)
        most: cython.double = min(rise + Di * one, Dj * two - rise) - level
        least: cython.double = max(rise - Di * one, -Dj * two - rise) - level
        return max(min(sag, most), least)

    def trust(self, s, i):
        """How far the slope at a corner i of `side` has length 1 in simplex s, as unless metrics jump: from 0 to 1.

        With the square of the logarithm, distances have a derivative where metrics begin to differ.
        """
        v: cython.int = self.at[i]
        if not self.is_sloped[v]:
            return 0.0
        row: cython.int = self.rows[s, self.side[i]] if self.q > 1 else s
        if self.trusted_in[v] != row:
            square: cython.double = 0.0
            if self.q > 1:
                squares_of(self.W[i + 1], cython.address(self.slope[v, 0]), 1, cython.address(square))
            else:
                # By products with vectors to the corners, in the inverse of the metric that has the products of these.
                m: cython.double[6]
                inverse: cython.double[6]
                m[0], m[1], m[2], m[3] = self.product[0], self.product[1], self.product[2], self.product[4]
                m[4], m[5] = self.product[5], self.product[8] if self.p == 3 else 1.0
                facets.invert(m, inverse)
                for j in range(3):
                    m[j] = 0.0
                    for k in range(3 if j < self.p else 0):
                        m[j] += self.slope[v, k] * self.E[j][k]
                facets.multiply(inverse, m, m + 3)
                square = m[0] * m[3] + m[1] * m[4] + m[2] * m[5]
            square = log(square) if square > 0.0 else 1.0
            self.trusted[v], self.trusted_in[v] = max(1.0 - square * square, 0.0), row
        return self.trusted[v]

    def find_slope(self, s, c):
        """The derivative of the length of v - x by the position of v, at the best place x, after `face`."""
        v: cython.int = self.corners[s, c]
        lean: cython.double[3]
        self.trusted_in[v] = -1
        self.lay(s, c)
        self.is_sloped[v] = self.length(self.share) > 0.0
        for i in range(self.p):
            lean[i] = self.lean(i)
        gradient(cython.address(self.E[0][0]), lean, self.p, cython.address(self.slope[v, 0]))
