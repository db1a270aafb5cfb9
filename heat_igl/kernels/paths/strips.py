"""Strips of faces, and the shortest ways around a vertex that they are led.

A strip is a sequence of crossings, each from a half-edge of one face to a half-edge of the next on the same edge. If
more than two faces meet at an edge, a strip crosses it from any of them into any other, and the ways around the ends of
the edge branch, so the shortest one is searched for.
"""

import cython
import numpy as np

_CROSSING = np.dtype([("leave", "i4"), ("enter", "i4")])
_AROUND = np.dtype([("enter", "i4"), ("leave", "i4"), ("before", "i4")])
_TIP = np.dtype([("length", "f8"), ("step", "i4")], align=True)


@cython.final
@cython.cclass
class Strip:
    """Crossings, `count` of them, in an array that grows."""

    def __init__(self):
        self.crossing = np.empty(64, _CROSSING)

    def push(self, leave, enter):
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

    def extend(self, crossing, begin, end):
        """Add crossings `begin` to `end`, exclusive."""
        for j in range(begin, end):
            self.push(crossing[j].leave, crossing[j].enter)
        return 0

    def copy(self, other):
        """Become a copy of another strip."""
        self.count = 0
        return self.extend(other.crossing, 0, other.count)

    def drop(self, k):
        """Take away the first k."""
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

    def find(self, s, v, h, before, goal, end, after, limit):
        """The shortest way around v from the face of half-edge h to face `goal`.

        The length is the sum of the angles at v: in the first face `before`, of h; in the last face `after`, of
        half-edge `end`; and those of the faces between. Returns how many crossings, in `way`; -1 if there is no way, or
        none below `limit`.
        """
        # Dijkstra's algorithm. Ways branch only at edges of more than two faces.
        start: cython.int = h // 3
        n_steps: cython.int = 2
        n_tips: cython.int = 2
        self.step[0].enter, self.step[0].leave, self.step[0].before = -1, h, -1
        self.step[1].enter, self.step[1].leave, self.step[1].before = -1, other_side(s, h, v), -1
        self.tip[0].length, self.tip[0].step = before.this, 0
        self.tip[1].length, self.tip[1].step = before.other, 1
        while n_tips > 0:
            nearest: cython.int = 0
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
            g: cython.int = leave
            while True:
                g = next_side(s, g)
                f: cython.int = g // 3
                if g == leave:
                    break
                is_new: cython.bint = f != start
                if s.twin[g] == -2:
                    for i in range(n_steps):
                        is_new &= self.step[i].enter != g
                if not is_new:
                    continue
                if n_steps == self.step.shape[0]:
                    return -1
                step = cython.address(self.step[n_steps])
                step.enter, step.before = g, at
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

    def _crossings(self, last):
        """The crossings of the way with this last step; returns how many."""
        count: cython.int = 0
        at: cython.int = last
        while self.step[at].before >= 0:
            count += 1
            at = self.step[at].before
        at = last
        for i in range(count - 1, -1, -1):
            self.way[i].enter = self.step[at].enter
            at = self.step[at].before
            self.way[i].leave = self.step[at].leave
        return count
