"""Tetrahedra of a body, what lies beside them, and straight lines from one to the next."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.rays import GAIN, NUDGE
from cython.cimports.libc.math import fabs, sqrt

# What lies behind a side that has not been looked at.
_UNKNOWN = cython.declare(cython.int, -2)
# Part of a triangle by which a straight line may miss it, along its rim.
_ON_SIDE = cython.declare(cython.double, 1e-9)
# Tetrahedra along a line, and those around a vertex that are walked through before all are tried one by one.
_MOST_STEPS = cython.declare(cython.int, 1000000)
_MOST_TURNS = cython.declare(cython.int, 20)


@cython.final
@cython.cclass
class Body:
    """A body of tetrahedra in space.

    `behind` (m, 4) is the tetrahedron behind the side opposite each corner, -1 on the boundary; the neighbours of
    vertex v are at ``first_neighbour[v]`` to ``first_neighbour[v + 1]`` of `neighbours`, and `reach` (n,) is the
    longest edge at each vertex.

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
        self.corners, self.first, self.incident, self.positions = corners, first, incident, positions
        n: cython.Py_ssize_t = positions.shape[0]
        m: cython.Py_ssize_t = corners.shape[0]
        self.behind, self.reach = np.full((m, 4), _UNKNOWN, np.int32), np.zeros(n)
        counts, all_marks = np.zeros(n + 1, np.int32), np.full(n, -1, np.int32)
        n_around: cython.int[::1] = counts
        mark: cython.int[::1] = all_marks
        one_list: cython.int[::1] = np.empty(n, np.int32)
        with cython.nogil:
            for i in range(4 * m):
                if self.behind[i // 4, i % 4] == _UNKNOWN:
                    self.behind[i // 4, i % 4] = self.across(i // 4, i % 4)
            for i in range(n):
                n_around[i + 1] = self.list_around(i, mark, one_list, 0)
        all_marks[:] = -1
        self.first_neighbour = np.cumsum(counts, dtype=np.int32)
        self.neighbours = np.empty(int(self.first_neighbour[n]), np.int32)
        with cython.nogil:
            for i in range(n):
                self.list_around(i, mark, self.neighbours, self.first_neighbour[i])
                self.reach[i] = self.longest_edge(i)

    def __reduce__(self):
        """What it was made of."""
        return Body, self._arrays

    def sides_behind(self):
        """`behind`, as an array."""
        return np.asarray(self.behind)

    def across(self, t: cython.int, o: cython.int) -> cython.int:
        """The first other tetrahedron at the side of t opposite corner o, or -1; that one is told as well."""
        a: cython.int = self.corners[t, (o + 1) % 4]
        b: cython.int = self.corners[t, (o + 2) % 4]
        c: cython.int = self.corners[t, (o + 3) % 4]
        for k in range(self.first[a], self.first[a + 1]):
            other: cython.int = self.incident[k] // 4
            if other != t:
                n_shared: cython.int = 0
                beside: cython.int = 0
                for i in range(4):
                    u: cython.int = self.corners[other, i]
                    if u in (a, b, c):
                        n_shared += 1
                    else:
                        beside = i
                if n_shared == 3:
                    # The first other one of that is t, unless an earlier one has been there.
                    if self.behind[other, beside] == _UNKNOWN:
                        self.behind[other, beside] = t
                    return other
        return -1

    def list_around(self, v: cython.int, mark: cython.int[::1], into: cython.int[::1], at: cython.int) -> cython.int:
        """Write the neighbours of v down from a place on; returns the place behind them."""
        mark[v] = v
        for k in range(self.first[v], self.first[v + 1]):
            for c in range(4):
                u: cython.int = self.corners[self.incident[k] // 4, c]
                if mark[u] != v:
                    mark[u] = v
                    into[at] = u
                    at += 1
        return at

    def longest_edge(self, v: cython.int) -> cython.double:
        """The distance of v from its farthest neighbour."""
        longest: cython.double = 0.0
        for k in range(self.first_neighbour[v], self.first_neighbour[v + 1]):
            longest = max(longest, self.apart(v, self.neighbours[k]))
        return longest

    def apart(self, v: cython.int, u: cython.int) -> cython.double:
        """The distance of two vertices in space."""
        squared: cython.double = 0.0
        for i in range(3):
            off: cython.double = self.positions[u, i] - self.positions[v, i]
            squared += off * off
        return sqrt(squared)

    def along_edges(self, d: cython.double[::1], label: cython.int[::1], begin: cython.double[::1]) -> None:
        """Lower distances `d` (n,) to paths along edges, in place; `begin` is where their last edge begins."""
        n: cython.int = d.shape[0]
        # A circular buffer: no vertex waits twice, so n places suffice.
        waiting: cython.int[::1] = np.arange(n, dtype=np.int32)
        is_waiting: cython.uchar[::1] = np.ones(n, np.uint8)
        at: cython.int = 0
        count: cython.int = n
        with cython.nogil:
            while count > 0:
                v: cython.int = waiting[at]
                is_waiting[v] = False
                at = at + 1 if at + 1 < n else 0
                count -= 1
                for k in range(self.first_neighbour[v], self.first_neighbour[v + 1]):
                    u: cython.int = self.neighbours[k]
                    # Not by rounding, which would pass along many edges.
                    if d[v] < d[u] and d[v] + self.apart(v, u) < d[u] * (1 - 1e-12):
                        d[u], begin[u], label[u] = d[v] + self.apart(v, u), d[v], label[v]
                        if not is_waiting[u]:
                            is_waiting[u] = True
                            waiting[at + count if at + count < n else at + count - n] = u
                            count += 1


@cython.cclass
class Ray:
    """Distances of the vertices of a body, and a line that is followed to see whether a way is clear.

    The line goes from p along w. It is in tetrahedron t, and leaves that through the triangle abc; `sign` tells the
    order of abc. Classes derived from this one say where the line is to arrive. `sources`, `offset`, `d`, `begin` and
    `label` are those of `sight.look_around`.
    """

    def __init__(self, body: Body, sources, offset, d, begin, label):
        self.body, self.sources, self.offset, self.d, self.begin, self.label = body, sources, offset, d, begin, label

    def is_there(self, t: cython.int) -> cython.bint:  # noqa: ARG002
        """Whether the line has arrived once it is in tetrahedron t."""
        return False

    def is_lit(self, v: cython.int) -> cython.bint:  # noqa: ARG002
        """Whether v is known to see the goal, so that a line between three such vertices arrives."""
        return False

    def sees(self, v: cython.int, goal: cython.pointer[cython.const[cython.double]]) -> cython.bint:
        """Whether the line from v to a point stays in the tetrahedra."""
        self.goal = goal
        # A point of a tetrahedron at v is at most as far away as a corner.
        if self.away(v, goal) <= self.body.reach[v] * (1 + GAIN):
            for k in range(self.body.first[v], self.body.first[v + 1]):
                if self.is_there(self.body.incident[k] // 4):
                    return True
        begin: cython.int = self.cone(v)
        if begin >= 0:
            return self.arrives_from(v, begin)
        # Along faces and edges, several tetrahedra are as good to begin with, and some may end at a wall.
        for k in range(self.body.first[v], self.body.first[v + 1]):
            t: cython.int = self.body.incident[k] // 4
            o: cython.int = self.body.incident[k] % 4
            a: cython.int = self.body.corners[t, (o + 1) % 4]
            b: cython.int = self.body.corners[t, (o + 2) % 4]
            self.aim(v, t, -1, 0.0, -1)
            is_through: cython.bint = _leaves(self, v, a, b, self.body.corners[t, (o + 3) % 4], _ON_SIDE) != 0
            if is_through and self.arrives_from(v, self.body.incident[k]):
                return True
        return False

    def away(self, v: cython.int, x: cython.pointer[cython.const[cython.double]]) -> cython.double:
        """The distance of v from a point in space."""
        squared: cython.double = 0.0
        for i in range(3):
            squared += (self.body.positions[v, i] - x[i]) * (self.body.positions[v, i] - x[i])
        return sqrt(squared)

    def arrives_from(self, v: cython.int, begin: cython.int) -> cython.bint:
        """Whether the line from v that begins in the tetrahedron of a corner arrives."""
        return self.arrives(v, begin, -1, -1)

    def arrives(self, v: cython.int, begin: cython.int, into: cython.int, toward: cython.int) -> cython.bint:
        """Whether the line arrives before it leaves the body; it begins and ends as `aim` moves it."""
        self.aim(v, begin // 4, into, NUDGE, toward)
        if not self.enters(begin // 4, begin % 4):
            return False
        for _steps in range(_MOST_STEPS):
            if self.is_lit(self.a) and self.is_lit(self.b) and self.is_lit(self.c):
                return True
            o: cython.int = self.cross()
            if o < 0:
                return False
            if self.is_there(self.t):
                return True
            if not self.turn(o):
                return False
        return False

    def cone(self, v: cython.int) -> cython.int:
        """The corner ``4 t + corner`` at v through whose tetrahedron the line to the goal begins, well inside; else -1.

        From tetrahedron to tetrahedron around v, through the side that the line lies farthest behind. That ends at the
        boundary, and where the line runs along a side.
        """
        k: cython.int = self.body.incident[self.body.first[v]]
        self.aim(v, k // 4, -1, 0.0, -1)
        for _turns in range(_MOST_TURNS):
            side: cython.int = self.worst_side(k)
            if side < 0:
                return k if side == -1 else -1
            t: cython.int = self.body.behind[k // 4, side]
            if t < 0:
                return -1
            for i in range(4):
                if self.body.corners[t, i] == v:
                    k = 4 * t + i
        return -1

    def worst_side(self, k: cython.int) -> cython.int:
        """The side of the cone at corner k that the line is farthest behind: the corner opposite it in the tetrahedron.

        -1 if the line is inside the cone, -2 if it is along a side.
        """
        t: cython.int = k // 4
        o: cython.int = k % 4
        a: cython.int = self.body.corners[t, (o + 1) % 4]
        b: cython.int = self.body.corners[t, (o + 2) % 4]
        c: cython.int = self.body.corners[t, (o + 3) % 4]
        sign: cython.double = 1.0 if _volume(self, self.body.corners[t, o], a, b, c) > 0 else -1.0
        of_a: cython.double = sign * _side(self, b, c)
        of_b: cython.double = sign * _side(self, c, a)
        of_c: cython.double = sign * _side(self, a, b)
        least: cython.double = min(of_a, of_b, of_c)
        slack: cython.double = _ON_SIDE * (fabs(of_a) + fabs(of_b) + fabs(of_c))
        if least > slack:
            return -1
        if least >= -slack:
            return -2
        if least == of_a:
            return (o + 1) % 4
        return (o + 2) % 4 if least == of_b else (o + 3) % 4

    def aim(
        self, v: cython.int, t: cython.int, into: cython.int, nudge: cython.double, toward: cython.int
    ) -> cython.void:
        """Take the line from v to the goal, both ends moved by a part of the way to the middle of a tetrahedron.

        A line along edges and faces, as on a grid, would touch several tetrahedra at once. The end stays if `into` is
        negative, and the beginning is moved towards one corner of t if `toward` names it.
        """
        for i in range(3):
            p: cython.double = (1 - nudge) * self.body.positions[v, i]
            q: cython.double = self.goal[i]
            for c in range(4):
                part: cython.double = 0.25 if toward < 0 else 0.7 if c == toward else 0.1
                p += part * nudge * self.body.positions[self.body.corners[t, c], i]
            if into >= 0:
                q *= 1 - nudge
                for c in range(4):
                    q += 0.25 * nudge * self.body.positions[self.body.corners[into, c], i]
            self.p[i], self.w[i] = p, q - p

    def enters(self, t: cython.int, o: cython.int) -> cython.bint:
        """Find the triangle through which the line, which begins inside t, leaves it; opposite corner o at first."""
        self.t = t
        for i in range(o, o + 4):
            self.a = self.body.corners[t, (i + 1) % 4]
            self.b = self.body.corners[t, (i + 2) % 4]
            self.c = self.body.corners[t, (i + 3) % 4]
            self.sign = _leaves(self, self.body.corners[t, i % 4], self.a, self.b, self.c, 0.0)
            if self.sign != 0:
                return True
        return False

    def cross(self) -> cython.int:
        """Go through abc; returns the fourth vertex of the tetrahedron behind it, or -1 on the boundary."""
        for i in range(4):
            u: cython.int = self.body.corners[self.t, i]
            if u != self.a and u != self.b and u != self.c:
                break
        self.t = self.body.behind[self.t, i]
        if self.t < 0:
            return -1
        u = self.a ^ self.b ^ self.c
        for i in range(4):
            u ^= self.body.corners[self.t, i]
        return u

    def turn(self, o: cython.int) -> cython.bint:
        """Find the triangle at o through which the line leaves t, which it entered through abc."""
        of_a: cython.double = self.sign * _side(self, o, self.a)
        of_b: cython.double = self.sign * _side(self, o, self.b)
        if of_a >= 0 and of_b <= 0:
            self.c = o
            return True
        of_c: cython.double = self.sign * _side(self, o, self.c)
        if of_b >= 0 and of_c <= 0:
            self.a = o
        elif of_c >= 0 and of_a <= 0:
            self.b = o
        else:
            return False
        return True


@cython.cfunc
@cython.inline
@cython.nogil
def _side(ray: Ray, a: cython.int, b: cython.int) -> cython.double:
    """On which side the edge ab passes the line: the determinant of w, a - p and b - p."""
    ax: cython.double = ray.body.positions[a, 0] - ray.p[0]
    ay: cython.double = ray.body.positions[a, 1] - ray.p[1]
    az: cython.double = ray.body.positions[a, 2] - ray.p[2]
    bx: cython.double = ray.body.positions[b, 0] - ray.p[0]
    by: cython.double = ray.body.positions[b, 1] - ray.p[1]
    bz: cython.double = ray.body.positions[b, 2] - ray.p[2]
    return ray.w[0] * (ay * bz - az * by) + ray.w[1] * (az * bx - ax * bz) + ray.w[2] * (ax * by - ay * bx)


@cython.cfunc
@cython.inline
@cython.nogil
def _leaves(ray: Ray, o: cython.int, a: cython.int, b: cython.int, c: cython.int, part: cython.double) -> cython.int:
    """How the line leaves the tetrahedron oabc through abc: 0 if it does not, else the sign of its corners' order.

    The line may miss the triangle by a part of it.
    """
    of_a: cython.double = _side(ray, b, c)
    of_b: cython.double = _side(ray, c, a)
    of_c: cython.double = _side(ray, a, b)
    least: cython.double = -part * (fabs(of_a) + fabs(of_b) + fabs(of_c))
    sign: cython.int = 1 if of_a + of_b + of_c > 0 else -1
    if min(sign * of_a, sign * of_b, sign * of_c) < least:
        return 0
    # The line leaves where o lies behind: w and the normal of abc that points away from o agree.
    return sign if sign * _volume(ray, o, a, b, c) > 0 else 0


@cython.cfunc
@cython.inline
@cython.nogil
def _volume(ray: Ray, o: cython.int, a: cython.int, b: cython.int, c: cython.int) -> cython.double:
    """Six times the volume of oabc, with the sign of the order of its corners."""
    found: cython.double = 0.0
    for i in range(3):
        j: cython.int = (i + 1) % 3
        k: cython.int = (i + 2) % 3
        at: cython.double = ray.body.positions[o, i]
        found += (ray.body.positions[a, i] - at) * (
            (ray.body.positions[b, j] - ray.body.positions[o, j])
            * (ray.body.positions[c, k] - ray.body.positions[o, k])
            - (ray.body.positions[b, k] - ray.body.positions[o, k])
            * (ray.body.positions[c, j] - ray.body.positions[o, j])
        )
    return found
