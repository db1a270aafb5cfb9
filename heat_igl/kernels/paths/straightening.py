"""Paths straightened within their class: in the strip, past bends, and past vertices that may be passed on both sides.

A funnel finds the shortest path in a strip. If the path bends at a vertex although another way around it has an angle
of less than pi, the strip is led that way, which makes the path shorter (Xin and Wang 2007); this is repeated until no
such bend is left. At vertices with less than 2 pi both ways can be locally shortest, and the other one is tried.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.segments import Segments
from cython.cimports.heat_igl.kernels.paths.straightening import (
    GAIN,
    MARGIN_OF_TURN,
    MOST_CHOICES,
    MOST_TRIED,
    NEARLY_STRAIGHT,
    Choice,
)
from cython.cimports.heat_igl.kernels.paths.strips import (
    Detour,
    FaceTable,
    Funnel,
    Place,
    Sides,
    Strip,
    at_corner,
    corner_of,
    moved,
    vertex_at,
    weighted,
)
from cython.cimports.libc.math import INFINITY, M_PI, acos, atan2, cos, fabs, sqrt

_CHOICE = np.dtype([("saved", "f8"), ("vertex", "i4"), ("first", "i4"), ("last", "i4")], align=True)


@cython.final
@cython.cclass
class Course:
    """A path on its way, and the segments of all paths so far.

    It starts at `start` in `face`, at `vertex` if that is not -1, and ends at `end` in the last face of the strip.
    """

    def __init__(self, s: FaceTable, n_corners):
        self.s = s
        self.strip, self.straighter, self.detour, self.funnel = Strip(), Strip(), Detour(n_corners), Funnel()
        self.segments = Segments()

    def begin(self, face: cython.int, start: Place) -> cython.void:
        """Begin a strip."""
        self.face, self.start, self.strip.count = face, start, 0
        self.vertex = vertex_at(self.s, face, cython.address(start))

    def last_face(self) -> cython.int:
        """The face that the strip ends in."""
        return self.strip.crossing[self.strip.count - 1].enter // 3 if self.strip.count > 0 else self.face

    def turn(self, v: cython.int, goal: cython.int) -> cython.bint:
        """Lead the strip, which ends at vertex v, around it to face `goal`, the shorter way; False if there is none."""
        f: cython.int = self.last_face()
        if f == goal:
            return True
        nothing: Sides
        nothing.this = nothing.other = 0.0
        h: cython.int = 3 * f + (corner_of(self.s, f, v) + 1) % 3
        count: cython.int = self.detour.find(self.s, v, h, nothing, goal, -1, nothing, INFINITY)
        self.strip.extend(self.detour.way, 0, count)
        return count >= 0

    def settle(self) -> cython.double:
        """Lead the strip until the shortest path in it is locally shortest; returns the length."""
        shortest: cython.double = INFINITY
        failures: cython.int = 0
        while True:
            length: cython.double = self.lay_out()
            # Rounding can make two ways around a vertex look shorter than one another.
            failures = 0 if length < shortest * (1.0 - 1e-13) else failures + 1
            shortest = min(shortest, length)
            if failures > 3 or not self.repair():
                break
        return length

    def lay_out(self) -> cython.double:
        """Find the shortest path in the strip as it is; returns the length."""
        self._trim()
        self.funnel.lay_out(self.s, self.face, cython.address(self.start), self.strip)
        end = cython.address(self.end)
        self.funnel.pull_tight(weighted(end, self.funnel.last.x), weighted(end, self.funnel.last.y))
        return self.funnel.length()

    def repair(self) -> cython.int:
        """Lead the strip the other way around the bends if that is shorter; 0 if there are none."""
        self.straighter.count = 0
        copied: cython.int = 0
        has_changed: cython.bint = False
        for i in range(1, self.funnel.n_bends - 1):
            bend = cython.address(self.funnel.bend[i])
            # Two bends repaired at once must not share a face.
            if has_changed and bend.first <= copied:
                continue
            count: cython.int = self._shorter_way(i)
            if count < 0:
                continue
            self.straighter.extend(self.strip.crossing, copied, bend.first)
            self.straighter.extend(self.detour.way, 0, count)
            copied, has_changed = bend.last + 1, True
        if not has_changed:
            return 0
        self.straighter.extend(self.strip.crossing, copied, self.strip.count)
        self.strip.copy(self.straighter)
        return 1

    def _shorter_way(self, i: cython.int) -> cython.int:
        """Find a shorter way around the i-th bend; returns the number of crossings in ``detour.way``, -1 if none."""
        bend = cython.address(self.funnel.bend[i])
        first = cython.address(self.funnel.gate[bend.first])
        last = cython.address(self.funnel.gate[bend.last])
        v: cython.int = first.vertex[bend.side]
        far: cython.int = 1 - bend.side
        h: cython.int = self.strip.crossing[bend.first].leave
        g: cython.int = self.strip.crossing[bend.last].enter
        f: cython.int = h // 3
        e: cython.int = g // 3
        if f == e:
            return 0  # straight through this face
        from_here = cython.address(self.funnel.bend[i - 1])
        to_there = cython.address(self.funnel.bend[i + 1])
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

    def _is_one_way(self, first: cython.int, last: cython.int, v: cython.int) -> cython.bint:
        """Whether these crossings at v neither close around it nor cross an edge at which ways branch.

        Then the angle on the side of the strip, pi at least, is the only one there.
        """
        for j in range(first, last + 1):
            if self.s.twin[self.strip.crossing[j].leave] < 0:
                return False
        return last - first < self.s.first_corner[v + 1] - self.s.first_corner[v] - 1

    def _trim(self) -> cython.void:
        """Drop crossings of edges on which the path starts or ends: rounding would put it on either side."""
        n_dropped: cython.int = 0
        end_vertex: cython.int = vertex_at(self.s, self.last_face(), cython.address(self.end))
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
            elif self.end.c[g % 3] != 0.0:
                break
            else:
                self.end = moved(self.s, g, h, cython.address(self.end))
            self.strip.count -= 1
        if self.vertex >= 0:
            self.start = at_corner(corner_of(self.s, self.face, self.vertex))
        if end_vertex >= 0:
            self.end = at_corner(corner_of(self.s, self.last_face(), end_vertex))

    def emit(self) -> cython.int:
        """Append the segments of the path through the strip, without those of no length."""
        k: cython.int = self.strip.count
        i: cython.int = 1
        share: cython.double = 0.0
        f: cython.int = self.face
        x: Place = self.start
        y: Place
        n_before: cython.longlong = self.segments.n
        for j in range(k + 1):
            if j == k:
                y = self.end
            else:
                while self.funnel.bend[i].last < j:
                    i += 1
                share = self.funnel.share(j, i)
                y = self._on(j, f, share)
            is_point: cython.bint = x.c[0] == y.c[0] and x.c[1] == y.c[1] and x.c[2] == y.c[2]
            if not is_point or (j == k and self.segments.n == n_before):
                self.segments.append(f, x.c, y.c)
            if j < k:
                f = self.strip.crossing[j].enter // 3
                x = self._on(j, f, share)
        return 0

    def _on(self, j: cython.int, f: cython.int, share: cython.double) -> Place:
        """The place in face f that lies `share` of the way from the right to the left end of crossing j."""
        gate = cython.address(self.funnel.gate[j])
        x: Place
        x.c[0] = x.c[1] = x.c[2] = 0.0
        x.c[corner_of(self.s, f, gate.vertex[0])] = share
        x.c[corner_of(self.s, f, gate.vertex[1])] = 1.0 - share
        return x


@cython.final
@cython.cclass
class Saved:
    """A copy of a course, to return to."""

    def __init__(self):
        self.strip = Strip()

    def save(self, course: Course) -> cython.int:
        """Save a course as it is now."""
        self.face, self.vertex, self.start, self.end = course.face, course.vertex, course.start, course.end
        return self.strip.copy(course.strip)

    def restore(self, course: Course) -> cython.int:
        """Make a course equal to the saved one."""
        course.face, course.vertex, course.start, course.end = self.face, self.vertex, self.start, self.end
        return course.strip.copy(self.strip)


@cython.final
@cython.cclass
class Passing:
    """The vertices that the path of a course may pass on the other side, the most promising first.

    `half_turn` (n,) is the cosine of half the sum of the angles at each vertex, -1 where one side only is shortest.
    """

    def __init__(self, course: Course, half_turn):
        self.course, self.half_turn = course, half_turn
        self.kept, self.choice = Saved(), np.empty(MOST_CHOICES, _CHOICE)
        self.tried = np.empty(MOST_TRIED, np.int32)

    def improve(self, length: cython.double) -> cython.double:
        """Lead a settled path past vertices on the other side while that makes it shorter; returns the length."""
        self.n_tried = 0
        is_better: cython.bint = True
        while is_better and self.propose() > 0:
            is_better = False
            for i in range(self.count):
                if not self.lead(i):
                    continue
                trial: cython.double = self.course.settle()
                if trial < length * (1.0 - GAIN):
                    length = trial
                    is_better = True
                    break
            if not is_better:
                self.kept.restore(self.course)
                self.course.settle()
        return length

    def propose(self) -> cython.int:
        """Keep the strip of a straightened path, and note the vertices not tried before; returns their number.

        Laid flat, a path around one vertex is shorter on the other side if it spans more than half of the angles there.
        """
        self.kept.save(self.course)
        self.count = 0
        for i in range(1, self.course.funnel.n_bends):
            p = cython.address(self.course.funnel.bend[i - 1])
            q = cython.address(self.course.funnel.bend[i])
            squared: cython.double = (q.x - p.x) * (q.x - p.x) + (q.y - p.y) * (q.y - p.y)
            for j in range(p.last + 1, q.first):
                gate = cython.address(self.course.funnel.gate[j])
                for side in range(2):
                    half: cython.double = self.half_turn[gate.vertex[side]]
                    if half <= -1.0:
                        continue
                    if j > p.last + 1 and self.course.funnel.gate[j - 1].vertex[side] == gate.vertex[side]:
                        continue
                    px: cython.double = p.x - gate.x[side]
                    py: cython.double = p.y - gate.y[side]
                    qx: cython.double = q.x - gate.x[side]
                    qy: cython.double = q.y - gate.y[side]
                    product: cython.double = sqrt((px * px + py * py) * (qx * qx + qy * qy))
                    spanned: cython.double = px * qx + py * qy
                    if spanned < (half + MARGIN_OF_TURN) * product:
                        # The law of cosines, for the angles on both sides.
                        turn: cython.double = 2.0 * acos(half) - acos(max(spanned / product, -1.0))
                        self.note(j, side, 2.0 * (product * cos(turn) - spanned) / squared)
        return self.count

    def note(self, j: cython.int, side: cython.int, saved: cython.double) -> cython.int:
        """Insert the vertex at a side of crossing j into the sorted choices."""
        v: cython.int = self.course.funnel.gate[j].vertex[side]
        if not saved > -self.largest_loss or self.is_tried(v):
            return 0
        if self.count == MOST_CHOICES:
            if not saved > self.choice[self.count - 1].saved:
                return 0
            self.count -= 1
        i: cython.int = self.count
        while i > 0 and self.choice[i - 1].saved < saved:
            self.choice[i] = self.choice[i - 1]
            i -= 1
        self.count += 1
        first: cython.int = j
        last: cython.int = j
        while first > 0 and self.course.funnel.gate[first - 1].vertex[side] == v:
            first -= 1
        while last + 1 < self.course.strip.count and self.course.funnel.gate[last + 1].vertex[side] == v:
            last += 1
        choice = cython.address(self.choice[i])
        choice.saved, choice.vertex, choice.first, choice.last = saved, v, first, last
        return 1

    def is_tried(self, v: cython.int) -> cython.bint:
        """Whether the other side of v has been tried."""
        for i in range(self.n_tried):
            if self.tried[i] == v:
                return True
        return False

    def lead(self, i: cython.int) -> cython.int:
        """Lead the strip that was kept around the vertex of choice i the other way; 0 if no faces are there."""
        if self.n_tried == MOST_TRIED:
            return 0
        choice: Choice = self.choice[i]
        self.tried[self.n_tried] = choice.vertex
        self.n_tried += 1
        h: cython.int = self.kept.strip.crossing[choice.first].leave
        g: cython.int = self.kept.strip.crossing[choice.last].enter
        if h // 3 == g // 3:
            return 0
        before: Sides
        after: Sides
        before.this, before.other, after.this, after.other = INFINITY, 0.0, 0.0, 0.0
        count: cython.int = self.course.detour.find(self.course.s, choice.vertex, h, before, g // 3, g, after, INFINITY)
        if count < 0:
            return 0
        self.course.face, self.course.start, self.course.end = self.kept.face, self.kept.start, self.kept.end
        self.course.strip.count = 0
        self.course.strip.extend(self.kept.strip.crossing, 0, choice.first)
        self.course.strip.extend(self.course.detour.way, 0, count)
        self.course.strip.extend(self.kept.strip.crossing, choice.last + 1, self.kept.strip.count)
        return 1


@cython.cfunc
@cython.inline
@cython.nogil
def _angle(ax: cython.double, ay: cython.double, bx: cython.double, by: cython.double) -> cython.double:
    """Angle between two directions, 0 to pi."""
    return atan2(fabs(ax * by - ay * bx), ax * bx + ay * by)
