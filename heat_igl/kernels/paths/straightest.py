"""Straightest geodesics over the triangles of an oriented manifold triangulation (Polthier and Schmies 1998)."""

import cython
from cython.cimports.heat_igl.kernels.mesh.segments import Segments
from cython.cimports.heat_igl.kernels.mesh.triangles import foot
from cython.cimports.heat_igl.kernels.paths.straightest import LEAST_ANGLE, MOST_IDLE, ON_SIDE, PI
from cython.cimports.libc.math import atan2, cos, fabs, hypot, sin


@cython.final
@cython.cclass
class _Tracer:
    """Triangles, the geodesic being traced, and room for the segments of all, if they are stored."""

    def trace_one(
        self,
        face: cython.longlong,
        at: cython.p_double,
        turn: cython.double,
        length: cython.double,
        end_face: cython.p_longlong,
        end: cython.p_double,
        travelled: cython.p_double,
    ) -> cython.int:
        """One geodesic.

        It begins at barycentric coordinates `at` in `face`, at the angle `turn` from the direction of corner 0 to
        corner 1.
        """
        c: cython.int
        has_segments: cython.bint = False
        idle: cython.longlong = 0
        left: cython.double = length
        for c in range(3):
            self.entry[c] = self.leave[c] = at[c]
        end_face[0], travelled[0] = face, 0.0
        goes_on: cython.bint = length > 0.0 and self.start(face, turn)
        while goes_on and idle <= MOST_IDLE:
            self.lay_out()
            step: cython.double = self.find_exit(travelled[0])
            ends: cython.bint = step >= left
            if ends:
                share: cython.double = left / step
                for c in range(3):
                    self.leave[c] = self.entry[c] + share * (self.leave[c] - self.entry[c])
                travelled[0] = length
            else:
                left -= step
                travelled[0] = length - left
            end_face[0] = self.face.f
            if step > 0.0 or ends:
                self.store(self.face.f)
                has_segments = True
                idle = 0
            else:
                idle += 1
            is_at_vertex: cython.bint = self.face.share == 0.0 or self.face.share == 1.0
            goes_on = not ends and (self.pass_vertex() if is_at_vertex else self.cross_side())
        for c in range(3):
            end[c] = self.leave[c]
        if not has_segments:
            for c in range(3):
                self.entry[c] = self.leave[c]
            self.store(end_face[0])
        return 0

    def start(self, f: cython.longlong, turn: cython.double) -> cython.bint:
        """Set the ray off in face f from `entry`; false if it leads out of the surface at once."""
        c: cython.int
        for c in range(3):
            if self.entry[c] == 1.0:
                # In a vertex: the angle from the side that leaves from this corner.
                if c == 1:
                    turn -= PI - self.angle[f, 1]
                elif c == 2:
                    turn += PI - self.angle[f, 0]
                if turn > PI:
                    turn -= 2.0 * PI
                if turn > self.angle[f, c] and turn - self.angle[f, c] < LEAST_ANGLE:
                    turn = self.angle[f, c]
                if turn < 0.0 and turn > -LEAST_ANGLE:
                    turn = 0.0
                return self.leave_corner(3 * f + c, turn)
        self.ray.h = 3 * f + 2
        self.ray.dx, self.ray.dy = cos(turn), sin(turn)
        self.ray.is_inside, self.ray.is_at_tail = True, False
        return True

    def leave_corner(self, corner: cython.longlong, turn: cython.double) -> cython.bint:
        """Let the ray leave a vertex at the angle `turn` from the side that leaves from `corner`; false if it cannot.

        It cannot if that is beyond the boundary.
        """
        f: cython.longlong = corner // 3
        k: cython.int = corner % 3
        t: cython.longlong
        half: cython.double = self.half[f, k]
        if half > 0.0:
            while turn < 0.0:
                turn += 2.0 * half
        steps: cython.longlong = 0
        while turn < 0.0:
            # Clockwise; on the boundary only.
            t = self.twin[3 * f + (k + 2) % 3]
            if t < 0:
                if turn < -LEAST_ANGLE:
                    return False
                turn = 0.0
                break
            f = t // 3
            k = (t % 3 + 2) % 3
            turn += self.angle[f, k]
        while turn > self.angle[f, k]:
            t = self.twin[3 * f + (k + 1) % 3]
            steps += 1
            if t < 0 or steps > MOST_IDLE:
                if turn - self.angle[f, k] > LEAST_ANGLE:
                    return False
                turn = self.angle[f, k]
                break
            turn -= self.angle[f, k]
            f = t // 3
            k = (t % 3 + 1) % 3
        self.ray.h = 3 * f + (k + 2) % 3
        self.ray.s = 0.0
        self.ray.dx, self.ray.dy = cos(turn), sin(turn)
        self.ray.is_inside, self.ray.is_at_tail = False, True
        return True

    def lay_out(self) -> cython.void:
        """Lay the face out: the tail of the base in the origin (0), the head on the first axis (1), the apex (2)."""
        p = cython.address(self.face)
        f: cython.longlong = self.ray.h // 3
        side: cython.int = self.ray.h % 3
        base: cython.double = self.l[f, side]
        p.f, p.side = f, side
        p.x[0], p.y[0], p.x[1], p.y[1] = 0.0, 0.0, base, 0.0
        p.x[2] = foot(base, self.l[f, (side + 2) % 3], self.l[f, (side + 1) % 3])
        p.y[2] = 2.0 * self.area[f] / base
        if self.ray.is_inside:
            p.start_x = self.entry[1] * base + self.entry[2] * p.x[2]
            p.start_y = self.entry[2] * p.y[2]
        else:
            p.start_x, p.start_y = self.ray.s * base, 0.0
            self.entry[side] = 0.0
            self.entry[(side + 1) % 3] = 1.0 - self.ray.s
            self.entry[(side + 2) % 3] = self.ray.s

    def find_exit(self, travelled: cython.double) -> cython.double:
        """Find the point at which the ray leaves the face; returns the length of the segment up to there.

        `travelled` is the length up to this face. The exit is the share `face.share` of the side from point `face.k`
        of the layout to the next.
        """
        p = cython.address(self.face)
        dx: cython.double = self.ray.dx
        dy: cython.double = self.ray.dy
        a: cython.double
        b: cython.double
        c: cython.int
        # The tail of the side is right of the ray, and the head left of it.
        k: cython.int = 1
        if self.ray.is_inside:
            best: cython.double = -1e300
            for c in range(3):
                a = dx * (p.y[c] - p.start_y) - dy * (p.x[c] - p.start_x)
                b = dx * (p.y[(c + 1) % 3] - p.start_y) - dy * (p.x[(c + 1) % 3] - p.start_x)
                between: cython.double = min(-a, b)
                if fabs(a) + fabs(b) < ON_SIDE * self.l[p.f, (p.side + c) % 3]:
                    # It runs along this side, and leaves at the end: a crossing would be rounding.
                    between -= 1e200
                if between > best:
                    best = between
                    k = c
        elif not self.ray.is_at_tail and not dx * (p.y[2] - p.start_y) - dy * (p.x[2] - p.start_x) > 0.0:
            k = 2
        c = (k + 1) % 3
        a = min(dx * (p.y[k] - p.start_y) - dy * (p.x[k] - p.start_x), 0.0)
        b = max(dx * (p.y[c] - p.start_y) - dy * (p.x[c] - p.start_x), 0.0)
        # Of a face without height that the ray runs along, it takes the end that lies ahead.
        share: cython.double = 1.0 if dx * (p.x[c] - p.x[k]) + dy * (p.y[c] - p.y[k]) > 0.0 else 0.0
        if b - a > 0.0:
            share = -a / (b - a)
        p.k = k
        # Rounding moves a ray by a share of the way that it has come: near its start it may pass a vertex close by.
        come: cython.double = travelled + self.along(c, share)
        near: cython.double = ON_SIDE * min(come / self.l[p.f, (p.side + k) % 3], 1.0)
        if share < near:
            share = 0.0
        elif share > 1.0 - near:
            share = 1.0
        p.share = share
        # The corner of the face at point 0 of the layout is the one after the side.
        self.leave[(p.side + 1 + k) % 3] = 1.0 - share
        self.leave[(p.side + 1 + c) % 3] = share
        self.leave[(p.side + k) % 3] = 0.0
        return self.along(c, share)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def along(self, c: cython.int, share: cython.double) -> cython.double:
        """How far ahead of the start of the segment a share of the side from point `face.k` to point c lies."""
        p = cython.address(self.face)
        x: cython.double = p.x[p.k] + share * (p.x[c] - p.x[p.k]) - p.start_x
        y: cython.double = p.y[p.k] + share * (p.y[c] - p.y[p.k]) - p.start_y
        return max(x * self.ray.dx + y * self.ray.dy, 0.0)

    def pass_vertex(self) -> cython.bint:
        """Go on past the vertex that the ray meets, with equal angles on both sides; false if the surface ends."""
        p = cython.address(self.face)
        c: cython.int = (p.k + 1) % 3 if p.share == 1.0 else p.k
        corner: cython.longlong = 3 * p.f + (p.side + 1 + c) % 3
        half: cython.double = self.half[p.f, corner % 3]
        a: cython.double = p.x[(c + 1) % 3] - p.x[c]
        b: cython.double = p.y[(c + 1) % 3] - p.y[c]
        dx: cython.double = self.ray.dx
        dy: cython.double = self.ray.dy
        # Of the side that leaves from the vertex, the angle to the incoming ray.
        turn: cython.double = atan2(-(a * dy - b * dx), -(a * dx + b * dy))
        # A ray that passes the vertex very near may come from beyond either side.
        if turn < 0.5 * self.angle[p.f, corner % 3] - PI:
            turn += 2.0 * PI
        if half > 0.0:
            self.leave_corner(corner, turn + half)
            return True
        # On the boundary: straight on if one side of the ray has an angle of pi, but not if both have.
        clockwise: cython.bint = self.leave_corner(corner, turn - PI)
        if clockwise == self.leave_corner(corner, turn + PI):
            return False
        if clockwise:
            self.leave_corner(corner, turn - PI)
        return True

    def cross_side(self) -> cython.bint:
        """Go on in the face across the side that the ray meets; false on the boundary."""
        p = cython.address(self.face)
        c: cython.int = (p.k + 1) % 3
        h: cython.longlong = 3 * p.f + (p.side + p.k) % 3
        t: cython.longlong = self.twin[h]
        if t < 0:
            return False
        a: cython.double = (p.x[c] - p.x[p.k]) / self.l[p.f, h % 3]
        b: cython.double = (p.y[c] - p.y[p.k]) / self.l[p.f, h % 3]
        # The other face sees the side from head to tail.
        dx: cython.double = -(self.ray.dx * a + self.ray.dy * b)
        dy: cython.double = fabs(a * self.ray.dy - b * self.ray.dx)
        size: cython.double = hypot(dx, dy)
        self.ray.h, self.ray.s = t, 1.0 - p.share
        self.ray.dx, self.ray.dy = dx / size, dy / size
        self.ray.is_inside, self.ray.is_at_tail = False, False
        return True

    def store(self, f: cython.longlong) -> cython.int:
        """Store the segment from `entry` to `leave` of face f, if segments are asked for."""
        if self.segments is not None:
            self.segments.append(cython.cast(cython.int, f), self.entry, self.leave)
        return 0


def trace(
    triangles,
    face: cython.longlong[::1],
    at: cython.double[:, ::1],
    turn: cython.double[::1],
    length: cython.double[::1],
    end_face: cython.longlong[::1],
    end: cython.double[:, ::1],
    travelled: cython.double[::1],
    stores: cython.bint = False,
):
    """Trace k geodesics over triangles: fill their ends and the lengths travelled (k,).

    `triangles` are edge lengths (m, 3) > 0, areas (m,), angles (m, 3), twins (3 m,), and at each corner (m, 3) half the
    sum of the angles around the vertex, negative on the boundary.
    Returns what they cross, geodesic after geodesic, if it `stores` that: faces (s,), and barycentric coordinates
    (s, 2, 3) of both ends of each segment.
    """
    tracer = _Tracer()
    tracer.l, tracer.area, tracer.angle, tracer.twin, tracer.half = triangles
    tracer.segments = Segments() if stores else None
    i: cython.Py_ssize_t
    with cython.nogil:
        for i in range(face.shape[0]):
            tracer.trace_one(
                face[i],
                cython.address(at[i, 0]),
                turn[i],
                length[i],
                cython.address(end_face[i]),
                cython.address(end[i, 0]),
                cython.address(travelled[i]),
            )
    return tracer.segments.arrays() if stores else None
