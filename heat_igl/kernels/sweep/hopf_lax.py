"""Kernel of distance in any metric: the Hopf-Lax formula on each triangle or tetrahedron.

The distance at a corner v of a simplex is the least of T(x) + |v - x| over the points x of the facet opposite, with T
the distance on the facet between its corners, and the length of v - x in the metric of the simplex.

*First order*: T is linear. Then the update is monotone in the distances at the corners, so that updates in any order
lead to one fixed point, which converges to the distance in a continuous metric (Bornemann and Rasch 2006).

*Second order*: the square of T is quadratic, as the squared distance from a point in one metric is, at the source too.
Its second differences along the edges of the facet are found from the slopes of distance at the corners, and are used
as far as these agree with the distances, and with the metric of the simplex.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.heat_igl.kernels.sweep.hopf_lax import (
    FIRST_GAIN,
    FIRST_SETTLED,
    FLAT,
    GAIN,
    MOST_HALVINGS,
    MOST_STEPS,
    MOST_VISITS,
    PLACED,
    SETTLED,
)
from cython.cimports.libc.math import INFINITY, fabs, log, sqrt

__all__ = ["HopfLax"]


@cython.final
@cython.cclass
class HopfLax:
    """Triangles, p = 2, or tetrahedra, p = 3, with a metric on each, or one at each of their corners.

    Parameters
    ----------
    corners : (m, p + 1) int32
        Vertices of each simplex.
    first, incident : (n + 1,) int32, (m (p + 1),) int32
        Corners ``simplex * (p + 1) + corner`` that meet in vertex v, at ``first[v]`` to ``first[v + 1]`` of `incident`.
    squares : (m, q, p + 1, p + 1) float64
        Squared distances between the corners of each simplex, in its metric (q = 1), or in that of each of its corners
        (q = p + 1): the metric is linear in between.
    inverse : (m, 3, 3) float64
        Of the metric of each simplex; not read if q > 1.
    V : (n, 3) float64
        Positions.
    """

    p: cython.int
    q: cython.int
    corners: cython.const[cython.int][:, ::1]
    first: cython.const[cython.int][::1]
    incident: cython.const[cython.int][::1]
    squares: cython.const[cython.double][:, :, :, ::1]
    mean: cython.const[cython.double][:, :, ::1]
    inverse: cython.const[cython.double][:, :, ::1]
    V: cython.const[cython.double][:, ::1]
    queue: PriorityQueue
    pending: cython.double[::1]
    n_visits: cython.int[::1]
    unit: cython.double
    low: cython.double
    fixed: cython.const[cython.uchar][::1]
    d: cython.double[::1]
    label: cython.int[::1]
    handed: cython.double[::1]
    offset: cython.const[cython.double][::1]
    # The derivative of distance by the position of each vertex, where it is known.
    slope: cython.double[:, ::1]
    is_sloped: cython.uchar[::1]
    # The facet that is looked at: its corners in the simplex, their distances, how far T sags below the linear function
    # between each two of them, and the products of the vectors from them to v, in each metric.
    side: cython.int[3]
    D: cython.double[3]
    sag: cython.double[3][3]
    product: cython.double[36]
    start: cython.double
    # The best place on it, and there the derivatives of the length by the shares of the corners.
    share: cython.double[3]
    g: cython.double[3]
    H: cython.double[3][3]

    def __init__(self, corners, first, incident, squares, inverse, V):
        self.inverse = inverse
        self.corners, self.first, self.incident, self.squares, self.V = corners, first, incident, squares, V
        self.p, self.q = corners.shape[1] - 1, squares.shape[1]
        self.unit = np.sqrt(squares.mean())
        self.mean = squares[:, 0] if self.q == 1 else np.ascontiguousarray(squares.mean(axis=1))

    def first_order(self, d, label, offset):
        """Lower distances `d` (n,) to those from the vertices where they are finite, in place.

        They are never below the straight line times the smallest length of a unit vector in any metric.

        Parameters
        ----------
        d, label : (n,) float64, (n,) int32
            Distances, ``inf`` but at the sources, and the source of each, -1 for none; changed.
        offset : (k,) float64
            Of each source.
        """
        n = len(d)
        self.d, self.label, self.offset, self.low = d, label, offset, np.min(d)
        self.fixed = np.isfinite(d).view(np.uint8)
        self.queue = PriorityQueue(n)
        self.handed = np.full(n, np.inf)
        with cython.nogil:
            self.spread(self.low)

    def second_order(self):
        """After `first_order`: change its distances to those of second order."""
        n = self.d.shape[0]
        self.slope, self.is_sloped = np.zeros((n, 3)), np.zeros(n, np.uint8)
        self.pending, self.n_visits = np.where(np.isfinite(self.d), np.inf, 0.0), np.zeros(n, np.int32)
        with cython.nogil:
            self.sharpen(self.fixed, self.low)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def spread(self, low: cython.double) -> cython.void:
        """First order: Dijkstra's algorithm, in which a vertex comes again if its distance falls again."""
        v: cython.int
        k: cython.int
        c: cython.int
        size: cython.int = self.p + 1
        gain: cython.double = FIRST_GAIN
        while True:
            for v in range(self.d.shape[0]):
                if self.d[v] + gain * fabs(self.d[v]) < self.handed[v]:
                    self.queue.set_key(v, 1.0 / (1.0 + (self.d[v] - low) / self.unit))
            while self.queue.count > 0:
                v = cython.cast(cython.int, self.queue.first())
                self.queue.set_key(v, 0.0)
                self.handed[v] = self.d[v]
                for k in range(self.first[v], self.first[v + 1]):
                    s: cython.int = self.incident[k] // size
                    for c in range(size):
                        u: cython.int = self.corners[s, c]
                        if u == v:
                            continue
                        value: cython.double = self.linear(s, c)
                        if value < self.d[u]:
                            self.label[u] = self.label[self.corners[s, self.nearest_corner()]]
                            self.d[u] = value
                            if value + gain * fabs(value) < self.handed[u]:
                                self.queue.set_key(u, 1.0 / (1.0 + (value - low) / self.unit))
            if not gain > GAIN:
                break
            gain *= 0.1

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def nearest_corner(self) -> cython.int:
        """The corner of the simplex that has the largest share of the best place."""
        most: cython.int = 0
        k: cython.int
        for k in range(1, self.p):
            if self.share[k] > self.share[most]:
                most = k
        return self.side[most]

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def face(self, c: cython.int) -> cython.void:
        """Look at the facet opposite corner c."""
        k: cython.int = 0
        i: cython.int
        for i in range(self.p + 1):
            if i != c:
                self.side[k] = i
                self.share[k] = 0.0
                k += 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def linear(self, s: cython.int, c: cython.int) -> cython.double:
        """The least value at corner c of simplex s with T linear; sets `side` and `share`."""
        self.face(c)
        sq = cython.address(self.mean[s, 0, 0])
        size: cython.int = self.p + 1
        best: cython.double = INFINITY
        at: cython.int = 0
        other: cython.int = -1
        place: cython.double = 0.0
        i: cython.int
        j: cython.int
        d: cython.double[3]
        d[2] = INFINITY
        for i in range(self.p):
            d[i] = self.d[self.corners[s, self.side[i]]]
        if self.p == 3 and d[0] < INFINITY and d[1] < INFINITY and d[2] < INFINITY:
            value: cython.double = self.across(s, c, d[0], d[1], d[2])
            if value < INFINITY:
                return value
        for i in range(self.p):
            if d[i] == INFINITY:
                continue
            to: cython.double = sq[size * c + self.side[i]]
            value = d[i] + sqrt(to)
            if value < best:
                best, at, other = value, i, -1
            for j in range(i + 1, self.p):
                if d[j] == INFINITY:
                    continue
                # From corner i, along the edge to corner j.
                base: cython.double = sq[size * self.side[i] + self.side[j]]
                rise: cython.double = d[j] - d[i]
                steep: cython.double = rise * rise / base
                if not steep < 1.0:
                    continue
                along: cython.double = 0.5 * (base + to - sq[size * c + self.side[j]]) / base
                far: cython.double = sqrt(max(to - along * along * base, 0.0) / (1.0 - steep))
                along -= far * rise / base
                if 0.0 < along < 1.0:
                    value = d[i] + rise * along + far
                    if value < best:
                        best, at, other, place = value, i, j, along
        if best < INFINITY:
            self.share[at] = 1.0
            if other >= 0:
                self.share[at], self.share[other] = 1.0 - place, place
        return best

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def across(
        self, s: cython.int, c: cython.int, da: cython.double, db: cython.double, dc: cython.double
    ) -> cython.double:
        """The least value if it lies inside the triangle of `side`, else inf; sets `share` then."""
        sq = cython.address(self.mean[s, 0, 0])
        a: cython.int = self.side[0]
        b: cython.int = self.side[1]
        e: cython.int = self.side[2]
        to: cython.double = sq[4 * c + a]
        bb: cython.double = sq[4 * a + b]
        ee: cython.double = sq[4 * a + e]
        be: cython.double = 0.5 * (bb + ee - sq[4 * b + e])
        det: cython.double = bb * ee - be * be
        if not det > 0.0:
            return INFINITY
        wb: cython.double = 0.5 * (bb + to - sq[4 * c + b])
        we: cython.double = 0.5 * (ee + to - sq[4 * c + e])
        # The foot of v on the plane, and the slope of T there, in shares of b and e.
        fb: cython.double = (ee * wb - be * we) / det
        fe: cython.double = (bb * we - be * wb) / det
        gb: cython.double = (ee * (db - da) - be * (dc - da)) / det
        ge: cython.double = (bb * (dc - da) - be * (db - da)) / det
        steep: cython.double = gb * (db - da) + ge * (dc - da)
        if not steep < 1.0:
            return INFINITY
        far: cython.double = sqrt(max(to - fb * wb - fe * we, 0.0) / (1.0 - steep))
        fb -= far * gb
        fe -= far * ge
        if not (fb > 0.0 and fe > 0.0 and fb + fe < 1.0):
            return INFINITY
        self.share[0], self.share[1], self.share[2] = 1.0 - fb - fe, fb, fe
        return da + (db - da) * fb + (dc - da) * fe + far

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def sharpen(self, fixed: cython.const[cython.uchar][::1], low: cython.double) -> cython.void:
        """Second order: the nearest vertex next, until no distance around any has changed by more than is settled."""
        v: cython.int
        k: cython.int
        c: cython.int
        size: cython.int = self.p + 1
        settled: cython.double = FIRST_SETTLED
        while True:
            for v in range(self.d.shape[0]):
                if self.pending[v] > settled and not fixed[v] and self.n_visits[v] < MOST_VISITS:
                    self.queue.set_key(v, 1.0 / (1.0 + (self.d[v] - low) / self.unit))
            while self.queue.count > 0:
                v = cython.cast(cython.int, self.queue.first())
                self.queue.set_key(v, 0.0)
                self.pending[v] = 0.0
                self.n_visits[v] += 1
                old: cython.double = self.d[v]
                change: cython.double = 0.0 if self.is_sloped[v] else INFINITY
                self.visit(v)
                change = max(change, fabs(self.d[v] - old) / max(fabs(old - low), fabs(self.d[v] - low)))
                for k in range(self.first[v], self.first[v + 1]):
                    s: cython.int = self.incident[k] // size
                    for c in range(size):
                        u: cython.int = self.corners[s, c]
                        if u == v or fixed[u] or not change > self.pending[u]:
                            continue
                        self.pending[u] = change
                        if change > settled and self.n_visits[u] < MOST_VISITS:
                            self.queue.set_key(u, 1.0 / (1.0 + (self.d[u] - low) / self.unit))
            if not settled > SETTLED:
                break
            settled *= 0.1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def visit(self, v: cython.int) -> cython.void:
        """Give v the least value over its simplices, and the slope that goes with it."""
        k: cython.int
        i: cython.int
        size: cython.int = self.p + 1
        best: cython.double = INFINITY
        best_at: cython.int = -1
        kept: cython.double[3]
        for k in range(self.first[v], self.first[v + 1]):
            s: cython.int = self.incident[k] // size
            c: cython.int = self.incident[k] % size
            nearest: cython.double = INFINITY
            for i in range(size):
                if i != c:
                    nearest = min(nearest, self.d[self.corners[s, i]])
            if not nearest < min(best, self.d[v]):
                continue
            value: cython.double = self.curved(s, c)
            if value < best:
                best, best_at = value, self.incident[k]
                for i in range(self.p):
                    kept[i] = self.share[i]
        if best_at < 0:
            return
        s, c = best_at // size, best_at % size
        self.face(c)
        for i in range(self.p):
            self.share[i] = kept[i]
        self.d[v] = best
        self.label[v] = self.label[self.corners[s, self.nearest_corner()]]
        self.lay(s, c)
        self.find_slope(s, c)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def lay(self, s: cython.int, c: cython.int) -> cython.void:
        """Fill `product`: of v's metric first, then of those of the corners of the facet."""
        k: cython.int
        i: cython.int
        j: cython.int
        size: cython.int = self.p + 1
        for k in range(self.q if self.q == 1 else self.p + 1):
            at: cython.int = 0
            if self.q > 1:
                at = c if k == 0 else self.side[k - 1]
            sq = cython.address(self.squares[s, at, 0, 0])
            for i in range(self.p):
                for j in range(self.p):
                    self.product[9 * k + 3 * i + j] = 0.5 * (
                        sq[size * c + self.side[i]]
                        + sq[size * c + self.side[j]]
                        - sq[size * self.side[i] + self.side[j]]
                    )

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def curved(self, s: cython.int, c: cython.int) -> cython.double:
        """The least value at corner c of simplex s with T of second order; sets `side` and `share`."""
        best: cython.double = self.linear(s, c)
        i: cython.int
        j: cython.int
        start: cython.double = INFINITY
        for i in range(self.p):
            u: cython.int = self.corners[s, self.side[i]]
            if self.d[u] == INFINITY:
                return best
            start = min(start, self.offset[self.label[u]])
        self.start = start
        self.lay(s, c)
        is_source: cython.bint = False
        for i in range(self.p):
            self.D[i] = self.d[self.corners[s, self.side[i]]] - start
            is_source = is_source or not self.D[i] > 0.0
        if is_source:
            # Between a source and another corner, distance is that along the straight line.
            return self.along_edges()
        trust: cython.double[3]
        for i in range(self.p):
            trust[i] = 1.0 if self.q > 1 else self.trust(s, self.corners[s, self.side[i]])
        if self.p == 3 and self.is_flat():
            return best
        for i in range(self.p):
            for j in range(i):
                self.sag[i][j] = self.sag[j][i] = self.sag_between(s, i, j) * min(trust[i], trust[j])
        return self.newton()

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def is_flat(self) -> cython.bint:
        """Whether v and the facet lie nearly in one plane: then slopes across it may come from the wrong side."""
        m = cython.address(self.product[0])
        det: cython.double = (
            m[0] * (m[4] * m[8] - m[5] * m[5]) - m[1] * (m[1] * m[8] - m[5] * m[2]) + m[2] * (m[1] * m[5] - m[4] * m[2])
        )
        return det < FLAT * m[0] * m[4] * m[8]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def along_edges(self) -> cython.double:
        """The least value along an edge to v; sets `share`."""
        i: cython.int
        at: cython.int = 0
        best: cython.double = INFINITY
        for i in range(self.p):
            self.share[i] = 0.0
            square: cython.double = self.product[3 * i + i]
            if self.q > 1:
                square = 0.5 * (square + self.product[9 * (i + 1) + 3 * i + i])
            if self.start + self.D[i] + sqrt(square) < best:
                best, at = self.start + self.D[i] + sqrt(square), i
        self.share[at] = 1.0
        return best

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def sag_between(self, s: cython.int, i: cython.int, j: cython.int) -> cython.double:
        """By how much the squared distance between two corners sags below that of T linear, over their shares.

        The squared distance from one point in one metric is a quadratic function: it is found from the slopes at both
        ends, less what these contradict the values by; and T may not be steeper at the ends than the metric allows.
        """
        v: cython.int = self.corners[s, self.side[i]]
        u: cython.int = self.corners[s, self.side[j]]
        if self.label[v] != self.label[u] or not (self.is_sloped[v] and self.is_sloped[u]):
            return 0.0
        Di: cython.double = self.D[i]
        Dj: cython.double = self.D[j]
        at_i: cython.double = 0.0
        at_j: cython.double = 0.0
        k: cython.int
        for k in range(3):
            e: cython.double = self.V[u, k] - self.V[v, k]
            at_i += self.slope[v, k] * e
            at_j += self.slope[u, k] * e
        at_i *= 2.0 * Di
        at_j *= 2.0 * Dj
        rise: cython.double = Dj * Dj - Di * Di
        level: cython.double = (Dj - Di) * (Dj - Di)
        sag: cython.double = 0.5 * (at_j - at_i) - level
        doubt: cython.double = fabs(rise - 0.5 * (at_i + at_j))
        sag = sag - doubt if sag > 0 else sag + doubt
        if fabs(0.5 * (at_j - at_i) - level) <= doubt:
            return 0.0
        at: cython.int = self.side[i] if self.q > 1 else 0
        from_i: cython.double = 2.0 * Di * sqrt(self.squares[s, at, self.side[i], self.side[j]])
        at = self.side[j] if self.q > 1 else 0
        from_j: cython.double = 2.0 * Dj * sqrt(self.squares[s, at, self.side[i], self.side[j]])
        most: cython.double = min(rise + from_i, from_j - rise) - level
        least: cython.double = max(rise - from_i, -from_j - rise) - level
        return max(min(sag, most), least)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def trust(self, s: cython.int, v: cython.int) -> cython.double:
        """How far the slope at v has length 1 in simplex s, as it has where metrics change little: from 0 to 1."""
        if not self.is_sloped[v]:
            return 0.0
        square: cython.double = 0.0
        i: cython.int
        j: cython.int
        for i in range(3):
            for j in range(3):
                square += self.inverse[s, i, j] * self.slope[v, i] * self.slope[v, j]
        return max(1.0 - fabs(log(square)), 0.0) if square > 0.0 else 0.0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def value(self, x: cython.pointer[cython.const[cython.double]], is_sloped: cython.bint) -> cython.double:
        """T(x) + |v - x| for shares x of the corners, inf if there is none; sets its derivatives g and H."""
        i: cython.int
        j: cython.int
        k: cython.int
        p: cython.int = self.p
        mean: cython.double = 0.0
        under: cython.double = 0.0
        square: cython.double = 0.0
        of: cython.double[4]
        by: cython.double[3]
        hang: cython.double[3]
        for i in range(p):
            mean += x[i] * self.D[i]
            hang[i] = 0.0
            for j in range(p):
                if j != i:
                    hang[i] += x[j] * self.sag[i][j]
            under += 0.5 * x[i] * hang[i]
        under = mean * mean - under
        if not under > 0.0:
            return INFINITY
        if self.q == 1:
            for i in range(p):
                by[i] = 0.0
                for j in range(p):
                    by[i] += self.product[3 * i + j] * x[j]
                square += x[i] * by[i]
                by[i] *= 2.0
        else:
            for i in range(p):
                by[i] = 0.0
            of[0] = 0.0
            for k in range(p + 1):
                of[k] = 0.0
                weight: cython.double = 1.0 if k == 0 else x[k - 1]
                for i in range(p):
                    row: cython.double = 0.0
                    for j in range(p):
                        row += self.product[9 * k + 3 * i + j] * x[j]
                    of[k] += x[i] * row
                    by[i] += weight * row
                square += 0.5 * weight * of[k]
            for i in range(p):
                by[i] += 0.5 * of[i + 1]
        if not square > 0.0:
            return INFINITY
        T: cython.double = sqrt(under)
        L: cython.double = sqrt(square)
        if is_sloped:
            for i in range(p):
                hang[i] = (mean * self.D[i] - 0.5 * hang[i]) / T
                by[i] /= 2.0 * L
                self.g[i] = hang[i] + by[i]
            for i in range(p):
                for j in range(i + 1):
                    bend: cython.double = self.product[3 * i + j]
                    if self.q > 1:
                        bend *= 0.5
                        for k in range(p):
                            bend += 0.5 * x[k] * self.product[9 * (k + 1) + 3 * i + j]
                    bend = (bend - by[i] * by[j]) / L
                    bend += (self.D[i] * self.D[j] - (0.5 * self.sag[i][j] if i != j else 0.0) - hang[i] * hang[j]) / T
                    self.H[i][j] = self.H[j][i] = bend
        return self.start + T + L

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def newton(self) -> cython.double:
        """The least value over the facet, by Newton's method from `share`, which is changed."""
        x: cython.double[3]
        y: cython.double[3]
        i: cython.int
        _step: cython.int
        _half: cython.int
        for i in range(3):
            x[i] = self.share[i] if i < self.p else 0.0
            self.share[i] = x[i]
        best: cython.double = self.value(x, True)
        if best == INFINITY:
            # The linear place is on the other side of what T allows: begin in the middle.
            for i in range(self.p):
                x[i] = self.share[i] = 1.0 / self.p
            best = self.value(x, True)
        for _step in range(MOST_STEPS):
            if best == INFINITY:
                return best
            db: cython.double = 0.0
            de: cython.double = 0.0
            if self.p == 2:
                bend: cython.double = self.H[0][0] - 2.0 * self.H[0][1] + self.H[1][1]
                db = _on_interval(self.g[1] - self.g[0], bend, -x[1], x[0])
            else:
                db, de = self.on_triangle(x)
            if fabs(db) + fabs(de) <= PLACED:
                break
            for _half in range(MOST_HALVINGS):
                y[0], y[1], y[2] = max(x[0] - db - de, 0.0), max(x[1] + db, 0.0), max(x[2] + de, 0.0)
                value: cython.double = self.value(y, True)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def on_triangle(self, x: cython.pointer[cython.const[cython.double]]) -> tuple[cython.double, cython.double]:
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
        one: cython.double = _on_interval(gb - be * x[2], bb, -x[1], 1.0 - x[1])
        two: cython.double = -x[2]
        least: cython.double = _model(gb, ge, bb, be, ee, one, two)
        db, de = one, two
        one, two = -x[1], _on_interval(ge - be * x[1], ee, -x[2], 1.0 - x[2])
        value: cython.double = _model(gb, ge, bb, be, ee, one, two)
        if value < least:
            least, db, de = value, one, two
        # With no share of the first corner: db + de = x[0].
        one = _on_interval(gb - ge + (be - ee) * x[0], bb - 2.0 * be + ee, -x[1], 1.0 - x[1])
        two = x[0] - one
        if _model(gb, ge, bb, be, ee, one, two) < least:
            db, de = one, two
        return db, de

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def find_slope(self, s: cython.int, c: cython.int) -> cython.void:
        """The derivative of the length of v - x by the position of v, at the best place x."""
        v: cython.int = self.corners[s, c]
        i: cython.int
        j: cython.int
        k: cython.int
        p: cython.int = self.p
        of: cython.double[4]
        q: cython.double[3]
        e: cython.double[3][3]
        square: cython.double = 0.0
        for i in range(p):
            q[i] = 0.0
        for k in range(1 if self.q == 1 else p + 1):
            weight: cython.double = 1.0
            if self.q > 1:
                weight = 0.5 if k == 0 else 0.5 * self.share[k - 1]
            of[k] = 0.0
            for i in range(p):
                row: cython.double = 0.0
                for j in range(p):
                    row += self.product[9 * k + 3 * i + j] * self.share[j]
                of[k] += self.share[i] * row
                q[i] -= weight * row
            square += weight * of[k]
        L: cython.double = sqrt(square)
        self.is_sloped[v] = False
        if not L > 0.0:
            return
        for i in range(p):
            if self.q > 1:
                q[i] += 0.25 * (of[i + 1] - of[0])
            q[i] /= L
            for k in range(3):
                e[i][k] = self.V[self.corners[s, self.side[i]], k] - self.V[v, k]
        # q are the derivatives along the edges e from v.
        aa: cython.double = 0.0
        ab: cython.double = 0.0
        bb: cython.double = 0.0
        if p == 2:
            for k in range(3):
                aa += e[0][k] * e[0][k]
                ab += e[0][k] * e[1][k]
                bb += e[1][k] * e[1][k]
            det: cython.double = aa * bb - ab * ab
            if det > 0.0:
                for k in range(3):
                    self.slope[v, k] = ((bb * q[0] - ab * q[1]) * e[0][k] + (aa * q[1] - ab * q[0]) * e[1][k]) / det
                self.is_sloped[v] = True
            return
        cross: cython.double[3][3]
        for i in range(3):
            for k in range(3):
                cross[i][k] = (
                    e[(i + 1) % 3][(k + 1) % 3] * e[(i + 2) % 3][(k + 2) % 3]
                    - e[(i + 1) % 3][(k + 2) % 3] * e[(i + 2) % 3][(k + 1) % 3]
                )
        det = e[0][0] * cross[0][0] + e[0][1] * cross[0][1] + e[0][2] * cross[0][2]
        if det != 0.0:
            for k in range(3):
                self.slope[v, k] = (q[0] * cross[0][k] + q[1] * cross[1][k] + q[2] * cross[2][k]) / det
            self.is_sloped[v] = True


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _on_interval(slope: cython.double, bend: cython.double, low: cython.double, high: cython.double) -> cython.double:
    """Where slope x + bend x^2 / 2 is least between two bounds."""
    if bend > 0.0:
        return min(max(-slope / bend, low), high)
    return low if slope * low + 0.5 * bend * low * low < slope * high + 0.5 * bend * high * high else high


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _model(
    gb: cython.double,
    ge: cython.double,
    bb: cython.double,
    be: cython.double,
    ee: cython.double,
    b: cython.double,
    e: cython.double,
) -> cython.double:
    return gb * b + ge * e + 0.5 * (bb * b * b + ee * e * e) + be * b * e
