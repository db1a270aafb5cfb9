"""Points on a triangulation that is refined: the triangles that they are in after all splits and flips."""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt


def index_moves(kind: cython.longlong[:, ::1], n_faces):
    """Which move is the first to change each face, and which is the next to change each face that a move makes.

    Parameters
    ----------
    kind : (k, 3) int64
        The moves in order: 0, face, first of the two new faces for a split; 1, half-edge, mate for a flip.
    n_faces : int
        Number of faces after all moves.

    Returns
    -------
    first : (n_faces,) int64
        The first move that changes each face; -1 for none.
    following : (k, 3) int64
        For each move, the next one that changes the first, second and third face.
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
):
    """Carry points, given by a face (p,) and barycentric coordinates (p, 3), through all moves, in place."""
    with cython.nogil:
        for i in range(face.shape[0]):
            move: cython.longlong = first[face[i]]
            while move >= 0:
                if kind[move, 0] == 0:
                    piece: cython.longlong = _split(numbers[move], barycentric[i])
                    face[i] = kind[move, 1] if piece == 0 else kind[move, 2] + piece - 1
                else:
                    piece = _flip(kind[move], numbers[move], face[i], barycentric[i])
                    face[i] = kind[move, 1 + piece] // 3
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
    edge: cython.longlong[::1], lengths: cython.double[::1], face: cython.longlong, b: cython.double[::1]
) -> cython.longlong:
    """Whether the first (0) or the second (1) face holds a point after a flip; the coordinates are changed.

    As `Flipped.carry`: before, the faces are pab and qba; after, the first is paq and the second qbp.
    """
    ab: cython.double = lengths[0]
    x_p: cython.double = 0.5 * (ab + (lengths[1] - lengths[2]) * ((lengths[1] + lengths[2]) / ab))
    x_q: cython.double = 0.5 * (ab + (lengths[3] - lengths[4]) * ((lengths[3] + lengths[4]) / ab))
    y_p: cython.double = sqrt(max(lengths[1] * lengths[1] - x_p * x_p, 0.0))
    y_q: cython.double = sqrt(max(lengths[3] * lengths[3] - x_q * x_q, 0.0))
    side: cython.longlong = edge[1]
    in_second: cython.bint = face == edge[2] // 3
    if in_second:
        side = edge[2]
    c: cython.int = side % 3
    at_apex: cython.double = b[c]
    at_a: cython.double = b[(c + 2) % 3] if in_second else b[(c + 1) % 3]
    at_b: cython.double = b[(c + 1) % 3] if in_second else b[(c + 2) % 3]
    # a at the origin, b on the first axis, p above the axis and q below.
    # Twice the signed areas of the triangles of pq with a, b and the point: positive on the side of a.
    of_a: cython.double = (x_p - x_q) * y_q + (y_p + y_q) * x_q
    of_b: cython.double = (x_p - x_q) * y_q - (y_p + y_q) * (ab - x_q)
    of_point: cython.double = at_a * of_a + at_b * of_b
    goes_on: cython.longlong = 0 if of_point >= 0.0 else 1
    third: cython.double = min(max(of_point / (of_b if goes_on else of_a), 0.0), 1.0)
    # The coordinate of the corner beyond pq goes to p and q.
    beyond: cython.double = -at_a / of_b if goes_on else at_b / of_a
    beyond *= (of_a - of_b) / (y_p + y_q)
    at_p: cython.double = beyond * y_q + (0.0 if in_second else at_apex)
    at_q: cython.double = beyond * y_p + (at_apex if in_second else 0.0)
    c = edge[1 + goes_on] % 3
    b[c], b[(c + 1) % 3], b[(c + 2) % 3] = (at_q, third, at_p) if goes_on else (at_p, third, at_q)
    return goes_on
