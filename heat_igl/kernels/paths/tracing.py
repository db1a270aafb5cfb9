"""Paths to sources: by steepest descent of a distance, or by aiming with the distances ahead, then straightened."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.aiming import aim, aim_from_vertex
from cython.cimports.heat_igl.kernels.paths.descent import (
    Departure,
    Descent,
    leave_face,
    leave_vertex,
    nowhere,
    steepest,
)
from cython.cimports.heat_igl.kernels.paths.goals import Goals, Nearest
from cython.cimports.heat_igl.kernels.paths.straightening import Course
from cython.cimports.heat_igl.kernels.paths.surfaces import (
    Place,
    Surface,
    apart,
    at_corner,
    corner_of,
    moved,
    only_corner,
    side_of,
)
from cython.cimports.heat_igl.kernels.paths.tracing import GAIN, TOO_LONG, WayOn
from cython.cimports.libc.math import INFINITY

__all__ = ["trace"]


def trace(
    surface,
    d,
    goals,
    face: cython.const[cython.longlong][::1],
    barycentric: cython.const[cython.double][:, ::1],
    max_steps: cython.longlong,
):
    """Paths from points down to sources; see `heat_igl.curves.tracing.trace`."""
    tracer = _Tracer()
    tracer.s = Surface(surface, d)
    tracer.is_source = goals.is_source.view(np.uint8)
    tracer.goals, tracer.escape = Goals(goals.first_inside, goals.inside), goals.escape
    tracer.course = Course(tracer.s, int(np.diff(surface.first_corner).max()))
    tracer.max_steps = max_steps
    array = np.zeros(face.shape[0] + 1, np.int64)
    first: cython.longlong[::1] = array
    i: cython.Py_ssize_t
    with cython.nogil:
        for i in range(face.shape[0]):
            x: Place
            x.c[0], x.c[1], x.c[2] = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
            tracer.best_path(face[i], cython.address(x))
            first[i + 1] = tracer.course.n_segments
    faces, points = tracer.course.segments()
    return faces, points, array


@cython.final
@cython.cclass
class _Tracer:
    """A surface with a distance, the goals of paths, and the path being traced."""

    s: Surface
    course: Course
    is_source: cython.const[cython.uchar][::1]
    goals: Goals
    escape: cython.const[cython.int][::1]
    max_steps: cython.longlong
    # Of the path being traced: whether it aims, and the part of the distance that is left.
    aims: cython.bint
    left: cython.double
    # The vertex that it has reached, or -1 for a point in or on the side of a face; free at a vertex at which it began,
    # in no face in particular. The length of the parts that are straightened; descent goes on below the floor.
    vertex: cython.int
    face: cython.int
    x: Place
    is_free: cython.bint
    length: cython.double
    floor: cython.double

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def best_path(self, face: cython.int, x: cython.pointer[cython.const[Place]]) -> cython.int:
        """Append the path from a point by descent, or, if that is too long, by aiming if that is shorter."""
        i: cython.int
        first: cython.int = self.course.n_segments
        value: cython.double = self.value(face, x)
        self.aims = False
        length: cython.double = self.path(face, x)
        if length == INFINITY:
            self.course.n_segments = first
            return 0
        if not value * (1.0 + TOO_LONG) < length:
            return 0
        middle: cython.int = self.course.n_segments
        self.aims = True
        if self.path(face, x) < length * (1.0 - GAIN):
            for i in range(middle, self.course.n_segments):
                self.course.segment[first + i - middle] = self.course.segment[i]
            self.course.n_segments += first - middle
        else:
            self.course.n_segments = middle
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def path(self, face: cython.int, target: cython.pointer[cython.const[Place]]) -> cython.double:
        """Go down from a point of a face to a source and append the straightened path.

        Returns the length plus the distance at the end; inf if there is no way.
        """
        steps: cython.longlong = 0
        most: cython.double = self.value(face, target)  # of the length, when aiming
        self.begin(face, target)
        while True:
            steps += 1
            if steps > self.max_steps or self.left < -most:
                if self.aims:
                    return INFINITY  # a distance that says nothing may lead around in circles
                if steps > self.max_steps:
                    self.floor = -INFINITY
            if self.vertex >= 0 and self.step_from_vertex():
                return self.length
            if self.vertex < 0 and self.step_across_face(steps == 1):
                return self.length

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def begin(self, face: cython.int, target: cython.pointer[cython.const[Place]]) -> cython.void:
        """Begin a path at a point of a face."""
        self.face, self.vertex, self.x = face, -1, target[0]
        if only_corner(target) >= 0:
            self.vertex = self.s.triangle[face].vertex[only_corner(target)]
        self.is_free = self.vertex >= 0
        self.floor, self.length, self.left = INFINITY, 0.0, self.value(face, target)
        self.course.begin(face, self.vertex, target)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def step_from_vertex(self) -> cython.int:
        """Go on from a vertex, along an edge or to the other side of a face; whether the path has ended."""
        v: cython.int = self.vertex
        if self.is_source[v]:
            self.length = self.length + self.course.straighten(v, cython.NULL) + self.s.d[v]
            return 1
        goal: Nearest = self.goals.around(self.s, v, False)
        way: Departure = nowhere()
        if goal.goal < 0 and self.s.d[v] < self.floor:
            way = aim_from_vertex(self.s, v) if self.aims else leave_vertex(self.s, v)
            if self.aims or way.face < 0:
                self.floor = self.s.d[v]
        if goal.goal < 0 and way.face < 0:
            goal = self.goals.around(self.s, v, True)
            if goal.goal < 0:
                way = self.escape_from(v)
                if way.face < 0:
                    self.length = INFINITY
                    return 1
        if goal.goal >= 0:
            way.face, way.vertex = goal.face, -1
        if self.is_free:
            self.course.face = self.face = way.face
            self.is_free = False
        elif not self.course.turn(v, self.face, way.face, way.vertex):
            # Only this vertex joins the two faces: the path cannot pass anywhere else.
            self.length += self.course.straighten(v, cython.NULL)
            self.course.begin(way.face, v, cython.address(self.x))
        self.face = way.face if way.vertex < 0 else self.course.last_face()
        if goal.goal >= 0:
            self.length += self.end_on(goal.goal)
            return 1
        self.vertex = way.vertex
        if way.vertex < 0:
            corner: Place = at_corner(corner_of(self.s, self.face, v))
            self.left = self.s.d[v] - apart(self.s, self.face, cython.address(corner), cython.address(way.at))
            self.x = way.at
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def step_across_face(self, is_first: cython.bint) -> cython.int:
        """Go on from a point that is no vertex: on a side or, at the start, inside; whether the path has ended."""
        out: Place
        on: WayOn = self.way_on(self.face, cython.address(self.x), is_first, cython.address(out))
        h: cython.int = 3 * self.face + side_of(cython.address(self.x))
        if on.enter >= 0 and on.enter != h:
            self.x = moved(self.s, h, on.enter, cython.address(self.x))
            self.face = on.face
            self.course.strip.push(h, on.enter)
        if on.goal >= 0:
            self.length += self.end_on(on.goal)
            return 1
        if on.face < 0:
            # Level, or a valley along the side.
            self.vertex = self.lowest_vertex(self.face, cython.address(self.x))
            return 0
        if self.aims:
            self.left -= apart(self.s, self.face, cython.address(self.x), cython.address(out))
            self.x = out
        else:
            down: Descent = steepest(self.s, self.face)
            leave_face(cython.address(self.x), down.rate)
        if only_corner(cython.address(self.x)) >= 0:
            self.vertex = self.s.triangle[self.face].vertex[only_corner(cython.address(self.x))]
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def end_on(self, goal: cython.int) -> cython.double:
        """Straighten the path to a goal; returns the length plus the offset of the goal."""
        ends: Place[2]
        self.goals.ends(goal, ends)
        return self.course.straighten(-1, ends) + self.goals.inside[goal].offset

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def escape_from(self, v: cython.int) -> Departure:
        """The next vertex on a way along edges to a source."""
        k: cython.int
        way: Departure = nowhere()
        way.vertex = self.escape[v]
        if way.vertex >= 0:
            for k in range(self.s.first_corner[v], self.s.first_corner[v + 1]):
                if corner_of(self.s, self.s.corner[k] // 3, way.vertex) >= 0:
                    way.face = self.s.corner[k] // 3
        return way

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def way_on(
        self, f: cython.int, x: cython.pointer[cython.const[Place]], is_first: cython.bint, out: cython.pointer[Place]
    ) -> WayOn:
        """How the way goes on from a point of face f. When aiming, the way leaves the face at point `out`."""
        way: WayOn
        goal: Nearest
        down: Descent
        way.face = way.enter = way.goal = -1
        # The steeper the descent the better, and the less a way misses the rest of the length.
        best: cython.double = -INFINITY if self.aims else 0.0
        better: cython.double
        k: cython.int
        if side_of(x) < 0:
            goal = self.goals.in_face(self.s, f, x, False)
            if self.aims:
                better = -aim(self.s, f, x, self.left, INFINITY, out)
            else:
                down = steepest(self.s, f)
                better = down.slope
            way.goal = goal.goal
            if goal.goal >= 0 or better > best:
                way.face = f
            return way
        h: cython.int = 3 * f + side_of(x)
        edge: cython.int = self.s.triangle[f].edge[side_of(x)]
        for k in range(self.s.first_side[edge], self.s.first_side[edge + 1]):
            g: cython.int = self.s.side[k]
            there: Place = moved(self.s, h, g, x)
            goal = self.goals.in_face(self.s, g // 3, cython.address(there), False)
            if goal.goal >= 0:
                way.face, way.enter, way.goal = g // 3, g, goal.goal
                return way
            if self.aims:
                # Straight on is not back.
                better = best
                if g != h or is_first:
                    better = -aim(self.s, g // 3, cython.address(there), self.left, -best, out)
                if better > best:
                    best, way.face, way.enter = better, g // 3, g
            else:
                down = steepest(self.s, g // 3)
                if down.slope > best and down.rate[g % 3] > 0.0:
                    best, way.face, way.enter = down.slope, g // 3, g
        return way

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def value(self, f: cython.int, x: cython.pointer[cython.const[Place]]) -> cython.double:
        """The distance at point x of face f, linear in the face."""
        total: cython.double = 0.0
        c: cython.int
        for c in range(3):
            if x.c[c] > 0.0:
                total += x.c[c] * self.s.d[self.s.triangle[f].vertex[c]]
        return total

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def lowest_vertex(self, f: cython.int, x: cython.pointer[cython.const[Place]]) -> cython.int:
        """Of the vertices of face f, or of the side that point x lies on, the one of the smallest distance."""
        t = cython.address(self.s.triangle[f])
        lowest: cython.int = -1
        c: cython.int
        for c in range(3):
            if x.c[c] > 0.0 and (lowest < 0 or self.s.d[t.vertex[c]] < self.s.d[t.vertex[lowest]]):
                lowest = c
        return t.vertex[lowest]
