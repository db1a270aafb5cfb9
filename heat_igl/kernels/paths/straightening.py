"""The strip of a path, led past vertices the other way until the shortest path in it is locally shortest.

If the path bends at a vertex although another way around it has an angle of less than pi, the strip is led that way,
which makes the path shorter (Xin and Wang 2007); it is repeated until no such bend is left. At most vertices the other
way is the other side.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.funnels import Layout, weighted
from cython.cimports.heat_igl.kernels.paths.straightening import NEARLY_STRAIGHT
from cython.cimports.heat_igl.kernels.paths.strips import Detour, Sides, Strip
from cython.cimports.heat_igl.kernels.paths.surfaces import Place, at_corner, corner_of, moved
from cython.cimports.libc.math import INFINITY, M_PI, atan2, fabs

__all__ = ["Course"]

_SEGMENT = np.dtype([("start", "f8", 3), ("end", "f8", 3), ("face", "i4")], align=True)


@cython.final
@cython.cclass
class Course:
    """A path on its way: the strip from the start, and the segments of all paths so far.

    It starts in `face`: at `vertex`, or at `start` if that is -1.
    """

    def __init__(self, s, n_corners):
        self.s = s
        self.strip, self.straighter, self.detour, self.layout = Strip(), Strip(), Detour(n_corners), Layout()
        self.segment = np.empty(64, _SEGMENT)

    def segments(self):
        """Faces (k,) of all segments, and barycentric coordinates (k, 2, 3) of their starts and ends."""
        some = self.segment.base[: self.n_segments]
        return some["face"].astype(np.int64), np.stack([some["start"], some["end"]], axis=1)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def begin(self, face: cython.int, vertex: cython.int, start: cython.pointer[cython.const[Place]]) -> cython.void:
        """Begin a strip."""
        self.face, self.vertex, self.start = face, vertex, start[0]
        self.strip.count = 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def last_face(self) -> cython.int:
        """The face that the strip ends in."""
        return self.strip.crossing[self.strip.count - 1].enter // 3 if self.strip.count > 0 else self.face

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def turn(self, v: cython.int, f: cython.int, goal: cython.int) -> cython.int:
        """Extend a strip that ends in face f at vertex v to face `goal`, the shorter way round.

        0 if the faces around v do not lead there.
        """
        if f == goal:
            return 1
        nothing: Sides
        nothing.this = nothing.other = 0.0
        h: cython.int = 3 * f + (corner_of(self.s, f, v) + 1) % 3
        count: cython.int = self.detour.find(self.s, v, h, nothing, goal, -1, nothing, INFINITY)
        i: cython.int
        for i in range(count):
            self.strip.push(self.detour.way[i].leave, self.detour.way[i].enter)
        return count >= 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def straighten(self, end_vertex: cython.int) -> cython.double:
        """Append the segments of a locally shortest path through the strip to a vertex; returns the length."""
        end: Place
        length: cython.double = self.settle(end_vertex, cython.address(end))
        self.emit(cython.address(end))
        return length

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def settle(self, end_vertex: cython.int, end: cython.pointer[Place]) -> cython.double:
        """Lead the strip until the shortest path in it is locally shortest; returns the length.

        It ends at `end_vertex`, or, if that is -1, at the place `end` of the last face. `end` moves with the end of the
        strip.
        """
        shortest: cython.double = INFINITY
        failures: cython.int = 0
        while True:
            self.lay_out(end_vertex, end)
            length: cython.double = self.layout.length()
            # Rounding can make two ways around a vertex look shorter than one another.
            failures = 0 if length < shortest * (1.0 - 1e-13) else failures + 1
            shortest = min(shortest, length)
            if failures > 3 or not self._repair():
                break
        return length

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def lay_out(self, end_vertex: cython.int, end: cython.pointer[Place]) -> cython.int:
        """Find the shortest path in the strip as it is, with the end of `settle`."""
        self._trim(end_vertex, end)
        self.layout.lay_out(self.s, self.face, cython.address(self.start), self.strip)
        self.layout.pull_tight(weighted(end, self.layout.last.x), weighted(end, self.layout.last.y))
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def _repair(self) -> cython.int:
        """Lead the strip the other way around the bends if that is shorter; 0 if there are none."""
        self.straighter.count = 0
        copied: cython.int = 0
        has_changed: cython.bint = False
        i: cython.int
        j: cython.int
        for i in range(1, self.layout.n_bends - 1):
            bend = cython.address(self.layout.bend[i])
            # Two bends repaired at once must not share a face.
            if has_changed and bend.first <= copied:
                continue
            count: cython.int = self._shorter_way(i)
            if count < 0:
                continue
            for j in range(copied, bend.first):
                self.straighter.push(self.strip.crossing[j].leave, self.strip.crossing[j].enter)
            for j in range(count):
                self.straighter.push(self.detour.way[j].leave, self.detour.way[j].enter)
            copied, has_changed = bend.last + 1, True
        if not has_changed:
            return 0
        for j in range(copied, self.strip.count):
            self.straighter.push(self.strip.crossing[j].leave, self.strip.crossing[j].enter)
        self.strip.count = 0
        for j in range(self.straighter.count):
            self.strip.push(self.straighter.crossing[j].leave, self.straighter.crossing[j].enter)
        return 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _shorter_way(self, i: cython.int) -> cython.int:
        """Find a shorter way around the i-th bend; returns the number of crossings in ``detour.way``, -1 if none."""
        bend = cython.address(self.layout.bend[i])
        first = cython.address(self.layout.gate[bend.first])
        last = cython.address(self.layout.gate[bend.last])
        v: cython.int = first.vertex[bend.side]
        far: cython.int = 1 - bend.side
        h: cython.int = self.strip.crossing[bend.first].leave
        g: cython.int = self.strip.crossing[bend.last].enter
        f: cython.int = h // 3
        e: cython.int = g // 3
        if f == e:
            return 0  # straight through this face
        from_here = cython.address(self.layout.bend[i - 1])
        to_there = cython.address(self.layout.bend[i + 1])
        before: Sides
        after: Sides
        before.this = _angle(from_here.x - bend.x, from_here.y - bend.y, first.x[far] - bend.x, first.y[far] - bend.y)
        after.this = _angle(to_there.x - bend.x, to_there.y - bend.y, last.x[far] - bend.x, last.y[far] - bend.y)
        before.other = self.s.triangle[f].angle[corner_of(self.s, f, v)] - before.this
        after.other = self.s.triangle[e].angle[corner_of(self.s, e, v)] - after.this
        if self._is_one_way(bend.first, bend.last, v):
            count: cython.int = self.detour.turn_back(
                self.s, v, h, before.other, g, after.other, M_PI - NEARLY_STRAIGHT
            )
            if count >= -1:
                return count
        return self.detour.find(self.s, v, h, before, e, g, after, M_PI - NEARLY_STRAIGHT)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _is_one_way(self, first: cython.int, last: cython.int, v: cython.int) -> cython.bint:
        """Whether these crossings at v neither close around it nor cross an edge at which ways branch.

        Then the angle on the side of the strip, pi at least, is the only one there.
        """
        j: cython.int
        for j in range(first, last + 1):
            h: cython.int = self.strip.crossing[j].leave
            edge: cython.int = self.s.triangle[h // 3].edge[h % 3]
            if self.s.first_side[edge + 1] != self.s.first_side[edge] + 2:
                return False
        return last - first < self.s.first_corner[v + 1] - self.s.first_corner[v] - 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _trim(self, end_vertex: cython.int, end: cython.pointer[Place]) -> cython.void:
        """Drop crossings of edges on which the path starts or ends: rounding would put it on either side."""
        h: cython.int
        g: cython.int
        n_dropped: cython.int = 0
        while n_dropped < self.strip.count:
            h, g = self.strip.crossing[n_dropped].leave, self.strip.crossing[n_dropped].enter
            if self.vertex >= 0:
                if self.s.triangle[h // 3].vertex[h % 3] == self.vertex:
                    break
            elif self.start.c[h % 3] != 0.0:
                break
            else:
                self.start = moved(self.s, h, g, cython.address(self.start))
            self.face = g // 3
            n_dropped += 1
        self.strip.drop(n_dropped)
        while self.strip.count > 0:
            h, g = self.strip.crossing[self.strip.count - 1].leave, self.strip.crossing[self.strip.count - 1].enter
            if end_vertex >= 0:
                if self.s.triangle[g // 3].vertex[g % 3] == end_vertex:
                    break
            elif end.c[g % 3] != 0.0:
                break
            else:
                end[0] = moved(self.s, g, h, end)
            self.strip.count -= 1
        if self.vertex >= 0:
            self.start = at_corner(corner_of(self.s, self.face, self.vertex))
        if end_vertex >= 0:
            end[0] = at_corner(corner_of(self.s, self.last_face(), end_vertex))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def emit(self, end: cython.pointer[cython.const[Place]]) -> cython.int:
        """Append the segments of the path through the strip, without those of no length."""
        k: cython.int = self.strip.count
        if self.n_segments + k + 1 > self.segment.shape[0]:
            with cython.gil:
                self.segment = np.concatenate([self.segment, np.empty(self.n_segments + k + 1, _SEGMENT)])
        i: cython.int = 1
        j: cython.int
        c: cython.int
        share: cython.double = 0.0
        f: cython.int = self.face
        x: Place = self.start
        y: Place
        n_before: cython.int = self.n_segments
        for j in range(k + 1):
            if j == k:
                y = end[0]
            else:
                while self.layout.bend[i].last < j:
                    i += 1
                share = self.layout.share(j, i)
                y = self._on(j, f, share)
            is_point: cython.bint = x.c[0] == y.c[0] and x.c[1] == y.c[1] and x.c[2] == y.c[2]
            if not is_point or (j == k and self.n_segments == n_before):
                segment = cython.address(self.segment[self.n_segments])
                segment.face = f
                for c in range(3):
                    segment.start[c], segment.end[c] = x.c[c], y.c[c]
                self.n_segments += 1
            if j < k:
                f = self.strip.crossing[j].enter // 3
                x = self._on(j, f, share)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _on(self, j: cython.int, f: cython.int, share: cython.double) -> Place:
        """The place in face f that lies `share` of the way from the right to the left end of crossing j."""
        gate = cython.address(self.layout.gate[j])
        x: Place
        x.c[0] = x.c[1] = x.c[2] = 0.0
        x.c[corner_of(self.s, f, gate.vertex[0])] = share
        x.c[corner_of(self.s, f, gate.vertex[1])] = 1.0 - share
        return x


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _angle(ax: cython.double, ay: cython.double, bx: cython.double, by: cython.double) -> cython.double:
    """Angle between two directions, 0 to pi."""
    return atan2(fabs(ax * by - ay * bx), ax * bx + ay * by)
