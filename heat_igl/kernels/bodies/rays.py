"""Tetrahedra of a body, what lies beside them, and straight lines from one to the next."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.rays import NUDGE, ON_SIDE, Line
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.libc.math import fabs, sqrt

# What lies behind a side that has not been looked at.
_UNKNOWN = cython.declare(cython.int, -2)
# Tetrahedra along a line, and those around a vertex that are walked through before all are tried one by one.
_MOST_STEPS = cython.declare(cython.int, 1000000)
_MOST_TURNS = cython.declare(cython.int, 20)


@cython.final
@cython.cclass
class Body:
    """A body of tetrahedra in space.

    `cells` (m, 8) has the corners of the tetrahedra, then the corner ``4 * tetrahedron + corner`` behind the side
    opposite each, -1 on the boundary; the neighbours of vertex v are at ``first_neighbour[v]`` to
    ``first_neighbour[v + 1]`` of `neighbours`, and `reach` (n,) is the longest edge at each vertex.

    It is made of tetrahedra `corners` (m, 4) int32, positions (n, 3) of the vertices, and the corners
    ``4 * tetrahedron + corner`` that meet in vertex v, at ``first[v]`` to ``first[v + 1]`` of `incident`.
    """

    def __init__(
        self,
        corners: cython.const[cython.int][:, ::1],
        first: cython.const[cython.int][::1],
        incident: cython.const[cython.int][::1],
        positions: cython.const[cython.double][:, ::1],
    ):
        self._arrays = tuple(map(np.asarray, (corners, first, incident, positions)))
        self.first, self.incident, self.positions = first, incident, positions
        n: cython.Py_ssize_t = positions.shape[0]
        m: cython.Py_ssize_t = corners.shape[0]
        self.cells, self.reach = np.full((m, 8), _UNKNOWN, np.int32), np.zeros(n)
        np.asarray(self.cells)[:, :4] = corners
        counts, all_marks = np.zeros(n + 1, np.int32), np.full(n, -1, np.int32)
        n_around: cython.int[::1] = counts
        mark: cython.int[::1] = all_marks
        one_list: cython.int[::1] = np.empty(n, np.int32)
        with cython.nogil:
            for i in range(4 * m):
                if self.cells[i // 4, 4 + i % 4] == _UNKNOWN:
                    self.cells[i // 4, 4 + i % 4] = self.across(i // 4, i % 4)
            for i in range(n):
                n_around[i + 1] = self.list_around(i, mark, one_list, 0)
        all_marks[:] = -1
        self.first_neighbour = np.cumsum(counts, dtype=np.int32)
        self.neighbours = np.empty(int(self.first_neighbour[n]), np.int32)
        with cython.nogil:
            for i in range(n):
                self.list_around(i, mark, self.neighbours, self.first_neighbour[i])
                for k in range(self.first_neighbour[i], self.first_neighbour[i + 1]):
                    self.reach[i] = max(self.reach[i], self.apart(i, self.neighbours[k]))

    def __reduce__(self):
        """What it was made of."""
        return Body, self._arrays

    def sides_behind(self):
        """The tetrahedron (m, 4) behind the side opposite each corner, -1 on the boundary."""
        return np.asarray(self.cells)[:, 4:] >> 2

    def across(self, t, o):
        """The corner behind the side of t opposite corner o, or -1; its tetrahedron is told as well."""
        a: cython.int = self.cells[t, (o + 1) % 4]
        b: cython.int = self.cells[t, (o + 2) % 4]
        c: cython.int = self.cells[t, (o + 3) % 4]
        for k in range(self.first[a], self.first[a + 1]):
            other: cython.int = self.incident[k] // 4
            if other != t:
                n_shared: cython.int = 0
                beside: cython.int = 0
                for i in range(4):
                    u: cython.int = self.cells[other, i]
                    if u in (a, b, c):
                        n_shared += 1
                    else:
                        beside = i
                if n_shared == 3:
                    # The first other one of that is t, unless an earlier one has been there.
                    if self.cells[other, 4 + beside] == _UNKNOWN:
                        self.cells[other, 4 + beside] = 4 * t + o
                    return 4 * other + beside
        return -1

    def list_around(self, v, mark, into, at):
        """Write the neighbours of v down from a place on; returns the place behind them."""
        mark[v] = v
        for k in range(self.first[v], self.first[v + 1]):
            for c in range(4):
                u: cython.int = self.cells[self.incident[k] // 4, c]
                if mark[u] != v:
                    mark[u] = v
                    into[at] = u
                    at += 1
        return at

    def away(self, v, x):
        """The distance of v from a point in space."""
        squared: cython.double = 0.0
        for i in range(3):
            squared += (self.positions[v, i] - x[i]) * (self.positions[v, i] - x[i])
        return sqrt(squared)

    def apart(self, v, u):
        """The distance of two vertices in space."""
        return self.away(v, cython.address(self.positions[u, 0]))

    def along_edges(self, d: cython.double[::1], label: cython.int[::1]) -> None:
        """Lower distances `d` (n,) to paths along edges."""
        n: cython.int = d.shape[0]
        # A circular buffer: no vertex waits twice, so n places suffice.
        count: cython.int = n
        waiting: cython.int[::1] = np.arange(n, dtype=np.int32)
        is_waiting: cython.uchar[::1] = np.ones(n, np.uint8)
        at: cython.int = 0
        with cython.nogil:
            while count > 0:
                v: cython.int = waiting[at]
                is_waiting[v] = False
                at = at + 1 if at + 1 < n else 0
                count -= 1
                for k in range(self.first_neighbour[v], self.first_neighbour[v + 1]):
                    u: cython.int = self.neighbours[k]
                    # Not by rounding, which would pass along many edges. It holds of few, so no root is taken before.
                    gap: cython.double = d[u] * (1 - 1e-12) - d[v]
                    squared: cython.double = 0.0
                    for i in range(3):
                        off: cython.double = self.positions[v, i] - self.positions[u, i]
                        squared += off * off
                    if gap * fabs(gap) > squared:
                        d[u], label[u] = d[v] + self.apart(v, u), label[v]
                        if not is_waiting[u]:
                            is_waiting[u] = True
                            waiting[at + count if at + count < n else at + count - n] = u
                            count += 1


@cython.cclass
class Ray:
    """Distances of the vertices of a body, and lines that are followed to see whether a way is clear.

    `sources`, `offset`, `d` and `label` are those of `sight.look_around`. `last_cone` (n,) is the corner at
    each vertex at which its last line began, and `last_wall` (n,) the one opposite the wall at which a line ended last.
    """

    def __init__(self, body: Body, sources, offset, d, label):
        self.body, self.sources, self.offset, self.d, self.label = body, sources, offset, d, label
        self.last_cone, self.last_wall = np.full((2, d.shape[0]), -1, np.int32)

    def follows(self, line, v):
        """Whether the line from v stays in the tetrahedra."""
        line.origin = cython.address(self.body.positions[v, 0])
        self.aim(line, 0, -1, 0.0, -1)
        # The next line is often hidden by the same wall.
        begin: cython.int = self.last_wall[v]
        if begin >= 0 and self.leaves(line, begin, -ON_SIDE):
            far: cython.double = (1 - NUDGE) * fabs(line.of_all * (line.goal[line.up] - line.p_z))
            if fabs(line.ahead) < far:
                line.t, line.out = begin >> 2, begin & 3
                return False
        begin = self.cone(line, v)
        if begin >= 0:
            return self.arrives_from(line, begin)
        # Along faces and edges, several tetrahedra are as good to begin with, and some may end at a wall.
        for k in range(self.body.first[v], self.body.first[v + 1]):
            if self.leaves(line, self.body.incident[k], ON_SIDE):
                if self.arrives_from(line, self.body.incident[k]):
                    return True
                self.aim(line, 0, -1, 0.0, -1)
        return False

    def arrives_from(self, line, begin):
        """Whether the line that begins in the tetrahedron of a corner arrives."""
        return self.arrives(line, begin, -1, -1) > 0

    def arrives(self, line, begin, into, toward):
        """What `_step` says in the end, or -2 if it does not end; the line begins and ends as `aim` moves it."""
        self.aim(line, begin // 4, into, NUDGE, toward)
        for i in range(4):
            k: cython.int = begin // 4 * 4 + ((begin + i) & 3)
            if self.leaves(line, k, 0.0):
                break
        else:
            return -2
        line.t, line.out = k >> 2, k & 3
        line.p_x, line.tilt_x = line.sign * line.p_x, line.sign * line.tilt_x
        for i in range(3):
            line.x[i] *= line.sign
            line.has[i] = _has(line, line.corner[i])
        if line.has[0] | line.has[1] | line.has[2] | _has(line, self.body.cells[k >> 2, k & 3]) == 3:
            return 1
        for _steps in range(_MOST_STEPS):
            found: cython.int = _step(self.body, line)
            if found == -1:
                self.last_wall[self.body.cells[begin >> 2, begin & 3]] = 4 * line.t + line.out
            if found != 0:
                return found
        return -2

    def is_blocked(self, line, room):
        """Whether the line has left the body through a wall that all lines within this distance of it meet as well."""
        for i in range(3):
            j: cython.int = (i + 1) % 3
            x: cython.double = line.x[j] - line.x[i]
            y: cython.double = line.y[j] - line.y[i]
            of_side: cython.double = line.x[i] * line.y[j] - line.y[i] * line.x[j]
            if of_side <= 0 or of_side * of_side <= room * room * (x * x + y * y):
                return False
        return True

    def cone(self, line, v):
        """The corner ``4 t + corner`` at v through whose tetrahedron the line to the goal begins, well inside; else -1.

        From tetrahedron to tetrahedron around v, through the side that the line lies farthest behind. That ends at the
        boundary, and where the line runs along a side.
        """
        k: cython.int = self.last_cone[v]
        if k < 0:
            k = self.body.incident[self.body.first[v]]
        for _turns in range(_MOST_TURNS):
            self.last_cone[v] = k
            if self.leaves(line, k, -ON_SIDE):
                return k
            if line.least >= -line.slack:
                return -1
            line.t, line.out = k >> 2, line.side
            t: cython.int = self.body.cells[line.t, 4 + line.out] >> 2
            if t < 0:
                return -1
            for i in range(4):
                if self.body.cells[t, i] == v:
                    k = 4 * t + i
        return -1

    def aim(self, line, t, into, nudge, toward):
        """Take the line from origin to goal, both ends moved by a part of the way to the middle of a tetrahedron.

        A line along edges and faces, as on a grid, would touch several tetrahedra at once. The end stays if `into` is
        negative, and the beginning is moved towards one corner of t if `toward` names it.
        """
        p: cython.double[3]
        w: cython.double[3]
        for i in range(3):
            p[i], w[i] = (1 - nudge) * line.origin[i], line.goal[i]
            for c in range(4 if nudge > 0 else 0):
                part: cython.double = 0.25 if toward < 0 else 0.7 if c == toward else 0.1
                p[i] += part * nudge * self.body.positions[self.body.cells[t, c], i]
                if into >= 0:
                    w[i] += 0.25 * nudge * (self.body.positions[self.body.cells[into, c], i] - line.goal[i])
            w[i] -= p[i]
        line.up = 0 if fabs(w[0]) >= fabs(w[1]) else 1
        if fabs(w[2]) > fabs(w[line.up]):
            line.up = 2
        line.east = line.up + 1 if line.up < 2 else 0
        line.north = line.east + 1 if line.east < 2 else 0
        line.p_x, line.p_y, line.p_z = p[line.east], p[line.north], p[line.up]
        line.tilt_x, line.tilt_y = w[line.east] / w[line.up], w[line.north] / w[line.up]
        line.forward = 1.0 if w[line.up] > 0 else -1.0

    def leaves(self, line, k, part):
        """Whether the line, which begins in the tetrahedron of corner k, leaves it through the triangle opposite k.

        It may miss the triangle by a part of it, or be inside by that if it is negative. `side` becomes the corner
        opposite the side of the cone at k that the line is farthest behind.
        """
        z: cython.double[3]
        for i in range(3):
            u: cython.int = self.body.cells[k >> 2, (k + 1 + i) & 3]
            at: cython.pointer[cython.const[cython.double]] = cython.address(self.body.positions[u, 0])
            z[i] = at[line.up] - line.p_z
            line.x[i] = at[line.east] - line.p_x - line.tilt_x * z[i]
            line.y[i] = at[line.north] - line.p_y - line.tilt_y * z[i]
            line.corner[i] = u
        of_a: cython.double = line.x[1] * line.y[2] - line.y[1] * line.x[2]
        of_b: cython.double = line.x[2] * line.y[0] - line.y[2] * line.x[0]
        of_c: cython.double = line.x[0] * line.y[1] - line.y[0] * line.x[1]
        line.ahead, line.of_all = z[0] * of_a + z[1] * of_b + z[2] * of_c, of_a + of_b + of_c
        # The line meets the plane of the triangle ahead.
        line.sign = line.forward if line.ahead > 0 else -line.forward
        of_a, of_b, of_c = line.sign * of_a, line.sign * of_b, line.sign * of_c
        line.least = min(of_a, of_b, of_c)
        line.slack = ON_SIDE * (fabs(of_a) + fabs(of_b) + fabs(of_c))
        line.side = (k + (1 if line.least == of_a else 2 if line.least == of_b else 3)) & 3
        if part < 0:
            return line.least > line.slack
        return line.least >= -line.slack if part > 0 else line.least >= 0


@cython.cfunc
@cython.inline
@cython.nogil
def _has(line: cython.pointer[Line], v: cython.int) -> cython.int:
    """What a tetrahedron `has` with v."""
    return (v == line.goal_a) + 2 * (v == line.goal_b)


@cython.cfunc
@cython.inline
@cython.nogil
def _step(body: Body, line: cython.pointer[Line]) -> cython.int:
    """Go on to the next tetrahedron: 1 if the line has arrived, -1 at a wall, -2 if there is none, else 0."""
    k: cython.int = (cython.address(body.cells[0, 0]) + 8 * line.t)[4 + line.out]
    if k < 0:
        return -1
    line.t = k >> 2
    corners: cython.pointer[cython.const[cython.int]] = cython.address(body.cells[0, 0]) + 8 * (k >> 2)
    for c in range(4):
        prefetch(cython.address(body.cells[0, 0]) + 8 * (corners[4 + c] >> 2))
    o: cython.int = corners[k & 3]
    has_o: cython.int = _has(line, o)
    if line.has[0] | line.has[1] | line.has[2] | has_o == 3:
        return 1
    at: cython.pointer[cython.const[cython.double]] = cython.address(body.positions[0, 0]) + 3 * o
    z: cython.double = at[line.up] - line.p_z
    x: cython.double = line.sign * at[line.east] - line.p_x - line.tilt_x * z
    y: cython.double = at[line.north] - line.p_y - line.tilt_y * z
    of_a: cython.double = x * line.y[0] - y * line.x[0]
    of_b: cython.double = x * line.y[1] - y * line.x[1]
    of_c: cython.double = x * line.y[2] - y * line.x[2]
    # The line leaves through the triangle of o and two corners, which are on both sides.
    no_c: cython.int = (of_a >= 0) & (of_b <= 0)
    no_a: cython.int = (of_b >= 0) & (of_c <= 0)
    if not no_c | no_a | ((of_c >= 0) & (of_a <= 0)):
        return -2
    # Without a branch, which no processor foresees.
    k = 2 * no_c + (1 - no_c) * (1 - no_a)
    u: cython.int = line.corner[k]
    line.out = (corners[1] == u) + 2 * (corners[2] == u) + 3 * (corners[3] == u)
    line.corner[k], line.has[k], line.x[k], line.y[k] = o, has_o, x, y
    return 0
