"""The derivative of the lengths of sides by the positions of the vertices, backwards and forth."""

import cython
from cython.cimports.libc.math import sqrt

__all__ = ["pull_to_positions", "push_to_sides"]


def pull_to_positions(
    F: cython.const[cython.longlong][:, ::1],
    V: cython.const[cython.double][:, ::1],
    by_side: cython.const[cython.double][:, ::1],
    by_position: cython.double[:, ::1],
):
    """Add to `by_position` (n, 3) the derivative by the positions, from that by the sides (m, 3) opposite each corner.

    A side changes by its unit vector times the difference of the velocities of its ends; one without length by 0.
    """
    f: cython.Py_ssize_t
    c: cython.int
    d: cython.int
    corner: cython.longlong[3]
    along: cython.double[3][3]
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(3):
                corner[c] = F[f, c]
            for c in range(3):
                square: cython.double = 0.0
                for d in range(3):
                    along[c][d] = V[corner[(c + 2) % 3], d] - V[corner[(c + 1) % 3], d]
                    square += along[c][d] * along[c][d]
                pull: cython.double = by_side[f, c] / sqrt(square) if square > 0.0 else 0.0
                for d in range(3):
                    along[c][d] *= pull
            for c in range(3):
                for d in range(3):
                    by_position[corner[c], d] += along[(c + 1) % 3][d] - along[(c + 2) % 3][d]


def push_to_sides(
    F: cython.const[cython.longlong][:, ::1],
    V: cython.const[cython.double][:, ::1],
    velocity: cython.const[cython.double][:, ::1],
    by_side: cython.double[:, ::1],
):
    """Write to `by_side` (m, 3) how the sides opposite each corner change, for a `velocity` (n, 3) of each vertex."""
    f: cython.Py_ssize_t
    c: cython.int
    d: cython.int
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(3):
                i: cython.longlong = F[f, (c + 1) % 3]
                j: cython.longlong = F[f, (c + 2) % 3]
                square: cython.double = 0.0
                product: cython.double = 0.0
                for d in range(3):
                    along: cython.double = V[j, d] - V[i, d]
                    square += along * along
                    product += along * (velocity[j, d] - velocity[i, d])
                by_side[f, c] = product / sqrt(square) if square > 0.0 else 0.0
