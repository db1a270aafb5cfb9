"""Planes and quadrics fitted to the neighbours of points. Points weigh 1 - (d / r)^2, at distance d of radius r."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.rotation import diagonalize
from cython.cimports.libc.math import sqrt


def tangent_planes(P: cython.const[cython.double][:, ::1], index: cython.const[cython.int][:, ::1]):
    """The principal axes of neighbourhoods, and the ratio (b,) of the two smaller variances.

    Each row of `index` (b, k) int32 is a neighbourhood: one of the points P (n, 3), then its neighbours by distance.
    The rows of the axes (b, 3, 3) are orthonormal: the directions of most, less and least variance. The last is the
    normal.
    """
    found, bends = np.empty((index.shape[0], 3, 3)), np.empty(index.shape[0])
    bend: cython.double[::1] = bends
    axes: cython.double[:, :, ::1] = found
    local: cython.double[:, ::1] = np.empty((index.shape[1], 8))
    with cython.nogil:
        for row in range(index.shape[0]):
            _around(P, index[row], local)
            bend[row] = _principal(local, axes[row])
    return found, bends


def onto_quadrics(P: cython.const[cython.double][:, ::1], index: cython.const[cython.int][:, ::1]):
    """Points moved along the normals of fitted planes onto quadrics that are fitted to their neighbours.

    Each row of `index` (b, k) int32 is one of the points P (n, 3), then its neighbours in any order. Returns the new
    positions (b, 3), and the standard deviation (b,) of the neighbours from the quadric, in radii of the neighbourhood.
    """
    b: cython.Py_ssize_t = index.shape[0]
    k: cython.Py_ssize_t = index.shape[1]
    positions, deviations = np.empty((b, 3)), np.empty(b)
    moved: cython.double[:, ::1] = positions
    deviation: cython.double[::1] = deviations
    local: cython.double[:, ::1] = np.empty((k, 8))
    axes: cython.double[:, ::1] = np.empty((3, 3))
    system: cython.double[49]
    # Six coefficients take six degrees of freedom from the neighbours.
    freedom: cython.double = max(1.0 - 6.0 / (k - 1.0), 0.5)
    a: cython.int
    with cython.nogil:
        for row in range(b):
            radius: cython.double = _around(P, index[row], local)
            _principal(local, axes)
            for j in range(k):
                x: cython.double = _along(axes[0], local[j])
                y: cython.double = _along(axes[1], local[j])
                local[j, 6] = _along(axes[2], local[j])
                local[j, 1], local[j, 2], local[j, 3], local[j, 4], local[j, 5] = x, y, x * x, x * y, y * y
            _moments(local, 7, system)
            total: cython.double = system[0]
            for a in range(6):
                system[8 * a] += DIAGONAL * k
            _eliminate(system)
            squares: cython.double = 0.0
            for j in range(k):
                off: cython.double = local[j, 6]
                for a in range(6):
                    off -= system[7 * a + 6] * local[j, a]
                squares += local[j, 7] * off * off
            deviation[row] = sqrt(squares / (total * freedom))
            for a in range(3):
                moved[row, a] = P[index[row, 0], a] + radius * system[6] * axes[2, a]
    return positions, deviations


def _around(P, index, local):
    """Put 1, the way to each neighbour in units of the radius, and its weight into columns 0 to 3 and 7; the radius."""
    farthest: cython.double = 0.0
    for j in range(index.shape[0]):
        local[j, 0], local[j, 7] = 1.0, 0.0
        for x in range(3):
            local[j, 1 + x] = P[index[j], x] - P[index[0], x]
            local[j, 7] += local[j, 1 + x] * local[j, 1 + x]
        farthest = max(farthest, local[j, 7])
    # In units of the radius: squares of tiny lengths would underflow.
    radius: cython.double = max(sqrt(farthest), TINY)
    scale: cython.double = 1.0 / radius
    per_square: cython.double = 1.0 / max(farthest, TINY)
    for j in range(index.shape[0]):
        for x in range(3):
            local[j, 1 + x] *= scale
        local[j, 7] = max(1.0 - per_square * local[j, 7], LEAST_WEIGHT)
    return radius


def _along(axis, term):
    """The component of a way, see `_around`, along an axis."""
    return axis[0] * term[1] + axis[1] * term[2] + axis[2] * term[3]


def _moments(local, n, moment):
    """Weighted sums of products of the first n columns: the upper half of a matrix (n, n)."""
    a: cython.int
    b: cython.int
    for a in range(n * n):
        moment[a] = 0.0
    for j in range(local.shape[0]):
        for a in range(n):
            weighted: cython.double = local[j, 7] * local[j, a]
            for b in range(a, n):
                moment[n * a + b] += weighted * local[j, b]


def _eliminate(system):
    """Solve for the last of seven columns; the matrix is symmetric and positive definite: its upper half is enough."""
    a: cython.int
    b: cython.int
    c: cython.int
    for c in range(6):
        for a in range(c + 1, 6):
            factor: cython.double = system[7 * c + a] / system[8 * c]
            for b in range(a, 7):
                system[7 * a + b] -= factor * system[7 * c + b]
    for c in range(5, -1, -1):
        for b in range(c + 1, 6):
            system[7 * c + 6] -= system[7 * c + b] * system[7 * b + 6]
        system[7 * c + 6] /= system[8 * c]


def _principal(local, axes):
    """The axes of most, less and least variance of the ways, see `_around`; the ratio of the two smaller variances."""
    moment: cython.double[16]
    work: cython.double[18]
    variance: cython.double[3]
    _moments(local, 4, moment)
    a: cython.int
    b: cython.int
    for a in range(1, 16):
        moment[a] /= moment[0]
    for a in range(3):
        for b in range(a, 3):
            work[3 * a + b] = work[3 * b + a] = moment[5 + 4 * a + b] - moment[1 + a] * moment[1 + b]
    diagonalize(work)
    for a in range(3):
        rank: cython.int = 0
        for b in range(3):
            rank += work[4 * b] > work[4 * a] or (work[4 * b] == work[4 * a] and b < a)
        variance[rank] = work[4 * a]
        for b in range(3):
            axes[rank, b] = work[9 + 3 * a + b]
    return variance[2] / max(variance[1], TINY)
