"""Points on a triangulation that is changed: the triangles that they are in after splits and flips."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.triangles import area, foot
from cython.cimports.libc.math import atan2


def index_moves(kind: cython.longlong[:, ::1], n_faces):
    """Which move is the first to change each face, and the next to change each face that a move makes; -1 for none.

    `kind` (k, 3) are the moves, as `Moved` has them, and there are `n_faces` after all of them. Returns an array
    (n_faces,), and (k, 3) for the first, second and third face of each move.
    """
    k = kind.shape[0]
    first_array, following_array = np.full(n_faces, -1), np.full((k, 3), -1)
    first: cython.longlong[::1] = first_array
    following: cython.longlong[:, ::1] = following_array
    for i in range(kind.shape[0] - 1, -1, -1):
        if kind[i, 0] == 0:
            f, g = kind[i, 1], kind[i, 2]
            following[i, 0], following[i, 1], following[i, 2] = first[f], first[g], first[g + 1]
            first[f] = first[g] = first[g + 1] = i
        else:
            f, g = kind[i, 1] // 3, kind[i, 2] // 3
            following[i, 0], following[i, 1] = first[f], first[g]
            first[f] = first[g] = i
    return first_array, following_array


def carry(
    kind: cython.longlong[:, ::1],
    numbers: cython.double[:, ::1],
    first: cython.longlong[::1],
    following: cython.longlong[:, ::1],
    face: cython.longlong[::1],
    barycentric: cython.double[:, ::1],
    turn: cython.double[::1],
):
    """Carry points, given by a face (p,) and barycentric coordinates (p, 3), through all moves, in place.

    Unless it is empty, `turn` (p,) grows by the angle of `_turn` at each flip.
    """
    with cython.nogil:
        for i in range(face.shape[0]):
            move: cython.longlong = first[face[i]]
            while move >= 0:
                if kind[move, 0] == 0:
                    piece: cython.longlong = _split(numbers[move], barycentric[i])
                    face[i] = kind[move, 1] if piece == 0 else kind[move, 2] + piece - 1
                else:
                    in_second: cython.longlong = face[i] == kind[move, 2] // 3
                    piece = _flip(kind[move, 1], kind[move, 2], numbers[move], in_second, barycentric[i])
                    face[i] = kind[move, 1 + piece] // 3
                    if turn.shape[0] > 0:
                        turn[i] += _turn(kind[move, 1], kind[move, 2], numbers[move], in_second, piece)
                move = following[move, piece]


@cython.cfunc
@cython.nogil
def _split(at: cython.double[::1], b: cython.double[::1]) -> cython.longlong:
    """Which of the three faces around a new vertex with coordinates `at` holds a point, whose coordinates are changed.

    Face c lacks the old corner c and has the new vertex instead. The point is in the face whose lacking corner
    has the least share of the point in proportion to the share of the new vertex.
    """
    c: cython.int = 0
    for k in range(1, 3):
        if b[k] * at[c] < b[c] * at[k]:
            c = k
    share: cython.double = b[c] / at[c]
    for k in range(3):
        b[k] = max(b[k] - share * at[k], 0.0)
    b[c] = share
    return c


@cython.cfunc
@cython.nogil
def _flip(
    half_edge: cython.longlong,
    mate: cython.longlong,
    lengths: cython.double[::1],
    in_second: cython.longlong,
    b: cython.double[::1],
) -> cython.longlong:
    """Whether the first (0) or the second (1) face holds a point after a flip; the coordinates are changed.

    As `Moved` has it: before, the faces are pab and qba; after, the first is paq and the second qbp.
    """
    # a at the origin, b on the first axis, p above the axis and q below.
    ab: cython.double = lengths[0]
    x_p: cython.double = foot(ab, lengths[1], lengths[2])
    x_q: cython.double = foot(ab, lengths[3], lengths[4])
    y_p: cython.double = 2.0 * area(ab, lengths[1], lengths[2]) / ab
    y_q: cython.double = 2.0 * area(ab, lengths[3], lengths[4]) / ab
    c: cython.int = (mate if in_second else half_edge) % 3
    at_apex: cython.double = b[c]
    at_a: cython.double = b[(c + 2) % 3] if in_second else b[(c + 1) % 3]
    at_b: cython.double = b[(c + 1) % 3] if in_second else b[(c + 2) % 3]
    # Twice the signed areas of the triangles of pq with a, b and the point: positive on the side of a.
    of_a: cython.double = (x_p - x_q) * y_q + (y_p + y_q) * x_q
    of_b: cython.double = (x_p - x_q) * y_q - (y_p + y_q) * (ab - x_q)
    of_point: cython.double = at_a * of_a + at_b * of_b
    goes_on: cython.longlong = 0 if of_point >= 0.0 else 1
    third: cython.double = min(max(of_point / (of_b if goes_on else of_a), 0.0), 1.0)
    # The coordinate of the corner beyond pq goes to p and q, in sums of positive numbers: a point beside a corner keeps
    # its direction from there.
    beyond: cython.double = -at_a / of_b if goes_on else at_b / of_a
    beyond *= (of_a - of_b) / (y_p + y_q)
    at_p: cython.double = beyond * y_q + (0.0 if in_second else at_apex)
    at_q: cython.double = beyond * y_p + (at_apex if in_second else 0.0)
    c = (mate if goes_on else half_edge) % 3
    b[c], b[(c + 1) % 3], b[(c + 2) % 3] = (at_q, third, at_p) if goes_on else (at_p, third, at_q)
    return goes_on


@cython.cfunc
@cython.nogil
def _turn(
    half_edge: cython.longlong,
    mate: cython.longlong,
    lengths: cython.double[::1],
    in_second: cython.longlong,
    goes_on: cython.longlong,
) -> cython.double:
    """What leads from an angle in the face after a flip to the angle of the same direction in the face before.

    Both count from the side of corners 0 and 1. The faces are the first (0) or the second (1), as in `_flip`.
    """
    x: cython.double[4]
    y: cython.double[4]
    # The corners p, q, a and b in the plane.
    x[0], y[0] = foot(lengths[0], lengths[1], lengths[2]), 2.0 * area(lengths[0], lengths[1], lengths[2]) / lengths[0]
    x[1], y[1] = foot(lengths[0], lengths[3], lengths[4]), -2.0 * area(lengths[0], lengths[3], lengths[4]) / lengths[0]
    x[2], y[2], x[3], y[3] = 0.0, 0.0, lengths[0], 0.0
    corner: cython.int[3]
    angle: cython.double[2]
    for is_after in range(2):
        is_second: cython.int = goes_on if is_after else in_second
        # From the corner opposite the edge on: pab and qba before, paq and qbp after.
        corner[0], corner[1], corner[2] = is_second, 2 + is_second, (1 if is_after else 3) - is_second
        first: cython.int = (3 - (mate if is_second else half_edge) % 3) % 3
        start: cython.int = corner[first]
        end: cython.int = corner[(first + 1) % 3]
        angle[is_after] = atan2(y[end] - y[start], x[end] - x[start])
    return angle[1] - angle[0]
