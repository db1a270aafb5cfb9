"""Planes and quadrics fitted to the neighbours of points. Points weigh 1 - (d / r)^2, at distance d of radius r."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.local_planes import BENT, DIAGONAL, FLATTER, LANES, LEAST_WEIGHT, TINY
from cython.cimports.libc.math import fabs, sqrt

__all__ = ["farthest_last", "onto_quadrics", "principal_axes", "tangent_planes"]


def principal_axes(
    P: cython.const[cython.double][:, ::1],
    index: cython.const[cython.int][:, ::1],
    square: cython.const[cython.double][:, ::1],
):
    """Tangents and normals of points, by principal components.

    Parameters
    ----------
    P : (n, 3) float64
        All points.
    index, square : (b, k) int32, (b, k) float64
        Neighbours of some points, by distance and each point first, and the squared distances.

    Returns
    -------
    axes : (b, 3, 3) float64
        Directions of most, less and least variance in rows, orthonormal.
    variances : (b, 3) float64
        In squares of the radius of the neighbourhood, ascending.
    """
    found, spread = np.empty((index.shape[0], 3, 3)), np.empty((index.shape[0], 3))
    axes: cython.double[:, :, ::1] = found
    variances: cython.double[:, ::1] = spread
    work: cython.double[:, ::1] = np.empty((6, 3))
    row: cython.Py_ssize_t
    with cython.nogil:
        for row in range(index.shape[0]):
            _axes(P, index[row], square[row], axes[row], variances[row], work)
    return found, spread


def tangent_planes(
    P: cython.const[cython.double][:, ::1],
    index: cython.int[:, ::1],
    square: cython.const[cython.double][:, ::1],
):
    """The principal axes of neighbourhoods, which are made smaller where they are not flat.

    Where the points vary much along the normal, two thirds, a half and a third of the neighbours are tried, and those
    taken that are flatter.

    Parameters
    ----------
    P, index, square
        As for `principal_axes`; neighbours that are left out become -1 in `index`.

    Returns
    -------
    axes : (b, 3, 3) float64
        As of `principal_axes`.
    radius : (b,) float64
        Distance of the farthest neighbour that is left.
    bend : (b,) float64
        Ratio of the two smaller variances of all neighbours.
    """
    k: cython.Py_ssize_t = index.shape[1]
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
            size: cython.Py_ssize_t = k
            _axes(P, index[row], square[row], axes[row], variances, work)
            bend: cython.double = variances[0] / max(variances[1], TINY)
            bent[row] = bend
            for sixths in range(4, 1, -1):
                fewer: cython.Py_ssize_t = 1 + (k - 1) * sixths // 6
                if bend <= BENT or fewer < 8:
                    break
                _axes(P, index[row, :fewer], square[row, :fewer], trial, variances, work)
                if variances[0] < FLATTER * bend * variances[1]:
                    bend, size = variances[0] / variances[1], fewer
                    axes[row, :, :] = trial
            radius[row] = sqrt(square[row, size - 1])
            for j in range(size, k):
                index[row, j] = -1
    return found, radii, bends


def farthest_last(P: cython.const[cython.double][:, ::1], index: cython.int[:, ::1]):
    """Bring the neighbour of points that is farthest to the end of each row of `index` (b, k), k at least 2.

    The others keep their places, but for the one that was last; the point itself comes first. Returns the squared
    distances (b, k) of the neighbours from it.
    """
    k: cython.Py_ssize_t = index.shape[1]
    squares = np.empty((index.shape[0], k))
    square: cython.double[:, ::1] = squares
    row: cython.Py_ssize_t
    j: cython.Py_ssize_t
    with cython.nogil:
        for row in range(index.shape[0]):
            i: cython.Py_ssize_t = index[row, 0]
            farthest: cython.Py_ssize_t = k - 1
            for j in range(k):
                dx: cython.double = P[index[row, j], 0] - P[i, 0]
                dy: cython.double = P[index[row, j], 1] - P[i, 1]
                dz: cython.double = P[index[row, j], 2] - P[i, 2]
                square[row, j] = dx * dx + dy * dy + dz * dz
            for j in range(1, k - 1):
                if square[row, j] > square[row, farthest]:
                    farthest = j
            index[row, farthest], index[row, k - 1] = index[row, k - 1], index[row, farthest]
            square[row, farthest], square[row, k - 1] = square[row, k - 1], square[row, farthest]
    return squares


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
    x: cython.int
    y: cython.int
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


def onto_quadrics(
    P: cython.const[cython.double][:, ::1],
    index: cython.const[cython.int][:, ::1],
    square: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
):
    """Points moved along their normals onto quadrics that are fitted to their neighbours.

    Parameters
    ----------
    P, index, square
        As for `principal_axes`.
    axes : (b, 3, 3) float64
        Tangents and normals.

    Returns
    -------
    moved : (b, 3) float64
        The new positions.
    deviation : (b,) float64
        Standard deviation of the neighbours from the quadric, in radii of the neighbourhood.
    """
    positions, deviations = np.empty((index.shape[0], 3)), np.empty(index.shape[0])
    moved: cython.double[:, ::1] = positions
    deviation: cython.double[::1] = deviations
    # Sums are taken over LANES neighbours at a time; the last of these may be none, which weigh nothing.
    local: cython.double[:, ::1] = np.zeros((4, (index.shape[1] + LANES - 1) // LANES * LANES))
    system: cython.double[:, ::1] = np.empty((6, 7))
    row: cython.Py_ssize_t
    x: cython.int
    with cython.nogil:
        for row in range(index.shape[0]):
            total: cython.double = _into_frame(P, index[row], square[row], axes[row], local)
            _normal_equations(local, system)
            for x in range(6):
                system[x, x] += DIAGONAL * index.shape[1]
            _eliminate(system)
            # Six coefficients take six degrees of freedom from the neighbours.
            freedom: cython.double = max(1.0 - 6.0 / (index.shape[1] - 1.0), 0.5)
            deviation[row] = sqrt(_weighted_squares(local, system) / (total * freedom))
            height: cython.double = system[0, 6] * sqrt(square[row, square.shape[1] - 1])
            for x in range(3):
                moved[row, x] = P[index[row, 0], x] + height * axes[row, 2, x]
    return positions, deviations


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _into_frame(
    P: cython.const[cython.double][:, ::1],
    index: cython.const[cython.int][::1],
    square: cython.const[cython.double][::1],
    axes: cython.const[cython.double][:, ::1],
    local: cython.double[:, ::1],
) -> cython.double:
    """Put x, y, z along the axes, in units of the radius, and the weights into the rows of `local`; sum of weights."""
    scale: cython.double = 1.0 / max(sqrt(square[square.shape[0] - 1]), TINY)
    total: cython.double = 0.0
    j: cython.Py_ssize_t
    x: cython.int
    for j in range(index.shape[0]):
        dx: cython.double = (P[index[j], 0] - P[index[0], 0]) * scale
        dy: cython.double = (P[index[j], 1] - P[index[0], 1]) * scale
        dz: cython.double = (P[index[j], 2] - P[index[0], 2]) * scale
        for x in range(3):
            local[x, j] = dx * axes[x, 0] + dy * axes[x, 1] + dz * axes[x, 2]
        local[3, j] = _weight(square, j)
        total += local[3, j]
    return total


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _normal_equations(local: cython.double[:, ::1], system: cython.double[:, ::1]) -> cython.void:
    """The upper half of the matrix (6, 6) of least squares for the terms 1, x, y, xx, xy, yy of z; z in column 6."""
    moment: cython.double[84]
    sums: cython.double[21]
    j: cython.Py_ssize_t
    block: cython.Py_ssize_t
    lane: cython.Py_ssize_t
    c: cython.Py_ssize_t
    for c in range(21 * LANES):
        moment[c] = 0.0
    for block in range(local.shape[1] // LANES):
        j = LANES * block
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
@cython.exceptval(check=False)
def _eliminate(system: cython.double[:, ::1]) -> cython.void:
    """Gaussian elimination; the matrix is symmetric and positive definite, so its upper half is enough."""
    a: cython.int
    b: cython.int
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
@cython.exceptval(check=False)
def _weighted_squares(local: cython.double[:, ::1], system: cython.double[:, ::1]) -> cython.double:
    """The weighted sum of the squared deviations from the quadric whose coefficients are column 6 of `system`."""
    squares: cython.double[4]
    squares[0] = squares[1] = squares[2] = squares[3] = 0.0
    j: cython.Py_ssize_t
    block: cython.Py_ssize_t
    lane: cython.Py_ssize_t
    for block in range(local.shape[1] // LANES):
        j = LANES * block
        for lane in range(LANES):
            x: cython.double = local[0, j + lane]
            y: cython.double = local[1, j + lane]
            off: cython.double = local[2, j + lane] - system[0, 6] - system[1, 6] * x - system[2, 6] * y
            off -= system[3, 6] * x * x + system[4, 6] * x * y + system[5, 6] * y * y
            squares[lane] += local[3, j + lane] * off * off
    return squares[0] + squares[1] + squares[2] + squares[3]
