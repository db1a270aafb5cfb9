"""Planes fitted to the neighbours of points. Points weigh 1 - (d / r)^2, at distance d of radius r."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.cloud.local_planes import BENT, FLATTER, LEAST_WEIGHT, TINY
from cython.cimports.libc.math import fabs, sqrt

__all__ = ["tangent_planes"]


def tangent_planes(
    P: cython.const[cython.double][:, ::1],
    index: cython.int[:, ::1],
    square: cython.const[cython.double][:, ::1],
    shrinks: cython.bint,
):
    """Tangents and normals of points, by principal components of neighbourhoods, some of which are made smaller.

    Parameters
    ----------
    P : (n, 3) float64
        All points.
    index, square : (b, k) int32, (b, k) float64
        Neighbours of some points, by distance and each point first, -1 after the last, and the squared distances.
        Neighbours that are left out become -1.
    shrinks : bool
        Whether two thirds, a half and a third of the neighbours are tried where the points vary much along the normal,
        and those taken that are flatter.

    Returns
    -------
    axes : (b, 3, 3) float64
        Directions of most, less and least variance in rows, orthonormal.
    radius : (b,) float64
        Distance of the farthest neighbour that is left.
    bend : (b,) float64
        Ratio of the two smaller variances of all neighbours.
    """
    found, radii, bends = np.empty((index.shape[0], 3, 3)), np.empty(index.shape[0]), np.empty(index.shape[0])
    bent: cython.double[::1] = bends
    axes: cython.double[:, :, ::1] = found
    radius: cython.double[::1] = radii
    trial: cython.double[:, ::1] = np.empty((3, 3))
    variances: cython.double[::1] = np.empty(3)
    work: cython.double[:, ::1] = np.empty((6, 3))
    row: cython.Py_ssize_t
    sixths: cython.Py_ssize_t
    j: cython.Py_ssize_t
    with cython.nogil:
        for row in range(index.shape[0]):
            k: cython.Py_ssize_t = index.shape[1]
            while index[row, k - 1] < 0:
                k -= 1
            size: cython.Py_ssize_t = k
            _axes(P, index[row, :k], square[row, :k], axes[row], variances, work)
            bend: cython.double = variances[0] / max(variances[1], TINY)
            bent[row] = bend
            for sixths in range(4, 1, -1):
                fewer: cython.Py_ssize_t = 1 + (k - 1) * sixths // 6
                if not shrinks or bend <= BENT or fewer < 8:
                    break
                _axes(P, index[row, :fewer], square[row, :fewer], trial, variances, work)
                if variances[0] < FLATTER * bend * variances[1]:
                    bend, size = variances[0] / variances[1], fewer
                    axes[row, :, :] = trial
            radius[row] = sqrt(square[row, size - 1])
            for j in range(size, k):
                index[row, j] = -1
    return found, radii, bends


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _weight(square: cython.const[cython.double][::1], j: cython.Py_ssize_t) -> cython.double:
    return max(1.0 - square[j] / max(square[square.shape[0] - 1], TINY), LEAST_WEIGHT)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _axes(
    P: cython.const[cython.double][:, ::1],
    index: cython.const[cython.int][::1],
    square: cython.const[cython.double][::1],
    axes: cython.double[:, ::1],
    variances: cython.double[::1],
    work: cython.double[:, ::1],
) -> cython.void:
    """The axes and variances of one point; `work` (6, 3) holds the covariance and the eigenvectors."""
    j: cython.Py_ssize_t
    # In units of the radius: squares of tiny lengths would underflow.
    scale: cython.double = 1.0 / max(sqrt(square[square.shape[0] - 1]), TINY)
    total: cython.double = 0.0
    # Sums in registers.
    sx = sy = sz = xx = xy = xz = yy = yz = zz = cython.cast(cython.double, 0.0)
    for j in range(index.shape[0]):
        weight: cython.double = _weight(square, j)
        dx: cython.double = (P[index[j], 0] - P[index[0], 0]) * scale
        dy: cython.double = (P[index[j], 1] - P[index[0], 1]) * scale
        dz: cython.double = (P[index[j], 2] - P[index[0], 2]) * scale
        total += weight
        sx, sy, sz = sx + weight * dx, sy + weight * dy, sz + weight * dz
        xx, xy, xz = xx + weight * dx * dx, xy + weight * dx * dy, xz + weight * dx * dz
        yy, yz, zz = yy + weight * dy * dy, yz + weight * dy * dz, zz + weight * dz * dz
    sx, sy, sz = sx / total, sy / total, sz / total
    work[0, 0], work[1, 1], work[2, 2] = xx / total - sx * sx, yy / total - sy * sy, zz / total - sz * sz
    work[0, 1] = work[1, 0] = xy / total - sx * sy
    work[0, 2] = work[2, 0] = xz / total - sx * sz
    work[1, 2] = work[2, 1] = yz / total - sy * sz
    principal(work, axes, variances)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def principal(work: cython.double[:, ::1], axes: cython.double[:, ::1], variances: cython.double[::1]) -> cython.void:
    """The axes of most, less and least variance, and the variances, ascending, of the covariance in rows 0 to 2."""
    x: cython.int
    y: cython.int
    for x in range(3):
        for y in range(3):
            work[3 + x, y] = 1.0 if x == y else 0.0
    for _sweep in range(30):
        if not (_rotate(work, 0, 1) | _rotate(work, 0, 2) | _rotate(work, 1, 2)):
            break
    lowest: cython.int = 0 if work[0, 0] <= work[1, 1] else 1
    highest: cython.int = 1 - lowest
    if work[2, 2] < work[lowest, lowest]:
        lowest = 2
    elif work[2, 2] > work[highest, highest]:
        highest = 2
    # Of three numbers that add up to 3, the one in the middle.
    middle: cython.int = 3 - lowest - highest
    variances[0], variances[1], variances[2] = work[lowest, lowest], work[middle, middle], work[highest, highest]
    for x in range(3):
        axes[0, x], axes[1, x], axes[2, x] = work[3 + highest, x], work[3 + middle, x], work[3 + lowest, x]


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _rotate(work: cython.double[:, ::1], p: cython.int, q: cython.int) -> cython.bint:
    """One rotation of Jacobi's eigenvalue algorithm; False if entry (p, q) is zero already.

    Rows 3 to 5 of `work` gather the eigenvectors.
    """
    entry: cython.double = work[p, q]
    if fabs(entry) <= 1e-17 * (fabs(work[p, p]) + fabs(work[q, q])):
        return False
    half: cython.double = 0.5 * (work[q, q] - work[p, p]) / entry
    tangent: cython.double = 1.0 / (fabs(half) + sqrt(half * half + 1.0))
    if half < 0.0:
        tangent = -tangent
    cosine: cython.double = 1.0 / sqrt(tangent * tangent + 1.0)
    sine: cython.double = tangent * cosine
    r: cython.int = 3 - p - q
    work[p, p] -= tangent * entry
    work[q, q] += tangent * entry
    work[p, q] = work[q, p] = 0.0
    along: cython.double = work[r, p]
    across: cython.double = work[r, q]
    work[r, p] = work[p, r] = cosine * along - sine * across
    work[r, q] = work[q, r] = sine * along + cosine * across
    x: cython.int
    for x in range(3):
        along, across = work[3 + p, x], work[3 + q, x]
        work[3 + p, x], work[3 + q, x] = cosine * along - sine * across, sine * along + cosine * across
    return True
