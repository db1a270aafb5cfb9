"""Planes and quadrics fitted to the neighbours of points. Points weigh 1 - (d / r)^2, at distance d of radius r."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.cloud.local_fits import DIAGONAL, LEAST_WEIGHT, TINY
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
    variances: cython.double[::1] = np.empty(3)
    work: cython.double[:, ::1] = np.empty((6, 3))
    local: cython.double[:, ::1] = np.empty((index.shape[1], 4))
    with cython.nogil:
        for row in range(index.shape[0]):
            _around(P, index[row], local)
            _covariance(local, work)
            _principal(work, axes[row], variances)
            bend[row] = variances[0] / max(variances[1], TINY)
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
    local: cython.double[:, ::1] = np.empty((k, 4))
    system: cython.double[:, ::1] = np.empty((6, 7))
    work: cython.double[:, ::1] = np.empty((6, 3))
    axes: cython.double[:, ::1] = np.empty((3, 3))
    variances: cython.double[::1] = np.empty(3)
    # Six coefficients take six degrees of freedom from the neighbours.
    freedom: cython.double = max(1.0 - 6.0 / (k - 1.0), 0.5)
    x: cython.int
    with cython.nogil:
        for row in range(b):
            radius: cython.double = _around(P, index[row], local)
            _covariance(local, work)
            _principal(work, axes, variances)
            _turn(local, axes)
            _normal_equations(local, system)
            total: cython.double = system[0, 0]
            for x in range(6):
                system[x, x] += DIAGONAL * k
            _eliminate(system)
            deviation[row] = sqrt(_weighted_squares(local, system) / (total * freedom))
            for x in range(3):
                moved[row, x] = P[index[row, 0], x] + radius * system[0, 6] * axes[2, x]
    return positions, deviations


@cython.cfunc
@cython.nogil
def _around(
    P: cython.const[cython.double][:, ::1], index: cython.const[cython.int][::1], local: cython.double[:, ::1]
) -> cython.double:
    """Put the neighbours, from the point and in units of the radius, and the weights into `local`; the radius."""
    farthest: cython.double = 0.0
    px: cython.double = P[index[0], 0]
    py: cython.double = P[index[0], 1]
    pz: cython.double = P[index[0], 2]
    for j in range(index.shape[0]):
        dx: cython.double = P[index[j], 0] - px
        dy: cython.double = P[index[j], 1] - py
        dz: cython.double = P[index[j], 2] - pz
        local[j, 0], local[j, 1], local[j, 2], local[j, 3] = dx, dy, dz, dx * dx + dy * dy + dz * dz
        farthest = max(farthest, local[j, 3])
    # In units of the radius: squares of tiny lengths would underflow.
    radius: cython.double = max(sqrt(farthest), TINY)
    scale: cython.double = 1.0 / radius
    per_square: cython.double = 1.0 / max(farthest, TINY)
    for j in range(index.shape[0]):
        local[j, 0], local[j, 1], local[j, 2] = local[j, 0] * scale, local[j, 1] * scale, local[j, 2] * scale
        local[j, 3] = max(1.0 - per_square * local[j, 3], LEAST_WEIGHT)
    return radius


@cython.cfunc
@cython.nogil
def _covariance(local: cython.double[:, ::1], work: cython.double[:, ::1]) -> cython.void:
    """The covariance in rows 0 to 2 of `work`."""
    cython.declare(total=cython.double, mx=cython.double, my=cython.double, mz=cython.double, xx=cython.double)
    cython.declare(xy=cython.double, xz=cython.double, yy=cython.double, yz=cython.double, zz=cython.double)
    total = mx = my = mz = xx = xy = xz = yy = yz = zz = 0.0
    for j in range(local.shape[0]):
        x: cython.double = local[j, 3] * local[j, 0]
        y: cython.double = local[j, 3] * local[j, 1]
        z: cython.double = local[j, 3] * local[j, 2]
        total, mx, my, mz = total + local[j, 3], mx + x, my + y, mz + z
        xx, xy, xz = xx + x * local[j, 0], xy + x * local[j, 1], xz + x * local[j, 2]
        yy, yz, zz = yy + y * local[j, 1], yz + y * local[j, 2], zz + z * local[j, 2]
    mx, my, mz = mx / total, my / total, mz / total
    work[0, 0], work[1, 1], work[2, 2] = xx / total - mx * mx, yy / total - my * my, zz / total - mz * mz
    work[0, 1] = work[1, 0] = xy / total - mx * my
    work[0, 2] = work[2, 0] = xz / total - mx * mz
    work[1, 2] = work[2, 1] = yz / total - my * mz


@cython.cfunc
@cython.nogil
def _turn(local: cython.double[:, ::1], axes: cython.double[:, ::1]) -> cython.void:
    """Turn columns 0 to 2 of `local` into the axes."""
    turn: cython.double[9]
    for a in range(9):
        turn[a] = axes[a // 3, a % 3]
    for j in range(local.shape[0]):
        x: cython.double = local[j, 0]
        y: cython.double = local[j, 1]
        z: cython.double = local[j, 2]
        for a in range(3):
            local[j, a] = x * turn[3 * a] + y * turn[3 * a + 1] + z * turn[3 * a + 2]


@cython.cfunc
@cython.nogil
def _normal_equations(local: cython.double[:, ::1], system: cython.double[:, ::1]) -> cython.void:
    """The upper half of the matrix (6, 6) of least squares for the terms 1, x, y, xx, xy, yy of z; z in column 6."""
    # Weighted sums of the products of x and y up to the fourth degree, and of those up to the second with z.
    term: cython.double[22]
    moment: cython.double[22]
    a: cython.int
    b: cython.int
    for a in range(22):
        term[a] = moment[a] = 0.0
    for j in range(local.shape[0]):
        x: cython.double = local[j, 0]
        y: cython.double = local[j, 1]
        term[0], term[1], term[2] = local[j, 3], local[j, 3] * x, local[j, 3] * y
        term[3], term[4], term[5] = term[1] * x, term[1] * y, term[2] * y
        term[6], term[7], term[8], term[9] = term[3] * x, term[3] * y, term[5] * x, term[5] * y
        term[10], term[11], term[12] = term[6] * x, term[6] * y, term[7] * y
        term[13], term[14] = term[8] * y, term[9] * y
        for a in range(6):
            term[15 + a] = term[a] * local[j, 2]
        for a in range(22):
            moment[a] += term[a]
    for a in range(6):
        for b in range(a, 6):
            # Terms of one degree follow one another, by the power of y.
            degree: cython.int = (a > 0) + (a > 2) + (b > 0) + (b > 2)
            power: cython.int = a + b - (a > 0) - 2 * (a > 2) - (b > 0) - 2 * (b > 2)
            system[a, b] = moment[degree * (degree + 1) // 2 + power]
        system[a, 6] = moment[15 + a]


@cython.cfunc
@cython.nogil
def _eliminate(system: cython.double[:, ::1]) -> cython.void:
    """Gaussian elimination; the matrix is symmetric and positive definite, so its upper half is enough."""
    a: cython.int
    c: cython.int
    for c in range(6):
        for a in range(c + 1, 6):
            factor: cython.double = system[c, a] / system[c, c]
            for b in range(a, 7):
                system[a, b] -= factor * system[c, b]
    for c in range(5, -1, -1):
        for b in range(c + 1, 6):
            system[c, 6] -= system[c, b] * system[b, 6]
        system[c, 6] /= system[c, c]


@cython.cfunc
@cython.nogil
def _weighted_squares(local: cython.double[:, ::1], system: cython.double[:, ::1]) -> cython.double:
    """The weighted sum of the squared deviations from the quadric whose coefficients are column 6 of `system`."""
    squares: cython.double = 0.0
    for j in range(local.shape[0]):
        x: cython.double = local[j, 0]
        y: cython.double = local[j, 1]
        off: cython.double = local[j, 2] - (system[0, 6] + system[1, 6] * x + system[2, 6] * y)
        off -= x * (system[3, 6] * x + system[4, 6] * y) + system[5, 6] * y * y
        squares += local[j, 3] * off * off
    return squares


@cython.cfunc
@cython.nogil
def _principal(work: cython.double[:, ::1], axes: cython.double[:, ::1], variances: cython.double[::1]) -> cython.void:
    """The axes of most, less and least variance, and the variances, ascending, of the covariance in rows 0 to 2."""
    x: cython.int
    diagonalize(cython.address(work[0, 0]))
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
