"""Strips of faces: where they turn around a vertex, how they lie in the plane, and the shortest path in them.

A strip is a sequence of crossings, each from a half-edge of one face to a half-edge of the next on the same edge. If
more than two faces meet at an edge, a strip crosses it from any of them into any other, and the ways around the ends of
the edge branch, so the shortest one is searched for. Faces need not be oriented alike. Laid out in the plane a strip is
a polygon, in which a funnel finds the shortest path (Lee and Preparata 1984).
"""

import cython
import numpy as np
from cython.cimports.libc.math import hypot

_CROSSING = np.dtype([("leave", "i4"), ("enter", "i4")])
_AROUND = np.dtype([("enter", "i4"), ("leave", "i4"), ("before", "i4")])
_TIP = np.dtype([("length", "f8"), ("step", "i4")], align=True)
_GATE = np.dtype([("x", "f8", 2), ("y", "f8", 2), ("vertex", "i4", 2)])
_BEND = np.dtype([("x", "f8"), ("y", "f8"), ("side", "i4"), ("first", "i4"), ("last", "i4")], align=True)


@cython.final
@cython.cclass
class FaceTable:
    """m faces on n vertices, which need not be oriented alike.

    `face` (m,) are structures as `heat_igl.curves.geodesics` makes them, and `edges` are `HalfEdges`. The corners at
    vertex v, numbered like half-edges, are ``corner[first_corner[v]:first_corner[v + 1]]``.
    """

    def __init__(self, face, edges, first_corner, corner):
        self.triangle, self.twin, self.ring = face, edges.twin, edges.ring
        self.first_corner, self.corner = first_corner, corner


@cython.final
@cython.cclass
class Strip:
    """Crossings, `count` of them, in an array that grows."""

    def __init__(self):
        self.crossing = np.empty(64, _CROSSING)

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

    def extend(self, crossing: Crossing[::1], begin: cython.int, end: cython.int) -> cython.int:
        """Add crossings `begin` to `end`, exclusive."""
        for j in range(begin, end):
            self.push(crossing[j].leave, crossing[j].enter)
        return 0

    def copy(self, other: Strip) -> cython.int:
        """Become a copy of another strip."""
        self.count = 0
        return self.extend(other.crossing, 0, other.count)

    def drop(self, k: cython.int) -> cython.void:
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

    def find(
        self,
        s: FaceTable,
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
                if f == start or (s.twin[g] == -2 and self._is_entered(g, n_steps)):
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

    def _is_entered(self, g: cython.int, n_steps: cython.int) -> cython.bint:
        for i in range(n_steps):
            if self.step[i].enter == g:
                return True
        return False

    def _crossings(self, last: cython.int) -> cython.int:
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


@cython.final
@cython.cclass
class Funnel:
    """The crossings of a strip in the plane, `gate`, and the corners of the shortest path through them, `bend`.

    Side "left" is the side of the second of a half-edge's ends for the first crossing, and carried along from there.
    (x, y) is the start of the path.
    """

    def __init__(self):
        self.gate, self.bend = np.empty(64, _GATE), np.empty(66, _BEND)

    def lay_out(
        self, s: FaceTable, face: cython.int, start: cython.pointer[cython.const[Place]], strip: Strip
    ) -> cython.int:
        """Lay out the strip that begins in a face, for paths from `start` there."""
        if strip.count > self.gate.shape[0]:
            with cython.gil:
                self.gate, self.bend = np.empty(2 * strip.count, _GATE), np.empty(2 * strip.count + 2, _BEND)
        p: Corners
        f: cython.int = face
        first = cython.address(s.triangle[f])
        base: cython.double = first.length[2]
        p.x[0], p.y[0], p.x[1], p.y[1] = 0.0, 0.0, base, 0.0
        p.x[2], p.y[2] = base * (1.0 - first.along[2]), base * first.above[2]
        self.first = p
        self.x, self.y = weighted(start, p.x), weighted(start, p.y)
        entered: cython.int = -1
        left: cython.int = -1
        right: cython.int = -1
        for j in range(strip.count):
            corner: cython.int = strip.crossing[j].leave % 3
            if entered < 0:
                left, right = (corner + 2) % 3, (corner + 1) % 3
            elif corner == left:
                left = entered
            else:
                right = entered
            gate = cython.address(self.gate[j])
            gate.x[0], gate.y[0], gate.x[1], gate.y[1] = p.x[left], p.y[left], p.x[right], p.y[right]
            here = cython.address(s.triangle[f])
            gate.vertex[0], gate.vertex[1] = here.vertex[left], here.vertex[right]
            f, entered = strip.crossing[j].enter // 3, strip.crossing[j].enter % 3
            left, right = corner_of(s, f, gate.vertex[0]), corner_of(s, f, gate.vertex[1])
            there = cython.address(s.triangle[f])
            # The far corner over the crossing, from the right end.
            x: cython.double = there.along[entered]
            if right != (entered + 2) % 3:
                x = 1.0 - x
            y: cython.double = there.above[entered]
            ux: cython.double = gate.x[0] - gate.x[1]
            uy: cython.double = gate.y[0] - gate.y[1]
            p.x[left], p.y[left], p.x[right], p.y[right] = gate.x[0], gate.y[0], gate.x[1], gate.y[1]
            p.x[entered], p.y[entered] = gate.x[1] + x * ux + y * uy, gate.y[1] + x * uy - y * ux
        self.n_gates = strip.count
        self.last = p
        return 0

    def pull_tight(self, x: cython.double, y: cython.double) -> cython.void:
        """The shortest path to (x, y): `bend` 0 is the start and the last one the end."""
        k: cython.int = self.n_gates
        count: cython.int = 1
        ax: cython.double = self.x
        ay: cython.double = self.y
        # For each side the limit of the apex's view, and the crossing that set it; -1 for none yet.
        limit_x: cython.double[2]
        limit_y: cython.double[2]
        by: cython.int[2]
        by[0] = by[1] = -1
        self.bend[0] = FunnelCorner(ax, ay, -1, -1, -1)
        j: cython.int = 0
        while j <= k:
            is_turned: cython.bint = False
            for side in range(1, -1, -1):
                px: cython.double = (self.gate[j].x[side] if j < k else x) - ax
                py: cython.double = (self.gate[j].y[side] if j < k else y) - ay
                sign: cython.double = 1.0 if side == 0 else -1.0
                if by[side] >= 0 and sign * (limit_x[side] * py - limit_y[side] * px) > 0.0:
                    continue  # opens the funnel
                opposite: cython.int = 1 - side
                if by[opposite] >= 0 and sign * (limit_x[opposite] * py - limit_y[opposite] * px) < 0.0:
                    bend: FunnelCorner = self.corner(by[opposite], opposite)
                    # Crossings before the last bend come before it, though this vertex may be in sight already.
                    bend.first = max(bend.first, self.bend[count - 1].last)
                    ax, ay, j = bend.x, bend.y, bend.last + 1
                    self.bend[count] = bend
                    count += 1
                    by[0] = by[1] = -1
                    is_turned = True
                    break
                limit_x[side], limit_y[side], by[side] = px, py, j
            if not is_turned:
                j += 1
        self.bend[count] = FunnelCorner(x, y, -1, k, k)
        self.n_bends = count + 1

    def corner(self, at: cython.int, side: cython.int) -> FunnelCorner:
        """An end of the crossing `at`, with all crossings there that share it."""
        gate = cython.address(self.gate[at])
        first: cython.int = at
        last: cython.int = at
        while first > 0 and self.gate[first - 1].vertex[side] == gate.vertex[side]:
            first -= 1
        while last + 1 < self.n_gates and self.gate[last + 1].vertex[side] == gate.vertex[side]:
            last += 1
        return FunnelCorner(gate.x[side], gate.y[side], side, first, last)

    def length(self) -> cython.double:
        """Length of the shortest path."""
        total: cython.double = 0.0
        for i in range(1, self.n_bends):
            total += hypot(self.bend[i].x - self.bend[i - 1].x, self.bend[i].y - self.bend[i - 1].y)
        return total

    def share(self, j: cython.int, i: cython.int) -> cython.double:
        """The share from right end (0) to left end (1) at which the path passes crossing j on the way to bend i."""
        gate = cython.address(self.gate[j])
        if self.bend[i].side >= 0 and self.bend[i].first <= j:
            return 1.0 - self.bend[i].side
        p = cython.address(self.bend[i - 1])
        q = cython.address(self.bend[i])
        ux: cython.double = q.x - p.x
        uy: cython.double = q.y - p.y
        to_left: cython.double = ux * (gate.y[0] - p.y) - uy * (gate.x[0] - p.x)
        to_right: cython.double = ux * (gate.y[1] - p.y) - uy * (gate.x[1] - p.x)
        share: cython.double = to_right / (to_right - to_left) if to_right != to_left else 0.5
        # Between the feet of p and q, the only choice left if the line runs along the crossing.
        ex: cython.double = gate.x[0] - gate.x[1]
        ey: cython.double = gate.y[0] - gate.y[1]
        squared: cython.double = ex * ex + ey * ey
        foot_p: cython.double = ((p.x - gate.x[1]) * ex + (p.y - gate.y[1]) * ey) / squared
        foot_q: cython.double = ((q.x - gate.x[1]) * ex + (q.y - gate.y[1]) * ey) / squared
        share = min(max(share, min(foot_p, foot_q)), max(foot_p, foot_q))
        return min(max(share, 0.0), 1.0)
