"""Planes and quadrics fitted to the neighbours of points. Points weigh 1 - (d / r)^2, at distance d of radius r."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.cloud.local_fits import DIAGONAL, LANES, LEAST_WEIGHT, TINY
from cython.cimports.libc.math import fabs, sqrt


def tangent_planes(P: cython.const[cython.double][:, ::1], index: cython.const[cython.int][:, ::1]):
    """Tangents and normals of points, by principal components of their neighbourhoods.

    Parameters
    ----------
    P : (n, 3) float64
        All points.
    index : (b, k) int32
        Neighbours of some points, by distance and each point first.

    Returns
    -------
    axes : (b, 3, 3) float64
        Directions of most, less and least variance in rows, orthonormal.
    radius : (b,) float64
        Distance of the farthest neighbour.
    bend : (b,) float64
        Ratio of the two smaller variances.
    """
    found, radii, bends = np.empty((index.shape[0], 3, 3)), np.empty(index.shape[0]), np.empty(index.shape[0])
    bend: cython.double[::1] = bends
    axes: cython.double[:, :, ::1] = found
    radius: cython.double[::1] = radii
    variances: cython.double[::1] = np.empty(3)
    work: cython.double[:, ::1] = np.empty((6, 3))
    local: cython.double[:, ::1] = _room_for(index.shape[1])
    with cython.nogil:
        for row in range(index.shape[0]):
            radius[row] = _principal_axes(P, index[row], local, work, axes[row], variances)
            bend[row] = variances[0] / max(variances[1], TINY)
    return found, radii, bends


def onto_quadrics(P: cython.const[cython.double][:, ::1], index: cython.const[cython.int][:, ::1]):
    """Points moved along the normals of fitted planes onto quadrics that are fitted to their neighbours.

    Parameters
    ----------
    P : (n, 3) float64
        All points.
    index : (b, k) int32
        Some of them, each followed by neighbours, in any order.

    Returns
    -------
    moved : (b, 3) float64
        The new positions.
    deviation : (b,) float64
        Standard deviation of the neighbours from the quadric, in radii of the neighbourhood.
    thickness : (b,) float64
        Ratio of the two smaller variances of the neighbours.
    """
    b: cython.Py_ssize_t = index.shape[0]
    k: cython.Py_ssize_t = index.shape[1]
    positions, deviations, ratios = np.empty((b, 3)), np.empty(b), np.empty(b)
    moved: cython.double[:, ::1] = positions
    deviation: cython.double[::1] = deviations
    thickness: cython.double[::1] = ratios
    local: cython.double[:, ::1] = _room_for(k)
    system: cython.double[:, ::1] = np.empty((6, 7))
    work: cython.double[:, ::1] = np.empty((6, 3))
    axes: cython.double[:, ::1] = np.empty((3, 3))
    variances: cython.double[::1] = np.empty(3)
    # Six coefficients take six degrees of freedom from the neighbours.
    freedom: cython.double = max(1.0 - 6.0 / (k - 1.0), 0.5)
    x: cython.int
    with cython.nogil:
        for row in range(b):
            radius: cython.double = _principal_axes(P, index[row], local, work, axes, variances)
            _turn(local, axes)
            _normal_equations(local, system)
            total: cython.double = system[0, 0]
            for x in range(6):
                system[x, x] += DIAGONAL * k
            _eliminate(system)
            deviation[row] = sqrt(_weighted_squares(local, system) / (total * freedom))
            thickness[row] = variances[0] / max(variances[1], TINY)
            for x in range(3):
                moved[row, x] = P[index[row, 0], x] + radius * system[0, 6] * axes[2, x]
    return positions, deviations, ratios


def _room_for(k: cython.Py_ssize_t):
    """Neighbours in columns. Sums are taken over LANES at a time; the last ones may be none, which weigh nothing."""
    return np.zeros((4, (k + LANES - 1) // LANES * LANES))


@cython.cfunc
@cython.nogil
def _principal_axes(
    P: cython.const[cython.double][:, ::1],
    index: cython.const[cython.int][::1],
    local: cython.double[:, ::1],
    work: cython.double[:, ::1],
    axes: cython.double[:, ::1],
    variances: cython.double[::1],
) -> cython.double:
    """Put the neighbours into `local`, and find their axes and variances; the radius."""
    radius: cython.double = _around(P, index, local)
    _covariance(local, work)
    _principal(work, axes, variances)
    return radius


@cython.cfunc
@cython.nogil
def _around(
    P: cython.const[cython.double][:, ::1], index: cython.const[cython.int][::1], local: cython.double[:, ::1]
) -> cython.double:
    """Put the neighbours, from the point and in units of the radius, and the weights into `local`; the radius."""
    k: cython.Py_ssize_t = index.shape[0]
    farthest: cython.double = 0.0
    px: cython.double = P[index[0], 0]
    py: cython.double = P[index[0], 1]
    pz: cython.double = P[index[0], 2]
    for j in range(k):
        dx: cython.double = P[index[j], 0] - px
        dy: cython.double = P[index[j], 1] - py
        dz: cython.double = P[index[j], 2] - pz
        local[0, j], local[1, j], local[2, j] = dx, dy, dz
        local[3, j] = dx * dx + dy * dy + dz * dz
        farthest = max(farthest, local[3, j])
    # In units of the radius: squares of tiny lengths would underflow.
    radius: cython.double = max(sqrt(farthest), TINY)
    scale: cython.double = 1.0 / radius
    per_square: cython.double = 1.0 / max(farthest, TINY)
    for j in range(k):
        local[0, j], local[1, j], local[2, j] = scale * local[0, j], scale * local[1, j], scale * local[2, j]
        local[3, j] = max(1.0 - per_square * local[3, j], LEAST_WEIGHT)
    for j in range(k, local.shape[1]):
        local[3, j] = 0.0
    return radius


@cython.cfunc
@cython.nogil
def _covariance(local: cython.double[:, ::1], work: cython.double[:, ::1]) -> cython.void:
    """The covariance in rows 0 to 2 of `work`."""
    part: cython.double[40]
    sums: cython.double[10]
    c: cython.Py_ssize_t
    lane: cython.Py_ssize_t
    for c in range(10 * LANES):
        part[c] = 0.0
    for block in range(local.shape[1] // LANES):
        for lane in range(LANES):
            j: cython.Py_ssize_t = LANES * block + lane
            wx: cython.double = local[3, j] * local[0, j]
            wy: cython.double = local[3, j] * local[1, j]
            wz: cython.double = local[3, j] * local[2, j]
            part[lane] += local[3, j]
            part[LANES + lane] += wx
            part[2 * LANES + lane] += wy
            part[3 * LANES + lane] += wz
            part[4 * LANES + lane] += wx * local[0, j]
            part[5 * LANES + lane] += wx * local[1, j]
            part[6 * LANES + lane] += wx * local[2, j]
            part[7 * LANES + lane] += wy * local[1, j]
            part[8 * LANES + lane] += wy * local[2, j]
            part[9 * LANES + lane] += wz * local[2, j]
    for c in range(10):
        sums[c] = 0.0
        for lane in range(LANES):
            sums[c] += part[c * LANES + lane]
    for c in range(1, 10):
        sums[c] /= sums[0]
    work[0, 0], work[1, 1] = sums[4] - sums[1] * sums[1], sums[7] - sums[2] * sums[2]
    work[2, 2] = sums[9] - sums[3] * sums[3]
    work[0, 1] = work[1, 0] = sums[5] - sums[1] * sums[2]
    work[0, 2] = work[2, 0] = sums[6] - sums[1] * sums[3]
    work[1, 2] = work[2, 1] = sums[8] - sums[2] * sums[3]


@cython.cfunc
@cython.nogil
def _turn(local: cython.double[:, ::1], axes: cython.double[:, ::1]) -> cython.void:
    """Turn rows 0 to 2 of `local` into the axes."""
    for j in range(local.shape[1]):
        x: cython.double = local[0, j]
        y: cython.double = local[1, j]
        z: cython.double = local[2, j]
        local[0, j] = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
        local[1, j] = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
        local[2, j] = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]


@cython.cfunc
@cython.nogil
def _normal_equations(local: cython.double[:, ::1], system: cython.double[:, ::1]) -> cython.void:
    """The upper half of the matrix (6, 6) of least squares for the terms 1, x, y, xx, xy, yy of z; z in column 6."""
    moment: cython.double[84]
    sums: cython.double[21]
    lane: cython.Py_ssize_t
    c: cython.Py_ssize_t
    for c in range(21 * LANES):
        moment[c] = 0.0
    for block in range(local.shape[1] // LANES):
        j: cython.Py_ssize_t = LANES * block
        for lane in range(LANES):
            x: cython.double = local[0, j + lane]
            y: cython.double = local[1, j + lane]
            z: cython.double = local[2, j + lane]
            w: cython.double = local[3, j + lane]
            wx: cython.double = w * x
            wy: cython.double = w * y
            wxx: cython.double = wx * x
            wxy: cython.double = wx * y
            wyy: cython.double = wy * y
            moment[lane] += w
            moment[LANES + lane] += wx
            moment[2 * LANES + lane] += wy
            moment[3 * LANES + lane] += wxx
            moment[4 * LANES + lane] += wxy
            moment[5 * LANES + lane] += wyy
            moment[6 * LANES + lane] += wxx * x
            moment[7 * LANES + lane] += wxx * y
            moment[8 * LANES + lane] += wyy * x
            moment[9 * LANES + lane] += wyy * y
            moment[10 * LANES + lane] += wxx * x * x
            moment[11 * LANES + lane] += wxx * x * y
            moment[12 * LANES + lane] += wxx * y * y
            moment[13 * LANES + lane] += wyy * x * y
            moment[14 * LANES + lane] += wyy * y * y
            moment[15 * LANES + lane] += w * z
            moment[16 * LANES + lane] += wx * z
            moment[17 * LANES + lane] += wy * z
            moment[18 * LANES + lane] += wxx * z
            moment[19 * LANES + lane] += wxy * z
            moment[20 * LANES + lane] += wyy * z
    for c in range(21):
        sums[c] = 0.0
        for lane in range(LANES):
            sums[c] += moment[c * LANES + lane]
    # Row 0 has the moments of order 0 to 2, row 1 those of x, xx, xy, xxx and so on.
    for c in range(6):
        system[0, c], system[c, 6] = sums[c], sums[15 + c]
    system[1, 1], system[1, 2], system[1, 3], system[1, 4], system[1, 5] = sums[3], sums[4], sums[6], sums[7], sums[8]
    system[2, 2], system[2, 3], system[2, 4], system[2, 5] = sums[5], sums[7], sums[8], sums[9]
    system[3, 3], system[3, 4], system[3, 5] = sums[10], sums[11], sums[12]
    system[4, 4], system[4, 5], system[5, 5] = sums[12], sums[13], sums[14]


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
    squares: cython.double[4]
    squares[0] = squares[1] = squares[2] = squares[3] = 0.0
    lane: cython.Py_ssize_t
    for block in range(local.shape[1] // LANES):
        j: cython.Py_ssize_t = LANES * block
        for lane in range(LANES):
            x: cython.double = local[0, j + lane]
            y: cython.double = local[1, j + lane]
            off: cython.double = local[2, j + lane] - system[0, 6] - system[1, 6] * x - system[2, 6] * y
            off -= system[3, 6] * x * x + system[4, 6] * x * y + system[5, 6] * y * y
            squares[lane] += local[3, j + lane] * off * off
    return squares[0] + squares[1] + squares[2] + squares[3]


@cython.cfunc
@cython.nogil
def _principal(work: cython.double[:, ::1], axes: cython.double[:, ::1], variances: cython.double[::1]) -> cython.void:
    """The axes of most, less and least variance, and the variances, ascending, of the covariance in rows 0 to 2."""
    x: cython.int
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
