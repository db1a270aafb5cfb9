"""Strips of faces, and the shortest way around a vertex from one face to another.

A strip is a sequence of crossings. If more than two faces meet at an edge, it crosses the edge from any of them into
any other, and the ways around the ends of the edge branch, so the shortest one is searched for. Faces need not be
oriented alike.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.strips import Sides
from cython.cimports.heat_igl.kernels.paths.surfaces import Surface, corner_of, other_side

__all__ = ["Detour", "Strip"]

_CROSSING = np.dtype([("leave", "i4"), ("enter", "i4")])
_AROUND = np.dtype([("enter", "i4"), ("leave", "i4"), ("before", "i4")])
_TIP = np.dtype([("length", "f8"), ("step", "i4")], align=True)


@cython.final
@cython.cclass
class Strip:
    """Crossings, `count` of them, in an array that grows."""

    def __init__(self):
        self.crossing = np.empty(64, _CROSSING)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def push(self, leave: cython.int, enter: cython.int) -> cython.int:
        """Add a crossing; two over one edge are joined, and going back takes both away."""
        last: cython.int = self.count - 1
        if last < 0 or self.crossing[last].enter != leave:
            if self.count == self.crossing.shape[0]:
                with cython.gil:
                    self.crossing = np.concatenate([self.crossing, np.empty(self.count, _CROSSING)])
            self.crossing[self.count].leave, self.crossing[self.count].enter = leave, enter
            self.count += 1
        elif self.crossing[last].leave != enter:
            self.crossing[last].enter = enter
        else:
            self.count -= 1
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def drop(self, k: cython.int) -> cython.void:
        """Take away the first k."""
        i: cython.int
        self.count -= k
        for i in range(self.count):
            self.crossing[i] = self.crossing[i + k]


@cython.final
@cython.cclass
class Detour:
    """The shortest way around a vertex; room for vertices of at most `n_corners` corners."""

    def __init__(self, n_corners):
        # Each of the two half-edges at a corner is entered once at most, by ways in both directions.
        room = 4 * n_corners + 4
        self.step, self.tip, self.way = np.empty(room, _AROUND), np.empty(room, _TIP), np.empty(room, _CROSSING)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def find(
        self,
        s: Surface,
        v: cython.int,
        h: cython.int,
        before: Sides,
        goal: cython.int,
        end: cython.int,
        after: Sides,
        limit: cython.double,
    ) -> cython.int:
        """The shortest way around v from the face of half-edge h to face `goal`.

        The length is the sum of the angles at v: in the first face `before`, of h; in the last face `after`, of
        half-edge `end`; and those of the faces between. Returns how many crossings, in `way`; -1 if there is no way, or
        none below `limit`.
        """
        # Dijkstra's algorithm. Ways branch only at edges of more than two faces.
        start: cython.int = h // 3
        n_steps: cython.int = 2
        n_tips: cython.int = 2
        nearest: cython.int
        i: cython.int
        k: cython.int
        self.step[0].enter, self.step[0].leave, self.step[0].before = -1, h, -1
        self.step[1].enter, self.step[1].leave, self.step[1].before = -1, other_side(s, h, v), -1
        self.tip[0].length, self.tip[0].step = before.this, 0
        self.tip[1].length, self.tip[1].step = before.other, 1
        while n_tips > 0:
            nearest = 0
            for i in range(1, n_tips):
                if self.tip[i].length < self.tip[nearest].length:
                    nearest = i
            length: cython.double = self.tip[nearest].length
            at: cython.int = self.tip[nearest].step
            n_tips -= 1
            for i in range(nearest, n_tips):
                self.tip[i] = self.tip[i + 1]
            if length >= limit:
                return -1
            leave: cython.int = self.step[at].leave
            if leave < 0:
                return self._crossings(at)
            edge: cython.int = s.triangle[leave // 3].edge[leave % 3]
            is_crowded: cython.bint = s.first_side[edge + 1] - s.first_side[edge] > 2
            for k in range(s.first_side[edge], s.first_side[edge + 1]):
                g: cython.int = s.side[k]
                f: cython.int = g // 3
                if g == leave or f == start or (is_crowded and self._is_entered(g, n_steps)):
                    continue
                if n_steps == self.step.shape[0]:
                    return -1
                step = cython.address(self.step[n_steps])
                step.enter, step.before = g, at
                angle: cython.double
                if f == goal:
                    step.leave = -1
                    angle = after.this if g == end else after.other
                else:
                    step.leave = other_side(s, g, v)
                    angle = s.triangle[f].angle[corner_of(s, f, v)]
                for i in range(n_tips, nearest, -1):
                    self.tip[i] = self.tip[i - 1]
                self.tip[nearest].length, self.tip[nearest].step = length + angle, n_steps
                n_tips += 1
                n_steps += 1
        return -1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def turn_back(
        self,
        s: Surface,
        v: cython.int,
        h: cython.int,
        before: cython.double,
        end: cython.int,
        after: cython.double,
        limit: cython.double,
    ) -> cython.int:
        """The way around v from the face of half-edge h, away from h, to that of half-edge `end`, not through that one.

        As `find` with the angles `before` and `after` in the first and the last face on this side. Returns how many
        crossings, -1 if there is no way or none below `limit`, and -2 if an edge of more than two faces comes first.
        """
        leave: cython.int = other_side(s, h, v)
        total: cython.double = before + after
        count: cython.int = 0
        while total < limit and count < self.way.shape[0]:
            edge: cython.int = s.triangle[leave // 3].edge[leave % 3]
            first: cython.int = s.first_side[edge]
            n_sides: cython.int = s.first_side[edge + 1] - first
            if n_sides != 2:
                return -1 if n_sides == 1 else -2
            enter: cython.int = s.side[first] + s.side[first + 1] - leave
            self.way[count].leave, self.way[count].enter = leave, enter
            count += 1
            if enter // 3 == end // 3:
                return count
            total += s.triangle[enter // 3].angle[corner_of(s, enter // 3, v)]
            leave = other_side(s, enter, v)
        return -1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _is_entered(self, g: cython.int, n_steps: cython.int) -> cython.bint:
        i: cython.int
        for i in range(n_steps):
            if self.step[i].enter == g:
                return True
        return False

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _crossings(self, last: cython.int) -> cython.int:
        """The crossings of the way with this last step; returns how many."""
        count: cython.int = 0
        at: cython.int = last
        while self.step[at].before >= 0:
            count += 1
            at = self.step[at].before
        i: cython.int
        at = last
        for i in range(count - 1, -1, -1):
            self.way[i].enter = self.step[at].enter
            at = self.step[at].before
            self.way[i].leave = self.step[at].leave
        return count
