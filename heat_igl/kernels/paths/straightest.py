"""Straightest geodesics over the triangles of an oriented manifold triangulation (Polthier and Schmies 1998)."""

import cython
from cython.cimports.heat_igl.kernels.mesh.segments import SegmentList
from cython.cimports.heat_igl.kernels.mesh.straight import INSIDE, OUT_OF_TAIL, OVER_SIDE, Heading, cross
from cython.cimports.heat_igl.kernels.mesh.triangles import foot
from cython.cimports.libc.math import M_PI, atan2, cos, fabs, hypot, sin

# A geodesic meets a vertex that it would pass by less than this share of the way to it, or of the side that it crosses
# if that is shorter: across 10000 faces rounding moves it by some 1e-12.
_ON_RAY = cython.declare(cython.double, 1e-10)
# Angles that differ by less are equal: those of the faces around a vertex are rounded, and the direction is.
_LEAST_ANGLE = cython.declare(cython.double, 1e-10)
# A geodesic that crosses so many faces in a row on less than this share of their sides is lost: they have no area.
_MOST_IDLE = cython.declare(cython.int, 1000000)
_IDLE = cython.declare(cython.double, 1e-6)


@cython.final
@cython.cclass
class _Tracer:
    """Triangles, the geodesic being traced, and room for the segments of all, if they are stored."""

    def trace_one(self, face, at, turn, length):
        """One geodesic, to ``leave`` in ``end_face``; `travelled` is -1 if it is lost among faces without area.

        It begins at barycentric coordinates `at` in `face`, at the angle `turn` from the direction of corner 0 to
        corner 1.
        """
        has_segments: cython.bint = False
        idle: cython.longlong = 0
        left: cython.double = length
        for c in range(3):
            self.entry[c] = self.leave[c] = at[c]
        self.end_face, self.travelled = face, 0.0
        goes_on: cython.bint = length > 0.0 and self.start(face, turn)
        while goes_on:
            f: cython.longlong = self.ray.h // 3
            self.exit = cross(cython.address(self.l[0, 0]), 2.0 * self.area[f], cython.address(self.ray))
            step: cython.double = self.find_exit()
            ends: cython.bint = step >= left
            if ends:
                share: cython.double = left / step
                for c in range(3):
                    self.leave[c] = self.entry[c] + share * (self.leave[c] - self.entry[c])
                self.travelled = length
            else:
                left -= step
                self.travelled = length - left
            self.end_face = f
            idle = idle + 1 if step < _IDLE * max(self.l[f, 0], self.l[f, 1], self.l[f, 2]) else 0
            if idle > _MOST_IDLE:
                self.travelled = -1.0
                break
            if step > 0.0 or ends:
                self.store(f)
                has_segments = True
            is_at_vertex: cython.bint = self.share == 0.0 or self.share == 1.0
            goes_on = not ends and (self.pass_vertex() if is_at_vertex else self.cross_side())
        if not has_segments:
            for c in range(3):
                self.entry[c] = self.leave[c]
            self.store(self.end_face)
        return 0

    def start(self, f, turn):
        """Set the ray off in face f from `entry`; false if it leads out of the surface at once."""
        # From the nearest corner on, so that near it the vector to it keeps its digits.
        k: cython.int = 0
        for c in range(1, 3):
            if self.entry[c] > self.entry[k]:
                k = c
        # The angle from the side that leaves from this corner.
        if k == 1:
            turn -= M_PI - self.angle[f, 1]
        elif k == 2:
            turn += M_PI - self.angle[f, 0]
        if self.entry[k] == 1.0:
            if turn > M_PI:
                turn -= 2.0 * M_PI
            if turn > self.angle[f, k] and turn - self.angle[f, k] < _LEAST_ANGLE:
                turn = self.angle[f, k]
            if turn < 0.0 and turn > -_LEAST_ANGLE:
                turn = 0.0
            return self.leave_corner(3 * f + k, turn)
        side: cython.int = (k + 2) % 3
        base: cython.double = self.l[f, side]
        apex: cython.double = self.entry[side]
        x: cython.double = foot(base, self.l[f, (side + 2) % 3], self.l[f, (side + 1) % 3])
        x = self.entry[(k + 1) % 3] * base + apex * x
        y: cython.double = apex * 2.0 * self.area[f] / base
        self.ray = Heading(cython.cast(cython.int, 3 * f + side), INSIDE, x, y, cos(turn), sin(turn))
        return True

    def leave_corner(self, corner, turn):
        """Let the ray leave a vertex at the angle `turn` from the side that leaves from `corner`; false if it cannot.

        It cannot if that is beyond the boundary.
        """
        f: cython.longlong = corner // 3
        k: cython.int = corner % 3
        half: cython.double = self.half[f, k]
        if half > 0.0:
            while turn < 0.0:
                turn += 2.0 * half
        steps: cython.longlong = 0
        while turn < 0.0:
            # Clockwise; on the boundary only.
            t = self.twin[3 * f + (k + 2) % 3]
            if t < 0:
                if turn < -_LEAST_ANGLE:
                    return False
                turn = 0.0
                break
            f = t // 3
            k = (t % 3 + 2) % 3
            turn += self.angle[f, k]
        while turn > self.angle[f, k]:
            t = self.twin[3 * f + (k + 1) % 3]
            steps += 1
            if t < 0 or steps > _MOST_IDLE:
                if turn - self.angle[f, k] > _LEAST_ANGLE:
                    return False
                turn = self.angle[f, k]
                break
            turn -= self.angle[f, k]
            f = t // 3
            k = (t % 3 + 1) % 3
        for c in range(3):
            self.entry[c] = 1.0 if c == k else 0.0
        h: cython.int = cython.cast(cython.int, 3 * f + (k + 2) % 3)
        self.ray = Heading(h, OUT_OF_TAIL, 0.0, 0.0, cos(turn), sin(turn))
        return True

    def find_exit(self):
        """Find the point at which the ray leaves the face; returns the length of the segment up to there.

        The point is the share `share` of the half-edge ``exit.h``.
        """
        p = cython.address(self.exit)
        length: cython.double = self.l[p.h // 3, p.h % 3]
        # Rounding moves a ray by a share of its length: what it misses by less, it meets, also if it grazes the side.
        meets_tail: cython.bint = p.right < _ON_RAY * min(self.travelled + p.tail_ahead, length)
        meets_head: cython.bint = p.left < _ON_RAY * min(self.travelled + p.head_ahead, length)
        if meets_tail == meets_head and (meets_tail or p.right + p.left == 0.0):
            # It runs along the side, and takes the end that lies farther ahead.
            self.share = 1.0 if p.head_ahead > p.tail_ahead else 0.0
        elif meets_tail or meets_head:
            self.share = 1.0 if meets_head else 0.0
        else:
            self.share = p.right / (p.right + p.left)
        self.leave[p.h % 3] = 0.0
        self.leave[(p.h + 1) % 3] = 1.0 - self.share
        self.leave[(p.h + 2) % 3] = self.share
        return max(p.tail_ahead + self.share * (p.head_ahead - p.tail_ahead), 0.0)

    def pass_vertex(self):
        """Go on past the vertex that the ray meets, with equal angles on both sides; false if the surface ends."""
        p = cython.address(self.exit)
        f: cython.longlong = p.h // 3
        k: cython.int = (p.h + 1) % 3
        # Of the side that leaves from the vertex, the angle to the incoming ray.
        turn: cython.double = atan2(fabs(p.dy), p.dx)
        if self.share == 1.0:
            k = (p.h + 2) % 3
            turn += self.angle[f, k] - M_PI
        half: cython.double = self.half[f, k]
        if half > 0.0:
            self.leave_corner(3 * f + k, turn + half)
            return True
        # On the boundary: straight on if one side of the ray has an angle of pi, but not if both have.
        clockwise: cython.bint = self.leave_corner(3 * f + k, turn - M_PI)
        if clockwise == self.leave_corner(3 * f + k, turn + M_PI):
            return False
        if clockwise:
            self.leave_corner(3 * f + k, turn - M_PI)
        return True

    def cross_side(self):
        """Go on in the face across the side that the ray meets; false on the boundary."""
        p = cython.address(self.exit)
        t: cython.longlong = self.twin[p.h]
        if t < 0:
            return False
        self.entry[t % 3] = 0.0
        self.entry[(t + 1) % 3] = self.share
        self.entry[(t + 2) % 3] = 1.0 - self.share
        size: cython.double = hypot(p.dx, p.dy)
        x: cython.double = (1.0 - self.share) * self.l[t // 3, t % 3]
        self.ray = Heading(cython.cast(cython.int, t), OVER_SIDE, x, 0.0, p.dx / size, fabs(p.dy) / size)
        return True

    def store(self, f):
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
    """Trace k geodesics over triangles: fill their ends and the lengths travelled (k,), -1 for those that are lost.

    `triangles` are edge lengths (m, 3) > 0, areas (m,), angles (m, 3), twins (3 m,), and at each corner (m, 3) half the
    sum of the angles around the vertex, negative on the boundary.
    Returns what they cross, geodesic after geodesic, if it `stores` that: faces (s,), and barycentric coordinates
    (s, 2, 3) of both ends of each segment.
    """
    tracer = _Tracer()
    tracer.l, tracer.area, tracer.angle, tracer.twin, tracer.half = triangles
    tracer.segments = SegmentList() if stores else None
    with cython.nogil:
        for i in range(face.shape[0]):
            tracer.trace_one(face[i], cython.address(at[i, 0]), turn[i], length[i])
            end_face[i], travelled[i] = tracer.end_face, tracer.travelled
            for c in range(3):
                end[i, c] = tracer.leave[c]
    return tracer.segments.arrays() if stores else None
