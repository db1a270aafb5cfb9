"""Kernel of fronts: distance through triangles or tetrahedra that need not fit together.

Each simplex has edge lengths of its own, so two of them may see the edge between them at two lengths: there a front is
refracted. Seen from a vertex, the source lies behind the opposite side of a simplex, at the distances of its corners.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.heat_igl.kernels.sweep.fronts import GAIN, MOST_REGIONS, MOST_VISITS, STRAIGHT
from cython.cimports.heat_igl.kernels.sweep.refraction import Refracted, refracted
from cython.cimports.heat_igl.kernels.sweep.spatial_updates import Edges, across_base, foot
from cython.cimports.libc.math import INFINITY, sqrt

from heat_igl.kernels.signals import raise_caught

__all__ = ["advance"]


def advance(
    order: cython.const[cython.int][::1],
    corners: cython.const[cython.int][:, ::1],
    first: cython.const[cython.int][::1],
    incident: cython.const[cython.int][::1],
    lengths: cython.const[cython.double][:, :, ::1],
    slowness: cython.const[cython.double][::1],
    d: cython.double[::1],
    begin: cython.double[::1],
    label: cython.int[::1],
):
    """Lower `d` (n,) to the best that the simplices of each vertex say, in passes over the given order.

    Parameters
    ----------
    order : (n,) int32
        All vertices, roughly from near to far; a wrong order costs time.
    corners : (m, p + 1) int32
        Triangles, p = 2, or tetrahedra, p = 3.
    first, incident : (n + 1,) int32, (m (p + 1),) int32
        Corners ``simplex * (p + 1) + corner`` that meet in vertex v, at ``first[v]`` to ``first[v + 1]`` of `incident`.
    lengths : (m, p + 1, p + 1) float64
        Distances of the corners, in the metric of the simplex.
    slowness : (m,) float64
        Time per length in each simplex: a front that passes from one to another of a different slowness is bent.
    d : (n,) float64
        The value at which distance begins at each source, ``inf`` elsewhere; on return the distances.
    begin : (n,) float64
        The value at which a front that looks like the one that passes here would have left its source; at first, `d`.
    label : (n,) int32
        The source that distance comes from, -1 where there is none.

    Returns
    -------
    int
        Number of visits.
    """
    n = order.shape[0]
    one = _Fronts()
    one.p = corners.shape[1] - 1
    one.order, one.corners, one.lengths, one.slowness = order, corners, lengths, slowness
    one.first, one.incident, one.d, one.label = first, incident, d, label
    one.begin, one.is_stale = begin, np.ones(n, np.uint8)
    one.arrived, one.entered = np.ones(n), np.zeros(n)
    rank = np.empty(n, np.int32)
    rank[order] = np.arange(n, dtype=np.int32)
    one.rank = rank
    one.only = 0.0
    if one.p == 2:
        _begin_in_own_regions(one, np.asarray(d), np.asarray(begin), np.asarray(label), np.asarray(one.arrived))
    with cython.nogil:
        one.run()
    raise_caught()
    return one.n_visits


def _begin_in_own_regions(one: _Fronts, d, begin, label, arrived):
    """Lower `d` (n,) to the ways that stay in a region, the triangles of one slowness, beside their source.

    Where fronts that passed through faster regions are first, straight lines from the source would be lost.
    """
    sources = np.flatnonzero(np.isfinite(d))
    corners, slowness = np.asarray(one.corners), np.asarray(one.slowness)
    if len(sources) > MOST_REGIONS:
        return
    beside = np.concatenate([np.asarray(one.incident)[one.first[v] : one.first[v + 1]] for v in sources])
    regions = np.unique(slowness[beside // corners.shape[1]])
    if len(regions) > MOST_REGIONS or len(np.unique(slowness)) < 2:
        return
    found = d.copy(), begin.copy(), label.copy(), arrived.copy()
    given = d.copy(), begin.copy(), label.copy(), arrived.copy()
    for region in regions.tolist():
        one.only = region
        for values, start in zip((d, begin, label, arrived), given, strict=True):
            values[:] = start
        np.asarray(one.is_stale)[:] = 1
        with cython.nogil:
            one.run()
        raise_caught()
        nearer = d < found[0]
        for values, kept in zip((d, begin, label, arrived), found, strict=True):
            kept[nearer] = values[nearer]
    one.only = 0.0
    for values, kept in zip((d, begin, label, arrived), found, strict=True):
        values[:] = kept
    np.asarray(one.is_stale)[:] = 1
    np.asarray(one.entered)[:] = 0


@cython.final
@cython.cclass
class _Fronts:
    """What is read and written, by vertex and by simplex.

    `begin` (n,) is the value at which a front that looks like the one that passes here would have left its source, and
    `arrived` (n,) the slowness of the simplex that it came through.
    """

    p: cython.int
    order: cython.const[cython.int][::1]
    corners: cython.const[cython.int][:, ::1]
    lengths: cython.const[cython.double][:, :, ::1]
    slowness: cython.const[cython.double][::1]
    first: cython.const[cython.int][::1]
    incident: cython.const[cython.int][::1]
    d: cython.double[::1]
    label: cython.int[::1]
    begin: cython.double[::1]
    arrived: cython.double[::1]
    entered: cython.double[::1]
    is_stale: cython.uchar[::1]
    rank: cython.const[cython.int][::1]
    n_visits: cython.longlong
    # The best that was found for the vertex that is visited.
    best: cython.double
    best_begin: cython.double
    best_label: cython.int
    best_simplex: cython.int
    best_entered: cython.double
    # Slowness of the triangles that fronts stay in; 0 for all.
    only: cython.double

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def run(self) -> cython.void:
        """Visit all that is stale, in order, until nothing is; what becomes stale again waits for the next pass."""
        n: cython.Py_ssize_t = self.order.shape[0]
        i: cython.Py_ssize_t = 0
        behind: cython.Py_ssize_t = n  # lowest rank of what was passed and is stale again
        self.n_visits = 0
        while i < n and self.n_visits < MOST_VISITS * n:
            v: cython.int = self.order[i]
            i += 1
            if self.is_stale[v]:
                self.is_stale[v] = False
                self.n_visits += 1
                if self.n_visits % ASK == 0 and is_interrupted():
                    break
                behind = min(behind, self.visit(v))
            if behind < i and i == n:
                i, behind = behind, n

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def visit(self, v: cython.int) -> cython.Py_ssize_t:
        """Give v the best that its simplices say; returns the lowest rank of what that makes stale, or n."""
        n: cython.Py_ssize_t = self.order.shape[0]
        lowest: cython.Py_ssize_t = n
        u: cython.int
        k: cython.int
        old: cython.double = self.d[v]
        self.best, self.best_simplex = old, -1
        for k in range(self.first[v], self.first[v + 1]):
            self.through(self.incident[k] // (self.p + 1), self.incident[k] % (self.p + 1))
        if self.best_simplex < 0:
            return n
        self.d[v] = self.best
        self.begin[v], self.label[v] = self.best_begin, self.best_label
        self.arrived[v] = self.slowness[self.best_simplex]
        self.entered[v] = self.best_entered
        if old - self.best <= GAIN * (self.best - self.best_begin):
            return n
        for k in range(self.first[v], self.first[v + 1]):
            s: cython.int = self.incident[k] // (self.p + 1)
            c: cython.int
            for c in range(self.p + 1):
                u = self.corners[s, c]
                # Nearer vertices too: v may be the far corner of the side that their way crosses.
                if not self.is_stale[u] and u != v:
                    self.is_stale[u] = True
                    lowest = min(lowest, self.rank[u])
        return lowest

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def through(self, s: cython.int, v: cython.int) -> cython.void:
        """What corner v of simplex s gets from the other corners: each alone, two at a time, and all three."""
        if self.only != 0.0 and self.slowness[s] != self.only:
            return
        a: cython.int = (v + 1) % (self.p + 1)
        b: cython.int = (v + 2) % (self.p + 1)
        c: cython.int = (v + 3) % (self.p + 1)
        # No point of the opposite side is farther than `reach` from all corners.
        near: cython.double = min(self.d[self.corners[s, a]], self.d[self.corners[s, b]])
        reach: cython.double = 0.5 * self.lengths[s, a, b]
        if self.p == 3:
            near = min(near, self.d[self.corners[s, c]])
            reach = 0.6 * max(self.lengths[s, a, b], self.lengths[s, a, c], self.lengths[s, b, c])
        if not near - reach < self.best or near == INFINITY:
            return
        # Straight through the triangle is the shortest way through the simplex.
        if self.p == 3 and self.across_triangle(s, v, a, b, c):
            return
        self.along_edge(s, v, a)
        self.along_edge(s, v, b)
        self.across_edge(s, v, a, b)
        if self.p == 3:
            self.along_edge(s, v, c)
            self.across_edge(s, v, a, c)
            self.across_edge(s, v, b, c)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def begins(self, s: cython.int, corner: cython.int) -> cython.double:
        """Where the front at a corner seems to begin, seen in simplex s.

        A front that leaves a simplex of slowness c for one of slowness C is flatter by (C / c)^2, seen in time.
        """
        v: cython.int = self.corners[s, corner]
        ratio: cython.double = self.slowness[s] / self.arrived[v]
        if ratio == 1.0:
            return self.begin[v]
        return self.d[v] - (self.d[v] - self.begin[v]) * ratio * ratio

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def take(self, value: cython.double, begin: cython.double, i: cython.int, s: cython.int) -> cython.void:
        """Keep a value of the front at vertex i if it is the best so far."""
        if value < self.best:
            self.best, self.best_begin, self.best_label, self.best_simplex = value, begin, self.label[i], s
            self.best_entered = self.arrived[i] if self.is_refracted(s, i) else self.entered[i]

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def take_later(
        self,
        value: cython.double,
        begin: cython.double,
        behind: cython.double,
        i: cython.int,
        j: cython.int,
        s: cython.int,
    ) -> cython.void:
        """Keep a value of the front that passes between vertices i and j and goes on for `behind`, if it is the best.

        A front that was refracted before is not known well enough to be earlier between two vertices than at both.
        """
        if self.entered[i] != 0.0 or self.entered[j] != 0.0:
            earliest: cython.double = min(self.d[i], self.d[j]) + behind
            if value < earliest:
                begin += earliest - value
                value = earliest
        self.take(value, begin, i, s)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def along_edge(self, s: cython.int, v: cython.int, a: cython.int) -> cython.void:
        """Straight from corner a to v."""
        i: cython.int = self.corners[s, a]
        value: cython.double = self.d[i] + self.lengths[s, v, a]
        if value < self.best:
            self.take(value, self.begins(s, a), i, s)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def across_edge(self, s: cython.int, v: cython.int, a: cython.int, b: cython.int) -> cython.void:
        """Through the edge ab: the source lies in the plane of v, a and b, behind the edge."""
        i: cython.int = self.corners[s, a]
        j: cython.int = self.corners[s, b]
        base: cython.double = self.lengths[s, a, b]
        if not min(self.d[i], self.d[j]) - 0.5 * base < self.best or max(self.d[i], self.d[j]) == INFINITY:
            return
        to_a: cython.double = self.lengths[s, v, a]
        to_b: cython.double = self.lengths[s, v, b]
        before: cython.double = self.length_before(s, i, j)
        if before > 0:
            self.refract(s, v, a, b, before)
            return
        start: cython.double = -INFINITY  # of fronts from several sources: straight
        if self.label[i] == self.label[j]:
            start = self.common_begin(s, a, b)
        start = max(start, min(self.d[i], self.d[j]) - STRAIGHT * (base + to_a))
        da: cython.double = self.d[i] - start
        db: cython.double = self.d[j] - start
        x: cython.double = foot(da, db, base)
        y_squared: cython.double = da * da - x * x
        if not y_squared >= 0:
            return
        along: cython.double = foot(to_a, to_b, base)
        height: cython.double = sqrt(max(to_a * to_a - along * along, 0.0))
        y: cython.double = sqrt(y_squared)
        crossing: cython.double = x * height + along * y  # times y + height
        if 0 <= crossing <= (y + height) * base:
            across: cython.double = sqrt((along - x) * (along - x) + (height + y) * (height + y))
            if self.p == 2:
                self.take_later(start + across, start, across * height / (y + height), i, j, s)
            else:
                self.take(start + across, start, i, s)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def common_begin(self, s: cython.int, a: cython.int, b: cython.int) -> cython.double:
        """Where the front at corners a and b seems to begin, seen in s: as the one of the two says that it met in s."""
        i: cython.int = self.corners[s, a]
        j: cython.int = self.corners[s, b]
        bends_i: cython.bint = self.is_refracted(s, i)
        bends_j: cython.bint = self.is_refracted(s, j)
        if bends_i == bends_j or self.p == 3:
            if bends_i or self.p == 3 or self.entered[i] == self.entered[j]:
                return 0.5 * (self.begins(s, a) + self.begins(s, b))
        elif bends_j and self.entered[i] == self.arrived[j]:
            return self.begin[i]
        elif bends_i and self.entered[j] == self.arrived[i]:
            return self.begin[j]
        return -INFINITY

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def length_before(self, s: cython.int, i: cython.int, j: cython.int) -> cython.double:
        """Length of the edge ij in the triangle from which a front meets triangle s there; 0 if it is not refracted."""
        k: cython.int
        c: cython.int
        if self.p == 3 or self.label[i] != self.label[j]:
            return 0.0
        if not (self.is_refracted(s, i) or self.is_refracted(s, j)):
            return 0.0
        for k in range(self.first[i], self.first[i + 1]):
            other: cython.int = self.incident[k] // 3
            at: cython.int = self.incident[k] % 3
            for c in range(3):
                if self.corners[other, c] == j and other != s:
                    if self.is_refracted(other, i) or self.is_refracted(other, j):
                        return 0.0
                    return self.lengths[other, at, c]
        return 0.0

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def is_refracted(self, s: cython.int, i: cython.int) -> cython.bint:
        """Whether the front at vertex i, if it is not at its source, came through simplices of another slowness."""
        return self.arrived[i] != self.slowness[s] and self.d[i] != self.begin[i]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def refract(self, s: cython.int, v: cython.int, a: cython.int, b: cython.int, before: cython.double) -> cython.void:
        """Through the edge ab, which was `before` long in the triangle that the front came through."""
        i: cython.int = self.corners[s, a]
        j: cython.int = self.corners[s, b]
        base: cython.double = self.lengths[s, a, b]
        to_a: cython.double = self.lengths[s, v, a]
        to_b: cython.double = self.lengths[s, v, b]
        start: cython.double = 0.5 * (self.begin[i] + self.begin[j])
        start = max(start, min(self.d[i], self.d[j]) - STRAIGHT * before)
        da: cython.double = self.d[i] - start
        db: cython.double = self.d[j] - start
        x: cython.double = foot(da, db, before)
        along: cython.double = foot(to_a, to_b, base)
        height: cython.double = sqrt(max(to_a * to_a - along * along, 0.0))
        way: Refracted = refracted(x, sqrt(max(da * da - x * x, 0.0)), before, along, height, base)
        if start + way.length < self.best:
            radius: cython.double = min(way.radius, STRAIGHT * (base + to_a))
            self.take_later(start + way.length, start + way.length - radius, way.behind, i, j, s)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def across_triangle(self, s: cython.int, v: cython.int, a: cython.int, b: cython.int, c: cython.int) -> cython.bint:
        """Through the triangle abc, if the straight line passes there, and whether it does."""
        i: cython.int = self.corners[s, a]
        j: cython.int = self.corners[s, b]
        k: cython.int = self.corners[s, c]
        start: cython.double = -INFINITY
        if self.label[i] == self.label[j] and self.label[i] == self.label[k]:
            start = (self.begins(s, a) + self.begins(s, b) + self.begins(s, c)) / 3
        nearest: cython.double = min(self.d[i], self.d[j], self.d[k])
        start = max(start, nearest - STRAIGHT * (self.lengths[s, a, b] + self.lengths[s, v, a]))
        edges: Edges
        edges.ab, edges.ac, edges.bc = self.lengths[s, a, b], self.lengths[s, a, c], self.lengths[s, b, c]
        edges.va, edges.vb, edges.vc = self.lengths[s, v, a], self.lengths[s, v, b], self.lengths[s, v, c]
        across: cython.double = across_base(
            cython.address(edges), self.d[i] - start, self.d[j] - start, self.d[k] - start
        )
        if across == INFINITY:
            return False
        self.take(start + across, start, i, s)
        return True
