"""Straightest geodesics over the triangles of an oriented manifold triangulation (Polthier and Schmies 1998)."""

import cython
from cython.cimports.heat_igl.kernels.triangles import foot
from cython.cimports.libc.math import atan2, cos, fabs, hypot, sin

__all__ = ["Triangles", "trace"]


@cython.cclass
class Triangles:
    """m triangles by edge lengths `l` (m, 3) > 0, areas (m,) and angles (m, 3), glued by `twin` (3 m,).

    `half` (m, 3) is at each corner half the sum of the angles around its vertex, and negative on the boundary.
    """

    l: cython.double[:, ::1]  # noqa: E741
    area: cython.double[::1]
    angle: cython.double[:, ::1]
    twin: cython.longlong[::1]
    half: cython.double[:, ::1]

    def __init__(self, l, area, angle, twin, half):  # noqa: E741
        self.l, self.area, self.angle, self.twin, self.half = l, area, angle, twin, half


@cython.cclass
class _Ray:
    """A point on the base of a face, and the direction in which it moves.

    The base is half-edge `h`, from its tail in the origin to its head on the first axis; the face is above it. The
    point is the share `s` of the base from the tail. `at_tail`: it is the tail, and leaves across the side opposite.
    """

    h: cython.longlong
    s: cython.double
    dx: cython.double
    dy: cython.double
    at_tail: cython.bint


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _leave_corner(tables: Triangles, ray: _Ray, corner: cython.longlong, turn: cython.double) -> cython.bint:
    """Let the ray leave a vertex at the angle `turn` from the side that leaves from `corner`; false if it cannot.

    It cannot where that is beyond the boundary.
    """
    f: cython.longlong = corner // 3
    k: cython.int = corner % 3
    t: cython.longlong
    half: cython.double = tables.half[f, k]
    if half > 0.0:
        while turn < 0.0:
            turn += 2.0 * half
    steps: cython.longlong = 0
    while turn < 0.0:
        # Clockwise; on the boundary only.
        t = tables.twin[3 * f + (k + 2) % 3]
        if t < 0:
            if turn < -LEAST_ANGLE:
                return False
            turn = 0.0
            break
        f = t // 3
        k = (t % 3 + 2) % 3
        turn += tables.angle[f, k]
    while turn > tables.angle[f, k]:
        t = tables.twin[3 * f + (k + 1) % 3]
        steps += 1
        if t < 0 or steps > MOST_IDLE:
            if turn - tables.angle[f, k] > LEAST_ANGLE:
                return False
            turn = tables.angle[f, k]
            break
        turn -= tables.angle[f, k]
        f = t // 3
        k = (t % 3 + 1) % 3
    ray.h = 3 * f + (k + 2) % 3
    ray.s = 0.0
    ray.dx = cos(turn)
    ray.dy = sin(turn)
    ray.at_tail = True
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _trace_one(
    tables: Triangles,
    ray: _Ray,
    face: cython.longlong,
    at: cython.p_double,
    turn: cython.double,
    length: cython.double,
    faces: cython.p_longlong,
    points: cython.p_double,
    end_face: cython.p_longlong,
    end: cython.p_double,
    travelled: cython.p_double,
) -> cython.longlong:
    """One geodesic; returns the number of its segments, which are stored if `faces` is not null.

    It begins at barycentric coordinates `at` in `face`, at the angle `turn` from the direction of corner 0 to corner 1.
    """
    f: cython.longlong = face
    c: cython.int
    k: cython.int
    side: cython.int = 2
    n: cython.longlong = 0
    idle: cython.longlong = 0
    left: cython.double = length
    length_of_step: cython.double
    entry: cython.double[3]
    leave: cython.double[3]
    px: cython.double[3]
    py: cython.double[3]
    a: cython.double
    b: cython.double
    best: cython.double
    share: cython.double
    base: cython.double
    dx: cython.double = cos(turn)
    dy: cython.double = sin(turn)
    sx: cython.double
    sy: cython.double
    inside: cython.bint = True
    for c in range(3):
        entry[c] = at[c]
        end[c] = at[c]
    end_face[0] = face
    travelled[0] = 0.0
    if not length > 0.0:
        if faces != cython.NULL:
            _store(faces, points, 0, face, entry, entry)
        return 1
    for c in range(3):
        if entry[c] == 1.0:
            # In a vertex: the angle from the side that leaves from this corner.
            if c == 1:
                turn -= PI - tables.angle[f, 1]
            elif c == 2:
                turn += PI - tables.angle[f, 0]
            if turn > PI:
                turn -= 2.0 * PI
            if turn > tables.angle[f, c] and turn - tables.angle[f, c] < LEAST_ANGLE:
                turn = tables.angle[f, c]
            if turn < 0.0 and turn > -LEAST_ANGLE:
                turn = 0.0
            if not _leave_corner(tables, ray, 3 * f + c, turn):
                if faces != cython.NULL:
                    _store(faces, points, 0, face, entry, entry)
                return 1
            inside = False
    while True:
        # Lay out the face: the tail of the base in the origin (0), the head on the first axis (1), the apex (2).
        if inside:
            side = 2
        else:
            f = ray.h // 3
            side = ray.h % 3
            dx = ray.dx
            dy = ray.dy
        base = tables.l[f, side]
        px[0], py[0], px[1], py[1] = 0.0, 0.0, base, 0.0
        px[2] = foot(base, tables.l[f, (side + 2) % 3], tables.l[f, (side + 1) % 3])
        py[2] = 2.0 * tables.area[f] / base
        if inside:
            sx = entry[1] * base + entry[2] * px[2]
            sy = entry[2] * py[2]
        else:
            sx = ray.s * base
            sy = 0.0
            entry[side] = 0.0
            entry[(side + 1) % 3] = 1.0 - ray.s
            entry[(side + 2) % 3] = ray.s
        # Side k runs from point k to the next. The ray leaves by that whose tail is on its right and head on its left.
        k = 1
        if inside:
            best = -1e300
            for c in range(3):
                a = dx * (py[c] - sy) - dy * (px[c] - sx)
                b = dx * (py[(c + 1) % 3] - sy) - dy * (px[(c + 1) % 3] - sx)
                share = min(-a, b)
                if fabs(a) + fabs(b) < ON_SIDE * tables.l[f, (c + 2) % 3]:
                    # It runs along this side, and leaves at its end: where it crosses would be rounding.
                    share -= 1e200
                if share > best:
                    best = share
                    k = c
        elif not ray.at_tail and not dx * (py[2] - sy) - dy * (px[2] - sx) > 0.0:
            k = 2
        c = (k + 1) % 3
        a = min(dx * (py[k] - sy) - dy * (px[k] - sx), 0.0)
        b = max(dx * (py[c] - sy) - dy * (px[c] - sx), 0.0)
        # Of a face without height that the ray runs along, it takes the end that lies ahead.
        if b - a > 0.0:  # noqa: SIM108
            share = -a / (b - a)
        else:
            share = 1.0 if dx * (px[c] - px[k]) + dy * (py[c] - py[k]) > 0.0 else 0.0
        if share < ON_SIDE:
            share = 0.0
        elif share > 1.0 - ON_SIDE:
            share = 1.0
        length_of_step = (px[k] + share * (px[c] - px[k]) - sx) * dx + (py[k] + share * (py[c] - py[k]) - sy) * dy
        length_of_step = max(length_of_step, 0.0)
        # Corner of the face at point 0 of the layout is the one after the side.
        leave[(side + 1 + k) % 3] = 1.0 - share
        leave[(side + 1 + c) % 3] = share
        leave[(side + k) % 3] = 0.0
        ends: cython.bint = length_of_step >= left
        if ends:
            share_of_step: cython.double = left / length_of_step
            for c in range(3):
                leave[c] = entry[c] + share_of_step * (leave[c] - entry[c])
            travelled[0] = length
        else:
            left -= length_of_step
            travelled[0] = length - left
        if length_of_step > 0.0 or ends:
            if faces != cython.NULL:
                _store(faces, points, n, f, entry, leave)
            n += 1
            idle = 0
        else:
            idle += 1
        end_face[0] = f
        for c in range(3):
            end[c] = leave[c]
        if ends:
            return n
        if share == 0.0 or share == 1.0:
            # At a vertex: equal angles on both sides, as seen from where the ray comes from.
            c = (k + 1) % 3 if share == 1.0 else k
            corner: cython.longlong = 3 * f + (side + 1 + c) % 3
            half: cython.double = tables.half[f, corner % 3]
            c2: cython.int = (c + 1) % 3
            a = px[c2] - px[c]
            b = py[c2] - py[c]
            turn = atan2(-(a * dy - b * dx), -(a * dx + b * dy))
            # A ray that passes the vertex very near may come from beyond either side.
            if turn < 0.5 * tables.angle[f, corner % 3] - PI:
                turn += 2.0 * PI
            if idle > MOST_IDLE:
                break
            if half > 0.0:
                _leave_corner(tables, ray, corner, turn + half)
            else:
                # On the boundary: straight on if one side of the ray has an angle of pi, but not if both have.
                clockwise: cython.bint = _leave_corner(tables, ray, corner, turn - PI)
                if clockwise == _leave_corner(tables, ray, corner, turn + PI):
                    break
                if clockwise:
                    _leave_corner(tables, ray, corner, turn - PI)
        else:
            h: cython.longlong = 3 * f + (side + k) % 3
            t: cython.longlong = tables.twin[h]
            if t < 0 or idle > MOST_IDLE:
                break
            c = (k + 1) % 3
            a = (px[c] - px[k]) / tables.l[f, h % 3]
            b = (py[c] - py[k]) / tables.l[f, h % 3]
            # The other face sees the side from its head to its tail.
            ray.dx = -(dx * a + dy * b)
            ray.dy = fabs(a * dy - b * dx)
            base = hypot(ray.dx, ray.dy)
            ray.dx /= base
            ray.dy /= base
            ray.h = t
            ray.s = 1.0 - share
            ray.at_tail = False
        inside = False
    if n == 0:
        if faces != cython.NULL:
            _store(faces, points, 0, end_face[0], end, end)
        n = 1
    return n


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _store(
    faces: cython.p_longlong,
    points: cython.p_double,
    n: cython.longlong,
    f: cython.longlong,
    start: cython.p_double,
    end: cython.p_double,
) -> cython.void:
    """Segment number n."""
    c: cython.int
    faces[n] = f
    for c in range(3):
        points[6 * n + c] = start[c]
        points[6 * n + 3 + c] = end[c]


def trace(
    tables: Triangles,
    face: cython.longlong[::1],
    at: cython.double[:, ::1],
    turn: cython.double[::1],
    length: cython.double[::1],
    end_face: cython.longlong[::1],
    end: cython.double[:, ::1],
    travelled: cython.double[::1],
    count: cython.longlong[::1],
    first: cython.longlong[::1],
    faces: cython.longlong[::1],
    points: cython.double[:, :, ::1],
):
    """Trace k geodesics: fill their ends, the lengths travelled and the numbers of their segments (k,).

    If `first` has k entries, the segments of geodesic i are stored from `first[i]` on: faces (s,) and the barycentric
    coordinates of both ends (s, 2, 3).
    """
    ray: _Ray = _Ray()
    stores: cython.bint = first.shape[0] > 0
    i: cython.Py_ssize_t
    k: cython.Py_ssize_t = face.shape[0]
    with cython.nogil:
        for i in range(k):
            count[i] = _trace_one(
                tables,
                ray,
                face[i],
                cython.address(at[i, 0]),
                turn[i],
                length[i],
                cython.address(faces[first[i]]) if stores else cython.NULL,
                cython.address(points[first[i], 0, 0]) if stores else cython.NULL,
                cython.address(end_face[i]),
                cython.address(end[i, 0]),
                cython.address(travelled[i]),
            )
