"""Kernel of distance in any metric: the Hopf-Lax formula on each triangle or tetrahedron.

The distance at a corner v of a simplex is the least of T(x) + |v - x| over the points x of the facet opposite, with T
the distance on the facet between its corners, and the length of v - x in the metric of the simplex.

*First order*: T is linear. Then the update is monotone in the distances at the corners, so that updates in any order
lead to one fixed point, which converges to the distance in a continuous metric (Bornemann and Rasch 2006).

*Second order*: the square of T is quadratic, as the squared distance from a point in one metric is, at the source too.
Its second differences along the edges of the facet are found from the slopes of distance at the corners, and are used
as far as these agree with the distances, and with the metric of the simplex.

Distances begin with those along edges, and are updated in rounds, each vertex after those it has its distance from.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.signals import is_interrupted
from cython.cimports.heat_igl.kernels.sweep.facets import Facet, invert, mean_velocity, multiply
from cython.cimports.heat_igl.kernels.sweep.hopf_lax import EQUAL, RISEN, SETTLED
from cython.cimports.libc.math import INFINITY, fabs, log, sqrt

from heat_igl.kernels.signals import raise_caught


@cython.cfunc
@cython.inline
@cython.nogil
def _pair(i: cython.int, j: cython.int) -> cython.int:
    """The number of the pair of two corners, as `np.tril_indices` counts them below the diagonal."""
    return i * (i - 1) // 2 + j if i > j else j * (j - 1) // 2 + i


def lengths_in_velocity(
    corners: cython.const[cython.int][:, ::1],
    V: cython.const[cython.double][:, ::1],
    velocity: cython.const[cython.double][:, ::1],
    rows: cython.const[cython.int][:, ::1],
):
    """Of simplices with a velocity at each corner, a row (m, p + 1) of `velocity` (k, 6), linear in between.

    Returns
    -------
    mean, lengths : (m, pairs) float64
        Squared distances between the corners, in the metric of the centre, and lengths of the edges by Simpson's rule,
        with the geometric mean of both ends in the middle.
    widest, slack, growth, inverse
        As `HopfLax` takes them.
    variation : float
        Of triangles: how far the lengths of edges differ between the metrics of the corners, mean square of the share.
    """
    size: cython.int = corners.shape[1]
    n_pairs: cython.int = size * (size - 1) // 2
    m = corners.shape[0]
    found = *np.zeros((2, m, n_pairs)), np.zeros(m), np.ones(m), np.zeros(m), np.zeros_like(velocity)
    mean: cython.double[:, ::1] = found[0]
    lengths: cython.double[:, ::1] = found[1]
    widest: cython.double[::1] = found[2]
    slack: cython.double[::1] = found[3]
    growth: cython.double[::1] = found[4]
    inverse: cython.double[:, ::1] = found[5]
    variation: cython.double = 0.0
    squares: cython.double[24]
    here: cython.double[6]
    e: cython.double[18]
    W: cython.double[6]
    I: cython.double[6]
    E: cython.double[12]
    rise: cython.double[4]
    steep: cython.double[3]
    with cython.nogil:
        for i in range(velocity.shape[0]):
            invert(cython.address(velocity[i, 0]), cython.address(inverse[i, 0]))
        for s in range(m):
            for k in range(6):
                W[k] = 0.0
            for i in range(size):
                for x in range(3):
                    for j in range(i):
                        e[3 * _pair(i, j) + x] = V[corners[s, j], x] - V[corners[s, i], x]
                    E[3 * i + x] = V[corners[s, 0], x] - V[corners[s, i], x]
                for k in range(6):
                    W[k] += velocity[rows[s, i], k] / size
                rise[i] = mean_velocity(cython.address(velocity[rows[s, 0], 0]))
                rise[i] -= mean_velocity(cython.address(velocity[rows[s, i], 0]))
            invert(W, I)
            _squares(I, e, n_pairs, cython.address(mean[s, 0]))
            _gradient(E + 3, rise + 1, size - 1, here)
            multiply(W, here, steep)
            growth[s] = sqrt(steep[0] * steep[0] + steep[1] * steep[1] + steep[2] * steep[2]) / mean_velocity(W)
            for i in range(size):
                _squares(cython.address(inverse[rows[s, i], 0]), e, n_pairs, squares + 6 * i)
                for k in range(n_pairs):
                    widest[s] = max(widest[s], squares[6 * i + k])
                for j in range(i):
                    for k in range(6):
                        W[k] = 0.5 * (velocity[rows[s, i], k] + velocity[rows[s, j], k])
                    invert(W, I)
                    _squares(I, e, n_pairs, here)
                    at: cython.int = _pair(i, j)
                    one: cython.double = sqrt(squares[6 * i + at])
                    two: cython.double = sqrt(squares[6 * j + at])
                    lengths[s, at] = (one + 4.0 * sqrt(one * two) + two) / 6.0
                    for k in range(n_pairs):
                        if here[k] < slack[s] * mean[s, k]:
                            slack[s] = here[k] / mean[s, k]
            slack[s] = sqrt(slack[s])
            for k in range(3 if size == 3 else 0):
                one = sqrt(min(squares[k], squares[6 + k], squares[12 + k]))
                two = sqrt(max(squares[k], squares[6 + k], squares[12 + k]))
                variation += (two - one) * (two - one) / (3.0 * m * mean[s, k])
    return *found, variation


@cython.cfunc
@cython.nogil
def _squares(
    I: cython.pointer[cython.const[cython.double]],
    e: cython.pointer[cython.const[cython.double]],
    n: cython.int,
    into: cython.pointer[cython.double],
) -> cython.void:
    """The squares of |I e| for n vectors e."""
    w: cython.double[3]
    for k in range(n):
        multiply(I, e + 3 * k, w)
        into[k] = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]


@cython.cfunc
@cython.nogil
def _gradient(
    E: cython.pointer[cython.double],
    rise: cython.pointer[cython.double],
    p: cython.int,
    into: cython.pointer[cython.double],
) -> cython.void:
    """The vector with the products `rise` (p,) with p vectors E (3, 3), in the plane of two; 0 if they span nothing."""
    across: cython.double[9]
    if p == 2:
        _cross(E, E + 3, E + 6)
        rise[2] = 0.0
    for i in range(3):
        _cross(E + 3 * ((i + 1) % 3), E + 3 * ((i + 2) % 3), across + 3 * i)
    volume: cython.double = E[0] * across[0] + E[1] * across[1] + E[2] * across[2]
    for x in range(3):
        into[x] = rise[0] * across[x] + rise[1] * across[3 + x] + rise[2] * across[6 + x]
        into[x] = into[x] / volume if volume != 0.0 else 0.0


@cython.cfunc
@cython.inline
@cython.nogil
def _cross(
    a: cython.pointer[cython.double], b: cython.pointer[cython.double], into: cython.pointer[cython.double]
) -> cython.void:
    for x in range(3):
        into[x] = a[(x + 1) % 3] * b[(x + 2) % 3] - a[(x + 2) % 3] * b[(x + 1) % 3]


@cython.final
@cython.cclass
class HopfLax(Facet):
    """Triangles, p = 2, or tetrahedra, p = 3, with a metric on each, or one at each of their corners.

    Parameters
    ----------
    corners : (m, p + 1) int32
        Vertices of each simplex.
    first, incident : (n + 1,) int32, (m (p + 1),) int32
        Corners ``simplex * (p + 1) + corner`` that meet in vertex v, at ``first[v]`` to ``first[v + 1]`` of `incident`.
    velocity, inverse : (k, 6) float64 or None
        The inverse root of metrics, whose entries on and above the diagonal come row by row, and its inverse. None if
        each simplex has one metric (q = 1).
    rows : (m, p + 1) int32 or None
        If not (q = p + 1), the row of these at each corner; velocity is linear in between.
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

    def __init__(self, corners, first, incident, velocity, inverse, rows, mean, widest, slack, growth, V):
        self.corners, self.first, self.incident, self.V = corners, first, incident, V
        self.velocity, self.inverses, self.rows = velocity, inverse, rows
        self.mean, self.widest, self.slack, self.growths = mean, widest, slack, growth
        self.p, self.q = corners.shape[1] - 1, 1 if rows is None else corners.shape[1]

    def settle(self, d, label, offset):
        """Change distances along edges to those of second order, in place.

        Parameters
        ----------
        d, label : (n,) float64, (n,) int32
            Distances along edges, and the source of each, -1 for none; changed.
        offset : (k,) float64
            Of each source.

        Returns
        -------
        facet : (n,) int32
            The corner ``simplex * (p + 1) + corner`` opposite the facet that gave each vertex its distance, or -1.
        place : (n, p) float64
            The shares of the other corners, in their order, at the best place on that facet.
        slope, is_sloped : (n, 3) float64, (n,) uint8
            The derivative of distance by the position of each vertex, and whether it is known.
        weight : (n,) float64
            How far T is of second order for a vertex: from 1 to 0, where T is linear.
        """
        n = len(d)
        self.d, self.label, self.offset, self.low = d, label, offset, np.min(d)
        # Nearer than a source to itself is another one.
        self.fixed = (d == np.append(offset, np.inf)[label]).view(np.uint8)
        self.slope, self.is_sloped = np.zeros((n, 3)), np.zeros(n, np.uint8)
        self.facet, self.place = np.full(n, -1, np.int32), np.zeros((n, self.p))
        self.order = np.argsort(d, kind="stable").astype(np.int32)
        self.roots, self.state, self.stack = np.zeros(n, np.int32), np.zeros(n, np.uint8), np.zeros(4 * n, np.int32)
        self.step, self.sum, self.risen, self.weight = np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n)
        self.pending, self.n_visits = np.where(np.isfinite(d), np.inf, 0.0), np.zeros(n, np.int32)
        with cython.nogil:
            self.sharpen()
        raise_caught()
        return tuple(map(np.asarray, (self.facet, self.place, self.slope, self.is_sloped, self.weight)))

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def face(self, s: cython.int, c: cython.int) -> cython.double:
        """Look at the facet opposite corner c of simplex s: sets `side` and `level`, returns the least distance."""
        k: cython.int = 0
        i: cython.int
        nearest: cython.double = INFINITY
        for i in range(self.p + 1):
            if i != c:
                self.side[k] = i
                self.level[k] = self.d[self.corners[s, i]]
                nearest = min(nearest, self.level[k])
                k += 1
        return nearest

    def linear(self, s: cython.int, c: cython.int, room: cython.double) -> cython.double:
        """The least value at corner c of simplex s with T linear, after `face`; sets `share`.

        It may be inf if it is above the nearest corner by `room` or more.
        """
        self.share[0] = self.share[1] = self.share[2] = 0.0
        if self.p == 2:
            return self.over_edge(s, c, 0, 1, INFINITY)
        least: cython.double = self.across(s, c, room)
        if least == INFINITY:
            # Values are convex: the least one is on an edge beyond which that over the whole plane lies.
            is_within: cython.bint[3]
            for k in range(3):
                is_within[k] = self.share[k] > 0.0
            for k in range(3):
                i: cython.int = 1 if k == 0 else 0
                j: cython.int = 1 if k == 2 else 2
                if not is_within[k]:
                    least = self.over_edge(s, c, i, j, least)
        return least

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def over_edge(
        self, s: cython.int, c: cython.int, i: cython.int, j: cython.int, least: cython.double
    ) -> cython.double:
        """The smaller of `least` and the least value over the edge between two corners of `side`; then sets `share`."""
        sq = cython.address(self.mean[s, 0])
        base: cython.double = sq[_pair(self.side[j], self.side[i])]
        to: cython.double = sq[_pair(c, self.side[i])]
        rise: cython.double = self.level[j] - self.level[i]
        rest: cython.double = base - rise * rise
        # From corner i, along the edge to corner j: at one of them if T is steeper than the metric allows.
        along: cython.double = -rise
        far: cython.double = 0.0
        if rest > 0.0:
            along = 0.5 * (base + to - sq[_pair(c, self.side[j])])
            far = sqrt(max(to * base - along * along, 0.0) / rest)
            along -= far * rise
        value: cython.double
        if not along > 0.0:
            along, value = 0.0, self.level[i] + sqrt(to)
        elif along < base and rest > 0.0:
            along /= base
            value = self.level[i] + rise * along + far
        else:
            along, value = 1.0, self.level[j] + sqrt(sq[_pair(c, self.side[j])])
        if not value < least:
            return least
        for k in range(3):
            self.share[k] = 0.0
        self.share[i], self.share[j] = 1.0 - along, along
        return value

    def across(self, s: cython.int, c: cython.int, room: cython.double) -> cython.double:
        """The least value if it lies inside the triangle of `side`, else inf; sets `share`.

        Else shares are those where the value over the whole plane is least, 0 if there is no such place, and 1 if no
        value is above the nearest corner by less than `room`.
        """
        sq = cython.address(self.mean[s, 0])
        to: cython.double = sq[_pair(c, self.side[0])]
        bb: cython.double = sq[_pair(self.side[1], self.side[0])]
        ee: cython.double = sq[_pair(self.side[2], self.side[0])]
        be: cython.double = 0.5 * (bb + ee - sq[_pair(self.side[2], self.side[1])])
        det: cython.double = bb * ee - be * be
        b: cython.double = self.level[1] - self.level[0]
        e: cython.double = self.level[2] - self.level[0]
        if not det > 0.0:
            return INFINITY
        det = 1.0 / det
        wb: cython.double = 0.5 * (bb + to - sq[_pair(c, self.side[1])])
        we: cython.double = 0.5 * (ee + to - sq[_pair(c, self.side[2])])
        # The foot of v on the plane, and the slope of T there, in shares of b and e.
        fb: cython.double = (ee * wb - be * we) * det
        fe: cython.double = (bb * we - be * wb) * det
        height: cython.double = max(to - fb * wb - fe * we, 0.0)
        if height >= room * room:
            self.share[0] = self.share[1] = self.share[2] = 1.0
            return INFINITY
        gb: cython.double = (ee * b - be * e) * det
        ge: cython.double = (bb * e - be * b) * det
        rest: cython.double = 1.0 - gb * b - ge * e
        if not rest > 0.0:
            return INFINITY
        far: cython.double = sqrt(height / rest)
        fb -= far * gb
        fe -= far * ge
        self.share[0], self.share[1], self.share[2] = 1.0 - fb - fe, fb, fe
        if not (fb > 0.0 and fe > 0.0 and fb + fe < 1.0):
            return INFINITY
        return self.level[0] + b * fb + e * fe + far

    def sharpen(self) -> cython.void:
        """Second order, in rounds: each vertex after those it has its distance from, which may be farther away."""
        v: cython.int
        size: cython.int = self.p + 1
        turn: cython.double[3]
        # Changes add up along a path.
        settled: cython.double = SETTLED * self.order.shape[0] ** (-1.0 / self.p)
        is_settled: cython.bint = False
        while not is_settled and not is_interrupted():
            is_settled = True
            self.arrange()
            for at in range(self.order.shape[0]):
                v = self.order[at]
                # Where the metric turns far within a simplex, distances may go in circles: more so each time.
                if not self.pending[v] > settled * self.n_visits[v] or self.fixed[v]:
                    continue
                is_settled = False
                self.pending[v] = 0.0
                self.n_visits[v] += 1
                old: cython.double = self.d[v]
                change: cython.double = 0.0 if self.is_sloped[v] else INFINITY
                for k in range(3):
                    turn[k] = self.slope[v, k]
                self.visit(v)
                span: cython.double = max(fabs(old - self.low), fabs(self.d[v] - self.low))
                change = max(change, fabs(self.d[v] - old) / span)
                for k in range(3):
                    turn[k] = (self.slope[v, k] - turn[k]) / (8.0 * span)
                for k in range(self.first[v], self.first[v + 1]):
                    s: cython.int = self.incident[k] // size
                    most: cython.double = change
                    # T changes by an eighth, in the middle of an edge, of how far a slope changes along it.
                    for c in range(size):
                        u: cython.int = self.corners[s, c]
                        by: cython.double = 0.0
                        for i in range(3):
                            by += turn[i] * (self.V[u, i] - self.V[v, i])
                        most = max(most, fabs(by))
                    for c in range(size):
                        u = self.corners[s, c]
                        if u == v or not most > settled or not most > self.pending[u]:
                            continue
                        # Farther away, v matters to u if it now has a slope or is nearer, and u gains by that.
                        if (
                            self.d[v] < self.d[u]
                            or self.facet[u] // size == s
                            or ((change == INFINITY or self.d[v] < old) and self.through(s, c, self.d[u]) < self.d[u])
                        ):
                            self.pending[u] = most

    def arrange(self) -> cython.void:
        """Order vertices topologically: each behind the corners that it has its distance from, but for circles.

        Vertices of a circle have their distances from each other. What each adds to T linear, the step, may be less
        than 0 by the second order. If it sums to less than 0 around a circle, its vertices lower each other for ever.
        """
        v: cython.int
        size: cython.int = self.p + 1
        n_done: cython.int = 0
        n: cython.int = self.order.shape[0]
        so_far: cython.double = 0.0
        self.roots[:] = self.order
        self.state[:] = 0
        for at in range(n):
            n_open: cython.int = 1
            self.stack[0] = self.roots[at]
            while n_open > 0:
                v = self.stack[n_open - 1]
                if self.state[v] == 0 and self.facet[v] >= 0:
                    self.state[v] = 1
                    so_far += self.step[v]
                    self.sum[v] = so_far
                    k: cython.int = 0
                    for c in range(size):
                        if c == self.facet[v] % size:
                            continue
                        u: cython.int = self.corners[self.facet[v] // size, c]
                        if self.place[v, k] > 0.0:
                            if self.state[u] == 0:
                                self.stack[n_open] = u
                                n_open += 1
                            elif self.state[u] == 1 and self.sum[v] - self.sum[u] + self.step[u] < 0.0:
                                self.open_circle(u, n_open)
                        k += 1
                    continue
                n_open -= 1
                if self.state[v] == 1:
                    so_far = self.sum[v] - self.step[v]
                if self.state[v] < 2:
                    self.state[v] = 2
                    self.order[n_done] = v
                    n_done += 1

    def open_circle(self, u: cython.int, n_open: cython.int) -> cython.void:
        """Halve the second order of vertices that depend on u and on which u depends: those open above it."""
        w: cython.int = -1
        while w != u:
            n_open -= 1
            w = self.stack[n_open]
            if self.state[w] == 1:
                self.weight[w] *= 0.5
                self.pending[w] = INFINITY

    def visit(self, v: cython.int) -> cython.void:
        """Give v the least value over its simplices, and the slope that goes with it.

        With T linear it is at most that at the last place, so that it never rises but with the distances there. By the
        second order it may, since the slopes there changed, and rise again and again. What it rises so is summed.
        """
        size: cython.int = self.p + 1
        rise: cython.double = -INFINITY
        best: cython.double = INFINITY
        best_at: cython.int = -1
        kept: cython.double[3]
        # The facet of the last visit first: it rules out most of the others.
        for k in range(self.first[v] - 1, self.first[v + 1]):
            at: cython.int = self.facet[v] if k < self.first[v] else self.incident[k]
            if at < 0 or (at == self.facet[v] and k >= self.first[v]):
                continue
            s: cython.int = at // size
            c: cython.int = at % size
            value: cython.double = self.through(s, c, best)
            if k < self.first[v]:
                rise = -self.step[v]
                for i in range(self.p):
                    rise -= self.place[v, i] * self.level[i]
            # Facets that share the best place have equal values but for rounding: the first one stays.
            if value + EQUAL * fabs(value) < best:
                best, best_at = value, at
                for i in range(self.p):
                    kept[i] = self.share[i]
        if best_at < 0:
            return
        self.risen[v] += max(rise + best, 0.0)
        if self.risen[v] > RISEN * (best - self.low):
            self.risen[v] = 0.0
            self.weight[v] *= 0.5
        s, c = best_at // size, best_at % size
        self.face(s, c)
        self.d[v], self.facet[v], self.step[v] = best, best_at, best
        most: cython.int = 0
        for i in range(self.p):
            self.share[i] = self.place[v, i] = kept[i]
            self.step[v] -= kept[i] * self.level[i]
            if kept[i] > kept[most]:
                most = i
        self.label[v] = self.label[self.corners[s, self.side[most]]]
        self.lay(s, c)
        self.find_slope(s, c)

    def through(self, s: cython.int, c: cython.int, best: cython.double) -> cython.double:
        """The value at corner c of second order through simplex s, inf if it cannot be below `best`; sets `share`.

        Its lower bound is what T linear and the nearest corner say, with some margin.
        """
        nearest: cython.double = self.face(s, c)
        # Between corners at one distance from a point, the square is less by at most a third of a squared edge.
        most: cython.double = 0.5 * self.widest[s]
        near: cython.double = max(nearest - self.low, sqrt(most))
        sag: cython.double = near - sqrt(max(near * near - most, 0.0))
        room: cython.double = (best + sag - nearest) / self.slack[s]
        if not room > 0.0:
            return INFINITY
        linear: cython.double = self.linear(s, c, room)
        return self.curved(s, c, best) if linear - nearest < room else INFINITY

    def lay(self, s: cython.int, c: cython.int) -> cython.void:
        """What `Facet` knows of the metric of s, after `face`."""
        if self.q == 1:
            sq = cython.address(self.mean[s, 0])
            m = cython.address(self.product[0])
            for i in range(self.p):
                m[4 * i] = sq[_pair(c, self.side[i])]
                for j in range(i):
                    between: cython.double = m[4 * i] + m[4 * j] - sq[_pair(self.side[i], self.side[j])]
                    m[3 * i + j] = m[3 * j + i] = 0.5 * between
            return
        self.growth = self.growths[s]
        for i in range(4):  # the fourth of a triangle has the share 0
            at: cython.int = c if i == 0 or i > self.p else self.side[i - 1]
            self.W[i] = cython.address(self.velocity[self.rows[s, at], 0])
            self.s[i] = mean_velocity(self.W[i])
        for i in range(self.p):
            for k in range(3):
                self.E[i][k] = self.V[self.corners[s, self.side[i]], k] - self.V[self.corners[s, c], k]

    def curved(self, s: cython.int, c: cython.int, limit: cython.double) -> cython.double:
        """The least value at corner c of simplex s with T of second order, after `linear`; sets `share`.

        It may be inf if it is not below `limit`.
        """
        self.start = INFINITY
        for i in range(self.p):
            self.start = min(self.start, self.offset[self.label[self.corners[s, self.side[i]]]])
        self.lay(s, c)
        is_source: cython.bint = False
        x: cython.double[3]
        for i in range(self.p):
            self.D[i] = self.level[i] - self.start
            is_source = is_source or not self.D[i] > 0.0
        if is_source and self.q > 1:
            # T is not linear on an edge to the source, and its square not quadratic.
            return self.along_edges()
        for i in range(self.p):
            x[i] = self.trust(s, c, i)
            for j in range(i):
                sag: cython.double = self.sag_between(s, i, j, x[i] - x[j], min(x[i], x[j]))
                self.sag[i][j] = self.sag[j][i] = self.weight[self.corners[s, c]] * sag
        best: cython.double = self.newton(limit)
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

    def sag_between(
        self, s: cython.int, i: cython.int, j: cython.int, more: cython.double, trusted: cython.double
    ) -> cython.double:
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
        v: cython.int = self.corners[s, self.side[i]]
        u: cython.int = self.corners[s, self.side[j]]
        if self.label[v] != self.label[u] or not (self.is_sloped[v] and self.is_sloped[u]):
            return 0.0
        Di: cython.double = self.D[i]
        Dj: cython.double = self.D[j]
        at_i: cython.double = 0.0
        at_j: cython.double = 0.0
        e: cython.double[3]
        for k in range(3):
            e[k] = self.V[u, k] - self.V[v, k]
            at_i += self.slope[v, k] * e[k]
            at_j += self.slope[u, k] * e[k]
        at_i *= 2.0 * Di
        at_j *= 2.0 * Dj
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
        sag -= fabs(doubt) * max(doubt / sag, -doubt / sag, 1.0 - trusted) * (1.0 if sag > 0.0 else -1.0)
        # T above that of first order makes distances longer: if both slopes say so, or one of this very metric, as at a
        # border between two metrics, where the wave at the other end came through the border.
        if sag < 0.0 and trusted + fabs(more) < 1.0 - EQUAL:
            sag *= trusted
        square_i: cython.double = self.mean[s, _pair(self.side[i], self.side[j])]
        square_j: cython.double = square_i
        if self.q > 1:
            _squares(cython.address(self.inverses[self.rows[s, self.side[i]], 0]), e, 1, cython.address(square_i))
            _squares(cython.address(self.inverses[self.rows[s, self.side[j]], 0]), e, 1, cython.address(square_j))
        from_i: cython.double = 2.0 * Di * sqrt(square_i)
        from_j: cython.double = 2.0 * Dj * sqrt(square_j)
        most: cython.double = min(rise + from_i, from_j - rise) - level
        least: cython.double = max(rise - from_i, -from_j - rise) - level
        return max(min(sag, most), least)

    def trust(self, s: cython.int, c: cython.int, i: cython.int) -> cython.double:
        """How far the slope at a corner i of `side` has length 1 in simplex s, as unless metrics jump: from 0 to 1.

        With the square of the logarithm, distances have a derivative where metrics begin to differ.
        """
        v: cython.int = self.corners[s, self.side[i]]
        if not self.is_sloped[v]:
            return 0.0
        e: cython.double[3]
        for j in range(3):
            e[j] = self.slope[v, j] if self.q > 1 else 0.0
            if self.q == 1 and j < self.p:
                for k in range(3):
                    e[j] += self.slope[v, k] * (
                        self.V[self.corners[s, self.side[j]], k] - self.V[self.corners[s, c], k]
                    )
        square: cython.double = self.dual(i + 1 if self.q > 1 else 0, e)
        square = log(square) if square > 0.0 else 1.0
        return max(1.0 - square * square, 0.0)

    def find_slope(self, s: cython.int, c: cython.int) -> cython.void:
        """The derivative of the length of v - x by the position of v, at the best place x."""
        v: cython.int = self.corners[s, c]
        E: cython.double[9]
        lean: cython.double[3]
        self.is_sloped[v] = self.length(self.share) > 0.0
        for i in range(self.p):
            lean[i] = self.lean(i)
            for k in range(3):
                E[3 * i + k] = self.V[self.corners[s, self.side[i]], k] - self.V[v, k]
        _gradient(E, lean, self.p, cython.address(self.slope[v, 0]))
