"""Paths led past vertices on the other side: at a vertex with less than 2 pi, both ways can be locally shortest."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.passing import (
    MARGIN_OF_TURN,
    MOST_CHOICES,
    MOST_TRIED,
    Choice,
)
from cython.cimports.heat_igl.kernels.paths.straightening import Course
from cython.cimports.heat_igl.kernels.paths.strips import Sides, Strip
from cython.cimports.libc.math import INFINITY, acos, cos, sqrt

__all__ = ["Passing", "Saved"]

_CHOICE = np.dtype([("saved", "f8"), ("vertex", "i4"), ("first", "i4"), ("last", "i4")], align=True)


@cython.final
@cython.cclass
class Saved:
    """A copy of the strip of a course and of its start, to return to."""

    def __init__(self):
        self.strip = Strip()

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def save(self, course: Course) -> cython.int:
        """Save a course as it is now."""
        self.face, self.vertex, self.start = course.face, course.vertex, course.start
        return copy(course.strip, self.strip)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def restore(self, course: Course) -> cython.int:
        """Make a course equal to the saved one."""
        course.face, course.vertex, course.start = self.face, self.vertex, self.start
        return copy(self.strip, course.strip)


@cython.final
@cython.cclass
class Passing:
    """The strip of a path, and the vertices that it may pass on the other side, the most promising first.

    `half_turn` (n,) is the cosine of half the sum of the angles at each vertex, -1 where one side only is shortest.
    """

    def __init__(self, course: Course, half_turn):
        self.course, self.half_turn = course, half_turn
        self.kept, self.choice = Saved(), np.empty(MOST_CHOICES, _CHOICE)
        self.tried = np.empty(MOST_TRIED, np.int32)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def propose(self) -> cython.int:
        """Keep the strip of a straightened path, and note the vertices not tried before; returns their number.

        Laid flat, a path around one vertex is shorter on the other side if it spans more than half of the angles there.
        """
        self.kept.save(self.course)
        self.count = 0
        i: cython.int
        j: cython.int
        side: cython.int
        for i in range(1, self.course.layout.n_bends):
            p = cython.address(self.course.layout.bend[i - 1])
            q = cython.address(self.course.layout.bend[i])
            squared: cython.double = (q.x - p.x) * (q.x - p.x) + (q.y - p.y) * (q.y - p.y)
            for j in range(p.last + 1, q.first):
                gate = cython.address(self.course.layout.gate[j])
                for side in range(2):
                    half: cython.double = self.half_turn[gate.vertex[side]]
                    if half <= -1.0:
                        continue
                    if j > p.last + 1 and self.course.layout.gate[j - 1].vertex[side] == gate.vertex[side]:
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def note(self, j: cython.int, side: cython.int, saved: cython.double) -> cython.int:
        """Insert the vertex at a side of crossing j into the sorted choices."""
        v: cython.int = self.course.layout.gate[j].vertex[side]
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
        while first > 0 and self.course.layout.gate[first - 1].vertex[side] == v:
            first -= 1
        while last + 1 < self.course.strip.count and self.course.layout.gate[last + 1].vertex[side] == v:
            last += 1
        choice = cython.address(self.choice[i])
        choice.saved, choice.vertex, choice.first, choice.last = saved, v, first, last
        return 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def is_tried(self, v: cython.int) -> cython.bint:
        """Whether the other side of v has been tried."""
        i: cython.int
        for i in range(self.n_tried):
            if self.tried[i] == v:
                return True
        return False

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
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
        self.course.face, self.course.start, self.course.strip.count = self.kept.face, self.kept.start, 0
        j: cython.int
        for j in range(choice.first):
            self.course.strip.push(self.kept.strip.crossing[j].leave, self.kept.strip.crossing[j].enter)
        for j in range(count):
            self.course.strip.push(self.course.detour.way[j].leave, self.course.detour.way[j].enter)
        for j in range(choice.last + 1, self.kept.strip.count):
            self.course.strip.push(self.kept.strip.crossing[j].leave, self.kept.strip.crossing[j].enter)
        return 1


@cython.cfunc
@cython.nogil
@cython.exceptval(-1, check=False)
def copy(this: Strip, there: Strip) -> cython.int:
    """Copy a strip."""
    j: cython.int
    there.count = 0
    for j in range(this.count):
        there.push(this.crossing[j].leave, this.crossing[j].enter)
    return 0
