"""Balls that touch a point of a cloud and hold none of the neighbours: they tell the sheets of a surface apart."""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt


def roomiest_normals(
    P: cython.const[cython.double][:, ::1],
    index: cython.const[cython.int][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    directions: cython.const[cython.float][:, ::1],
):
    """Normals of points, on the side with most room for balls, and the radii of balls on both sides.

    Neighbours on another sheet bend the plane that fits best, but between them and the point there is little room.
    Balls are tried along `directions` and opposite to them; those on the side of the largest are averaged, with weights
    r^4 for radius r.

    Each row of `index` (b, k) int32 is one of the points P (n, 3), then its neighbours by distance; `axes` (b, 3, 3)
    are orthonormal rows for each. The columns of `directions` (3, m) are unit vectors in a half space, by their
    components along these axes; m is a multiple of 4.

    Returns unit normals (b, 3), and the radii (b, 2) of the largest empty balls that touch the point along the normal
    and opposite to it, no larger than the neighbourhood.
    """
    normals, radii = np.empty((index.shape[0], 3)), np.empty((index.shape[0], 2))
    normal: cython.double[:, ::1] = normals
    radius: cython.double[:, ::1] = radii
    inverted: cython.float[:, ::1] = np.empty((index.shape[1], 3), np.float32)
    shares: cython.float[:, ::1] = np.empty((2, directions.shape[1]), np.float32)
    local: cython.double[::1] = np.empty(3)
    with cython.nogil:
        for row in range(index.shape[0]):
            reach: cython.double = _invert(P, index[row], axes[row], inverted)
            _shares(inverted, directions, shares)
            _average(directions, shares, local)
            most: cython.double = 1.0
            least: cython.double = -1.0
            for j in range(index.shape[1]):
                along: cython.double = inverted[j, 0] * local[0] + inverted[j, 1] * local[1] + inverted[j, 2] * local[2]
                most, least = max(most, along), min(least, along)
            radius[row, 0], radius[row, 1] = reach * (1.0 / most), reach * (-1.0 / least)
            for x in range(3):
                normal[row, x] = local[0] * axes[row, 0, x] + local[1] * axes[row, 1, x] + local[2] * axes[row, 2, x]
    return normals, radii


def _invert(P, index, axes, inverted):
    """The neighbours d as 2 R d / |d|^2 (R is returned): the ball of radius R / max(that . u) along u is empty."""
    way: cython.double[3]
    last: cython.int = index[index.shape[0] - 1]
    square: cython.double = 0.0
    for x in range(3):
        square += (P[last, x] - P[index[0], x]) * (P[last, x] - P[index[0], x])
    reach: cython.double = max(sqrt(square), TINY)
    for j in range(index.shape[0]):
        square = 0.0
        for x in range(3):
            way[x] = (P[index[j], x] - P[index[0], x]) / reach
            square += way[x] * way[x]
        scale: cython.double = 2.0 / max(square, TINY)
        for x in range(3):
            inverted[j, x] = scale * (way[0] * axes[x, 0] + way[1] * axes[x, 1] + way[2] * axes[x, 2])
    return reach


def _shares(inverted, directions, share):
    """Radii of the largest empty balls along all directions and opposite to them, in shares of the reach, at most 1."""
    x: cython.float[LANES]
    y: cython.float[LANES]
    z: cython.float[LANES]
    most: cython.float[LANES]
    least: cython.float[LANES]
    for block in range(share.shape[1] // LANES):
        begin: cython.Py_ssize_t = LANES * block
        for lane in range(LANES):
            x[lane], y[lane] = directions[0, begin + lane], directions[1, begin + lane]
            z[lane] = directions[2, begin + lane]
            most[lane], least[lane] = 1.0, -1.0
        for j in range(inverted.shape[0]):
            to_x: cython.float = inverted[j, 0]
            to_y: cython.float = inverted[j, 1]
            to_z: cython.float = inverted[j, 2]
            for lane in range(LANES):
                along: cython.float = to_x * x[lane] + to_y * y[lane] + to_z * z[lane]
                most[lane] = along if along > most[lane] else most[lane]
                least[lane] = along if along < least[lane] else least[lane]
        for lane in range(LANES):
            share[0, begin + lane], share[1, begin + lane] = 1.0 / most[lane], -1.0 / least[lane]


def _average(directions, share, normal):
    """The mean direction on the side of the largest ball; `share` takes the fourth powers."""
    mean: cython.float[12]
    best: cython.Py_ssize_t = 0
    of_best: cython.Py_ssize_t = 0
    for side in range(2):
        for a in range(share.shape[1]):
            share[side, a] = share[side, a] * share[side, a] * share[side, a] * share[side, a]
            if share[side, a] > share[of_best, best]:
                of_best, best = side, a
    for x in range(3):
        normal[x] = directions[x, best] if of_best == 0 else -directions[x, best]
    for _ in range(ROUNDS):
        nx: cython.float = cython.cast(cython.float, normal[0])
        ny: cython.float = cython.cast(cython.float, normal[1])
        nz: cython.float = cython.cast(cython.float, normal[2])
        for a in range(3 * LANES):
            mean[a] = 0.0
        for block in range(share.shape[1] // LANES):
            for lane in range(LANES):
                at: cython.Py_ssize_t = LANES * block + lane
                weight: cython.float = directions[0, at] * nx + directions[1, at] * ny + directions[2, at] * nz
                ahead: cython.float = share[0, at]
                behind: cython.float = share[1, at]
                weight *= ahead if weight > 0.0 else behind
                mean[lane] += weight * directions[0, at]
                mean[LANES + lane] += weight * directions[1, at]
                mean[2 * LANES + lane] += weight * directions[2, at]
        square: cython.double = 0.0
        for x in range(3):
            normal[x] = 0.0
            for lane in range(LANES):
                normal[x] += mean[LANES * x + lane]
            square += normal[x] * normal[x]
        for x in range(3):
            normal[x] /= sqrt(square)


def on_one_side(
    P: cython.const[cython.double][:, ::1],
    index: cython.const[cython.int][:, ::1],
    number: cython.const[cython.int][::1],
    normals: cython.const[cython.double][:, ::1],
    radii: cython.const[cython.double][:, ::1],
):
    """The neighbours of points that see the same side of the same sheet: all of them, if these are fewer than three.

    On one sheet, the empty balls of two neighbours meet at more than a right angle on one side of it at least, since
    what separates balls is the surface. On the two sides of a thin part or of a narrow gap only those between the
    sheets do, which are opposite to each other as the normals have them.

    Each row of `index` (c, k) int32 is one of the points P (n, 3), then its neighbours by distance. `number` (n,) int32
    is the row of each point in `normals` (b, 3), of either sign, and `radii` (b, 2), see `roomiest_normals`; -1 for
    a point without a row, which is taken to be on the same sheet as all others.

    Returns `index` with the neighbours that stay, in the same order, and -1 after the last; and the distance (c,) of
    the last.
    """
    found, distances = np.full((index.shape[0], index.shape[1]), -1, np.int32), np.empty(index.shape[0])
    kept: cython.int[:, ::1] = found
    radius: cython.double[::1] = distances
    centre: cython.double[:, :, ::1] = np.empty((normals.shape[0], 2, 3))
    with cython.nogil:
        for i in range(number.shape[0]):
            if number[i] >= 0:
                for x in range(3):
                    centre[number[i], 0, x] = P[i, x] + radii[number[i], 0] * normals[number[i], x]
                    centre[number[i], 1, x] = P[i, x] - radii[number[i], 1] * normals[number[i], x]
        for row in range(index.shape[0]):
            at: cython.int = index[row, 0]
            size: cython.Py_ssize_t = 0
            for j in range(index.shape[1]):
                other: cython.int = index[row, j]
                if j == 0 or number[other] < 0 or _sees_the_same(number[at], number[other], normals, radii, centre):
                    kept[row, size] = other
                    size += 1
            if size < 4:
                kept[row, :] = index[row, :]
                size = index.shape[1]
            square: cython.double = 0.0
            for x in range(3):
                square += (P[kept[row, size - 1], x] - P[at, x]) * (P[kept[row, size - 1], x] - P[at, x])
            radius[row] = sqrt(square)
    return found, distances


def _sees_the_same(i, j, normals, radii, centre):
    alike: cython.double = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
    for side in range(2):
        # The side of j that is on the side of i towards which the normal of i points, or the other.
        other: cython.Py_ssize_t = side if alike >= 0.0 else 1 - side
        x: cython.double = centre[j, other, 0] - centre[i, side, 0]
        y: cython.double = centre[j, other, 1] - centre[i, side, 1]
        z: cython.double = centre[j, other, 2] - centre[i, side, 2]
        # The angle between two spheres, by the law of cosines.
        if x * x + y * y + z * z < radii[i, side] * radii[i, side] + radii[j, other] * radii[j, other]:
            return True
    return False
