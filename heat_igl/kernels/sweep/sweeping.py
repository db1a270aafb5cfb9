"""Kernel of the sweep: distance by unfolding two triangles at a time, in an order found on the way.

Seen from a vertex v, a source lies behind the side ab of a triangle at v, at the intersection of circles about a and b.
The triangle beyond ab has the third corner w, which is nearer to the source and so places it more accurately:
planar_updates.pxd has the formulas. Here is which vertex is updated when, and from which corners.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.heat_igl.kernels.sweep.planar_updates import (
    across_side,
    across_two,
    beyond_side,
    comes_nearer_to_a,
    crosses_side,
    front_across_side,
    over_one,
)
from cython.cimports.heat_igl.kernels.sweep.spokes import Spoke
from cython.cimports.heat_igl.kernels.sweep.visit_order import VisitOrder
from cython.cimports.libc.math import INFINITY, sqrt

from heat_igl.kernels.signals import raise_caught

# Changes by less than this are not passed on: on a curved surface the sweep is wrong by more anyway.
_NEGLIGIBLE = cython.declare(cython.double, 3e-4)
# In a flat domain it is exact, provided that all changes are passed on.
_SWEEP_ROUNDING = cython.declare(cython.double, 1e-12)
# Visits per vertex up to which the sweep goes back at once, and after which it gives up. Heat's order takes 1.1 in all,
# a random one 20 to 40.
_GO_BACK = cython.declare(cython.int, 10)
_GIVE_UP = cython.declare(cython.int, 50)
# Spokes up to which it costs more to fetch them ahead of time than to wait for them.
_CACHED = cython.declare(cython.int, 1 << 15)
# The order knows so many vertices in advance, whose data can be fetched meanwhile.
_AHEAD = cython.declare(cython.int, 4)


def sweep(
    spokes,
    d: cython.double[::1],
    label,
    offset: cython.const[cython.double][::1],
    group: cython.const[cython.longlong][::1],
    is_stale: cython.uchar[::1],
    width: cython.double,
):
    """Lower `d` (n,) to the best planar unfolding over the triangles of each vertex, until nothing gives less.

    The order of the vertices is found in bands of distance of the given width, see `VisitOrder`. If a vertex
    turns out to be nearer than one that came before it, the sweep goes back to that one at once, before the error there
    spreads. Returns the number of visits per vertex. Vertices that are not in `is_stale` (n,) bool are visited only if
    a value that they depend on changes.

    `label` (n,) int32, None unless there is more than one source, is handed on with the distance: the source that it is
    measured from, -1 if none is reached; ``offset[label]`` is the distance at which that source begins. Circles
    about the ends of a side meet in a source if both ends are measured from it. Between ends of two sources of one
    ``group[label]``, points of a curve, a straight front comes in, from the source of the end that it passes nearer to.
    Between ends of other sources, one end and the corner beyond the side have to be measured from the same.
    """
    n = d.shape[0]
    one = _Sweep()
    one.first, one.spoke = spokes.first, spokes.spoke
    one.is_large = one.spoke.shape[0] > _CACHED
    one.d, one.is_stale, one.offset, one.group = d, is_stale, offset, group
    one.visits = VisitOrder(spokes, d, width)
    one.order, one.rank = one.visits.order, one.visits.rank
    one.is_flat = spokes.is_flat.view(np.uint8)
    one.has_labels = label is not None
    one.label = label if one.has_labels else np.empty(0, np.int32)
    with cython.nogil:
        one.run()
    raise_caught()
    return one.n_visits / n


@cython.final
@cython.cclass
class _Sweep:
    """Arrays that a sweep reads and writes; by vertex but for `order`, the vertices, and `offset`, by source.

    The first `n_ordered` entries of `order` are known, and `visits` finds the others.
    """

    first: cython.const[cython.int][::1]
    spoke: cython.const[Spoke][::1]
    order: cython.int[::1]
    rank: cython.int[::1]
    is_large: cython.bint
    n_ordered: cython.Py_ssize_t
    visits: VisitOrder
    is_flat: cython.const[cython.uchar][::1]
    is_stale: cython.uchar[::1]
    d: cython.double[::1]
    has_labels: cython.bint
    label: cython.int[::1]
    offset: cython.const[cython.double][::1]
    group: cython.const[cython.longlong][::1]
    n_visits: cython.longlong

    @cython.cfunc
    @cython.nogil
    def run(self) -> cython.void:
        """Visit all that is stale, in order, going back where need be."""
        n: cython.Py_ssize_t = self.order.shape[0]
        i: cython.Py_ssize_t = 0
        again: cython.Py_ssize_t = n  # rank to begin at once more when the end is reached
        self.n_visits = 0
        while self.n_visits < _GIVE_UP * n:
            if i + _AHEAD > self.n_ordered and self.n_ordered < n:
                self.n_ordered = self.visits.advance(i, _AHEAD)
            if i == self.n_ordered:
                if again == n:
                    break
                i, again = again, n
            v: cython.int = self.order[i]
            i += 1
            if self.is_large:
                self.read_ahead(i)
            if not self.is_stale[v]:
                continue
            self.is_stale[v] = False
            self.n_visits += 1
            if self.n_visits % ASK == 0 and is_interrupted():
                break
            back: cython.Py_ssize_t = self.visit(v)
            if back < i:
                if self.n_visits < _GO_BACK * n:
                    i = back
                else:
                    again = min(again, back)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def read_ahead(self, i: cython.Py_ssize_t) -> cython.void:
        """Prefetch the data of the next visits: on large meshes that takes longer than the visits."""
        if i + 3 < self.n_ordered:
            prefetch(cython.address(self.first[self.order[i + 3]]))
        if i + 1 < self.n_ordered:
            v = self.order[i + 1]
            for k in range(self.first[v], self.first[v + 1]):
                prefetch(cython.address(self.spoke[k]))
        if i < self.n_ordered:
            v = self.order[i]
            for k in range(self.first[v], self.first[v + 1]):
                prefetch(cython.address(self.d[self.spoke[k].neighbour]))

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def visit(self, v: cython.int) -> cython.Py_ssize_t:
        """Give v the best value from the triangles at it; returns the lowest rank that becomes stale, or n."""
        old: cython.double = self.d[v]
        begin: cython.double = 0.0
        if self.has_labels:
            begin = self.offset[self.label[v]] if self.lower_labelled(v) else 0.0
        else:
            self.lower(v)
        return self.mark(v, old, begin) if self.d[v] < old else self.order.shape[0]

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def lower(self, v: cython.int) -> cython.void:
        """Lower v to the best value from the triangles at it, if there is one source.

        All triangles are computed and the best is chosen without branches, which at random cost more than arithmetic.
        """
        spoke: cython.int = self.first[v]
        best: cython.double = self.d[v]
        across: cython.double = INFINITY  # squared
        # The sides that a straight line crosses, with the squared distance; mostly one or two.
        found: cython.double[SIDES]
        at: cython.int[SIDES]
        n_found: cython.int = 0
        for k in range(self.first[v], self.first[v + 1]):
            s = cython.address(self.spoke[k])
            da: cython.double = self.d[s.neighbour]
            db: cython.double = self.d[s.next_neighbour]
            along: cython.double = da + s.length
            best = along if along < best else best
            at[n_found] = k
            n_found += crosses_side(da, db, s, cython.address(found[n_found])) & ((da < best) | (db < best))
            if n_found == SIDES:
                n_found = _keep_smallest(found, at)
        # By branches, which the processor mostly guesses, and so goes on before the values are there.
        for k in range(n_found):
            if found[k] < across:
                spoke, across = at[k], found[k]
        across = sqrt(across)
        if across < best:
            across = self.seen_from_beyond(spoke, across, cython.NULL)
            best = across if across < best else best
        self.d[v] = best

    @cython.cfunc
    @cython.nogil
    def lower_labelled(self, v: cython.int) -> cython.bint:
        """Lower v to the best value from the triangles at it, with the source of that; whether there is one."""
        best: cython.double = self.d[v]
        across: cython.double = INFINITY  # squared
        # The triangle of the best value of either kind.
        ignored: cython.int = -1
        along_edge: cython.int = v
        spoke: cython.int = self.first[v]
        for k in range(self.first[v], self.first[v + 1]):
            s = cython.address(self.spoke[k])
            da: cython.double = self.d[s.neighbour]
            db: cython.double = self.d[s.next_neighbour]
            if da + s.length < best:
                best, along_edge = da + s.length, s.neighbour
            if not min(da, db) < best:
                continue
            if self.label[s.neighbour] == self.label[s.next_neighbour]:
                begin: cython.double = self.offset[self.label[s.neighbour]]
                squared = begin + sqrt(across_side(da - begin, db - begin, s))
            elif self.is_of_one_curve(self.label[s.neighbour], self.label[s.next_neighbour]):
                squared = front_across_side(da, db, s)
            else:
                squared = self.between_cells(k, best, cython.address(ignored))
            squared = squared * squared
            if squared < across:
                spoke, across = k, squared
        across = sqrt(across)
        nearest: cython.int = self.label[along_edge]
        if across < best:
            source: cython.int = -1
            across = self.seen_from_beyond(spoke, across, cython.address(source))
            if across < best:
                best, nearest = across, source
        if not best < self.d[v]:
            return False
        self.d[v], self.label[v] = best, nearest
        return True

    @cython.cfunc
    @cython.nogil
    def seen_from_beyond(
        self, k: cython.int, across: cython.double, source: cython.pointer[cython.int]
    ) -> cython.double:
        """Distance across the triangle left of spoke k, `across` from the corners of it, and from the one beyond.

        If the corners are not measured from the same source the distance stays. `source` is set to the one it comes
        from, if there are labels.
        """
        s = cython.address(self.spoke[k])
        da: cython.double = self.d[s.neighbour]
        db: cython.double = self.d[s.next_neighbour]
        w: cython.int = s.beyond
        begin: cython.double = 0.0
        if self.has_labels:
            source[0] = self.label[s.neighbour]
            if self.label[s.next_neighbour] != source[0]:
                if not self.is_of_one_curve(source[0], self.label[s.next_neighbour]):
                    return self.between_cells(k, INFINITY, source)
                if not comes_nearer_to_a(da, db, s):
                    source[0] = self.label[s.next_neighbour]
                return across
            begin = self.offset[source[0]]
        if w >= 0 and self.d[w] < across and (not self.has_labels or self.label[w] == source[0]):
            squared: cython.double = across_two(da - begin, db - begin, self.d[w] - begin, s)
            if squared < INFINITY:
                return begin + sqrt(squared)
        return across

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def is_of_one_curve(self, one: cython.int, other: cython.int) -> cython.bint:
        """Whether two sources, -1 for none, are points of the same curve."""
        return one >= 0 and other >= 0 and self.group[one] == self.group[other]

    @cython.cfunc
    @cython.nogil
    def between_cells(self, k: cython.int, below: cython.double, source: cython.pointer[cython.int]) -> cython.double:
        """Distance across the triangle left of spoke k, whose ends are measured from different sources.

        From one corner and the source of it together with the corner beyond, if that is measured from the same.
        `source` is set to the one it comes from; ``inf`` if there is none, or none below `below`.
        """
        s = cython.address(self.spoke[k])
        best: cython.double = INFINITY
        w: cython.int = s.beyond
        if w < 0 or not self.d[w] < below or self.label[w] < 0:
            return best
        begin: cython.double = self.offset[self.label[w]]
        if self.label[w] == self.label[s.neighbour]:
            best = begin + sqrt(over_one(self.d[s.neighbour] - begin, self.d[w] - begin, True, s))
        elif self.label[w] == self.label[s.next_neighbour]:
            best = begin + sqrt(over_one(self.d[s.next_neighbour] - begin, self.d[w] - begin, False, s))
        source[0] = self.label[w]
        return best

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def mark(self, v: cython.int, old: cython.double, begin: cython.double) -> cython.Py_ssize_t:
        """Mark the vertices that a decrease of v's distance from `old` can improve; returns their lowest rank, or n.

        `begin` is the distance at which v's source begins.
        """
        back: cython.Py_ssize_t = self.order.shape[0]
        if self.is_flat[v]:
            if self.d[v] < old * (1 - _SWEEP_ROUNDING):
                back = self.mark_farther(v)
                back = min(back, self.mark_nearer(v, begin))
        elif self.d[v] < old * (1 - _NEGLIGIBLE):
            # With curvature around, the gain that `mark_nearer` finds is less than the sweep's error.
            back = self.mark_farther(v)
        return back

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def mark_farther(self, v: cython.int) -> cython.Py_ssize_t:
        """Mark the farther neighbours, which a smaller d[v] can improve. Those still to come are stale anyway."""
        lowest: cython.Py_ssize_t = self.order.shape[0]
        dv: cython.double = self.d[v]
        for k in range(self.first[v], self.first[v + 1]):
            a: cython.int = self.spoke[k].neighbour
            # Either alone is true at random.
            if (dv < self.d[a]) & (not self.is_stale[a]):
                self.is_stale[a] = True
                lowest = min(lowest, self.rank[a])
        return lowest

    @cython.cfunc
    @cython.nogil
    def mark_nearer(self, v: cython.int, begin: cython.double) -> cython.Py_ssize_t:
        """Mark the nearer neighbours that a smaller d[v] can improve.

        The path of such a one crosses the edge between v and a vertex that is nearer still. That takes an angle there
        whose cosine is below L / (2 d), L the length of the spoke and d counted from `begin`, the offset of the source.
        """
        lowest: cython.Py_ssize_t = self.order.shape[0]
        dv: cython.double = self.d[v] - begin
        for k in range(self.first[v], self.first[v + 1]):
            s = cython.address(self.spoke[k])
            a, b = s.neighbour, s.next_neighbour
            da: cython.double = self.d[a] - begin
            db: cython.double = self.d[b] - begin
            right: cython.double = s.length
            left: cython.double = self.spoke[s.next].length
            if (not self.is_stale[a]) & (db < da) & (2.0 * da * s.along < right * right) and beyond_side(
                s.base, s.along, s.height, left, db, dv
            ) < da * da * self.kept(a):
                self.is_stale[a] = True
                lowest = min(lowest, self.rank[a])
            if (not self.is_stale[b]) & (da < db) & (2.0 * db * (s.base - s.along) < left * left) and beyond_side(
                s.base, s.base - s.along, s.height, right, da, dv
            ) < db * db * self.kept(b):
                self.is_stale[b] = True
                lowest = min(lowest, self.rank[b])
        return lowest

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def kept(self, v: cython.int) -> cython.double:
        """The part of v's distance that a shorter one must fall below to count."""
        return 1 - _SWEEP_ROUNDING if self.is_flat[v] else 1 - _NEGLIGIBLE


@cython.cfunc
@cython.nogil
def _keep_smallest(values: cython.pointer[cython.double], at: cython.pointer[cython.int]) -> cython.int:
    """Keep the smallest of `SIDES` values, and the place of it; returns how many are left, one."""
    for i in range(1, SIDES):
        if values[i] < values[0]:
            values[0], at[0] = values[i], at[i]
    return 1
