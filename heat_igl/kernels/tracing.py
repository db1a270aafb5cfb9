"""Paths to sources: by steepest descent of a distance, or by aiming with the distances ahead, then straightened."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.aiming import aim, aim_from_vertex
from cython.cimports.heat_igl.kernels.descent import Departure, Descent, leave_face, leave_vertex, nowhere, steepest
from cython.cimports.heat_igl.kernels.straightening import Course
from cython.cimports.heat_igl.kernels.surfaces import (
    Place,
    Surface,
    apart,
    at_corner,
    corner_of,
    difference,
    moved,
    only_corner,
    product,
    side_of,
)
from cython.cimports.heat_igl.kernels.tracing import GAIN, PATH_ROUNDING, TOO_LONG, Goal, Nearest, WayOn
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
    tracer.first_inside, tracer.inside, tracer.escape = goals.first_inside, goals.inside, goals.escape
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
    first_inside: cython.const[cython.int][::1]
    inside: cython.const[Goal][::1]
    escape: cython.const[cython.int][::1]
    max_steps: cython.longlong
    # Of the path being traced: whether it aims, and which part of the distance is left.
    aims: cython.bint
    left: cython.double

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
        x: Place = target[0]
        corner: Place
        v: cython.int = -1
        if only_corner(target) >= 0:
            v = self.s.triangle[face].vertex[only_corner(target)]
        f: cython.int = face
        is_free: cython.bint = v >= 0  # still at a vertex, and in no face in particular
        floor: cython.double = INFINITY  # descent goes on below this
        most: cython.double = self.value(face, target)  # of the length, when aiming
        length: cython.double = 0.0
        steps: cython.longlong = 0
        way: Departure
        goal: Nearest
        self.left = most
        self.course.begin(face, v, target)
        while True:
            steps += 1
            if steps > self.max_steps or self.left < -most:
                if self.aims:
                    return INFINITY  # a distance that says nothing may lead around in circles
                if steps > self.max_steps:
                    floor = -INFINITY
            if v >= 0:
                if self.is_source[v]:
                    return length + self.course.straighten(v, cython.NULL) + self.s.d[v]
                goal = self.goal_around(v, False)
                way = nowhere()
                if goal.goal < 0 and self.s.d[v] < floor:
                    way = aim_from_vertex(self.s, v) if self.aims else leave_vertex(self.s, v)
                    if self.aims or way.face < 0:
                        floor = self.s.d[v]
                if goal.goal < 0 and way.face < 0:
                    goal = self.goal_around(v, True)
                    if goal.goal < 0:
                        way = self.escape_from(v)
                        if way.face < 0:
                            return INFINITY
                if goal.goal >= 0:
                    way.face, way.vertex = goal.face, -1
                if is_free:
                    self.course.face = f = way.face
                    is_free = False
                elif not self.course.turn(v, f, way.face, way.vertex):
                    # Only this vertex joins the two faces: the path cannot pass anywhere else.
                    length += self.course.straighten(v, cython.NULL)
                    self.course.begin(way.face, v, cython.address(x))
                f = way.face if way.vertex < 0 else self.course.last_face()
                if goal.goal >= 0:
                    return length + self.end_on(goal.goal)
                if way.vertex >= 0:
                    v = way.vertex
                    continue
                corner = at_corner(corner_of(self.s, f, v))
                self.left = self.s.d[v] - apart(self.s, f, cython.address(corner), cython.address(way.at))
                x = way.at
                v = -1
            # At a point of face f that is no vertex: on a side of it, or (at the start) inside.
            out: Place
            on: WayOn = self.way_on(f, cython.address(x), steps == 1, cython.address(out))
            h: cython.int = 3 * f + side_of(cython.address(x))
            if on.enter >= 0 and on.enter != h:
                x = moved(self.s, h, on.enter, cython.address(x))
                f = on.face
                self.course.strip.push(h, on.enter)
            if on.goal >= 0:
                return length + self.end_on(on.goal)
            if on.face < 0:
                # Level, or a valley along the side.
                v = self.lowest_vertex(f, cython.address(x))
                continue
            if self.aims:
                self.left -= apart(self.s, f, cython.address(x), cython.address(out))
                x = out
            else:
                down: Descent = steepest(self.s, f)
                leave_face(cython.address(x), down.rate)
            if only_corner(cython.address(x)) >= 0:
                v = self.s.triangle[f].vertex[only_corner(cython.address(x))]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def end_on(self, goal: cython.int) -> cython.double:
        """Straighten the path to a goal; returns the length plus the offset of the goal."""
        c: cython.int
        ends: Place[2]
        row = cython.address(self.inside[goal])
        for c in range(3):
            ends[0].c[c], ends[1].c[c] = row.start[c], row.end[c]
        return self.course.straighten(-1, ends) + row.offset

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
            goal = self.goal_in(f, x, False)
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
            goal = self.goal_in(g // 3, cython.address(there), False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def goal_in(self, f: cython.int, x: cython.pointer[cython.const[Place]], at_any_cost: cython.bint) -> Nearest:
        """The nearest goal inside face f from point x; none if the distance at x is less, unless `at_any_cost`."""
        best: Nearest
        best.goal, best.face, best.distance = -1, f, INFINITY
        i: cython.int
        if self.first_inside[f] == self.first_inside[f + 1]:
            return best
        for i in range(self.first_inside[f], self.first_inside[f + 1]):
            distance: cython.double = self.distance_to(f, i, x) + self.inside[i].offset
            if distance < best.distance:
                best.goal, best.distance = i, distance
        t = cython.address(self.s.triangle[f])
        here: cython.double = (
            x.c[0] * self.s.d[t.vertex[0]] + x.c[1] * self.s.d[t.vertex[1]] + x.c[2] * self.s.d[t.vertex[2]]
        )
        if not (at_any_cost or best.distance <= here * (1.0 + PATH_ROUNDING)):
            best.goal, best.distance = -1, INFINITY
        return best

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def distance_to(self, f: cython.int, goal: cython.int, x: cython.pointer[cython.const[Place]]) -> cython.double:
        """How far point x of face f is from a goal in that face."""
        c: cython.int
        start: Place
        end: Place
        for c in range(3):
            start.c[c], end.c[c] = self.inside[goal].start[c], self.inside[goal].end[c]
        along: Place = difference(cython.address(end), cython.address(start))
        off: Place = difference(x, cython.address(start))
        squared: cython.double = product(self.s, f, cython.address(along), cython.address(along))
        share: cython.double = 0.0
        if squared > 0.0:
            share = product(self.s, f, cython.address(off), cython.address(along)) / squared
        share = min(max(share, 0.0), 1.0)
        for c in range(3):
            start.c[c] = start.c[c] + share * along.c[c]
        return apart(self.s, f, x, cython.address(start))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def goal_around(self, v: cython.int, at_any_cost: cython.bint) -> Nearest:
        """The nearest goal inside the faces at vertex v."""
        best: Nearest
        best.goal, best.face, best.distance = -1, -1, INFINITY
        k: cython.int
        for k in range(self.s.first_corner[v], self.s.first_corner[v + 1]):
            f: cython.int = self.s.corner[k] // 3
            if self.first_inside[f] == self.first_inside[f + 1]:
                continue
            x: Place = at_corner(self.s.corner[k] % 3)
            found: Nearest = self.goal_in(f, cython.address(x), at_any_cost)
            if found.distance < best.distance:
                best = found
        return best
