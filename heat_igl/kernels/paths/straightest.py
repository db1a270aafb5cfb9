"""Straightest geodesics over the triangles of an oriented manifold triangulation (Polthier and Schmies 1998)."""

import cython
from cython.cimports.heat_igl.kernels.mesh.segments import Segments
from cython.cimports.heat_igl.kernels.mesh.triangles import foot
from cython.cimports.heat_igl.kernels.paths.straightest import LEAST_ANGLE, MOST_IDLE, ON_RAY, PI
from cython.cimports.libc.math import INFINITY, atan2, cos, fabs, hypot, sin


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
        """Lay the face out around the start of the ray in it: the tail (0) and the head (1) of the base, the apex (2).

        The base runs along the first axis. Near a corner, the vector to it keeps its digits: it is a sum of sides.
        """
        p = cython.address(self.face)
        f: cython.longlong = self.ray.h // 3
        side: cython.int = self.ray.h % 3
        base: cython.double = self.l[f, side]
        x: cython.double = foot(base, self.l[f, (side + 2) % 3], self.l[f, (side + 1) % 3])
        y: cython.double = 2.0 * self.area[f] / base
        p.f, p.side = f, side
        if not self.ray.is_inside:
            self.entry[side] = 0.0
            self.entry[(side + 1) % 3] = 1.0 - self.ray.s
            self.entry[(side + 2) % 3] = self.ray.s
        tail: cython.double = self.entry[(side + 1) % 3]
        head: cython.double = self.entry[(side + 2) % 3]
        apex: cython.double = self.entry[side]
        p.x[0], p.y[0] = -head * base - apex * x, -apex * y
        p.x[1], p.y[1] = tail * base + apex * (base - x), -apex * y
        p.x[2], p.y[2] = tail * x + head * (x - base), (tail + head) * y

    def find_exit(self, travelled: cython.double) -> cython.double:
        """Find the point at which the ray leaves the face; returns the length of the segment up to there.

        `travelled` is the length up to this face. The exit is the share `face.share` of the side from point `face.k`
        of the layout to the next.
        """
        p = cython.address(self.face)
        dx: cython.double = self.ray.dx
        dy: cython.double = self.ray.dy
        c: cython.int
        # How far left of the ray, and how far ahead, each corner is.
        left: cython.double[3]
        ahead: cython.double[3]
        for c in range(3):
            left[c] = dx * p.y[c] - dy * p.x[c]
            ahead[c] = dx * p.x[c] + dy * p.y[c]
        # The tail of the side is right of the ray, and the head left of it.
        k: cython.int = 1
        if self.ray.is_inside:
            best: cython.double = -INFINITY
            for c in range(3):
                if min(-left[c], left[(c + 1) % 3]) > best:
                    best, k = min(-left[c], left[(c + 1) % 3]), c
        elif not self.ray.is_at_tail and not left[2] > 0.0:
            k = 2
        c = (k + 1) % 3
        a: cython.double = max(-left[k], 0.0)
        b: cython.double = max(left[c], 0.0)
        # Rounding moves a ray by a share of its length: what it misses by less, it meets, also if it grazes the side.
        length: cython.double = self.l[p.f, (p.side + k) % 3]
        meets_tail: cython.bint = a < ON_RAY * min(travelled + ahead[k], length)
        meets_head: cython.bint = b < ON_RAY * min(travelled + ahead[c], length)
        share: cython.double
        if meets_tail == meets_head and (meets_tail or a + b == 0.0):
            # It runs along the side, and takes the end that lies farther ahead.
            share = 1.0 if ahead[c] > ahead[k] else 0.0
        elif meets_tail or meets_head:
            share = 1.0 if meets_head else 0.0
        else:
            share = a / (a + b)
        p.k, p.share = k, share
        # The corner of the face at point 0 of the layout is the one after the side.
        self.leave[(p.side + 1 + k) % 3] = 1.0 - share
        self.leave[(p.side + 1 + c) % 3] = share
        self.leave[(p.side + k) % 3] = 0.0
        return max(ahead[k] + share * (ahead[c] - ahead[k]), 0.0)

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
