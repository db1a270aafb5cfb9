"""Kernels of velocities: inverse roots of tensors, fits around vertices, lengths where velocity is linear."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.rotation import diagonalize
from cython.cimports.heat_igl.kernels.sweep.facets import (
    cross,
    entry,
    gradient,
    invert,
    mean_velocity,
    pair,
    simplex_of,
    squares_of,
)
from cython.cimports.libc.float import DBL_MIN
from cython.cimports.libc.math import INFINITY, fabs, sqrt

# The variance of velocities, and differences between those at one vertex, as a share of them, that are rounding.
_ROUNDING = cython.declare(cython.double, 1e-9)
_SAME = cython.declare(cython.double, 1e-14)

# How often each entry on and above the diagonal occurs in a symmetric matrix.
_OFTEN = cython.declare(cython.double[6], [1.0, 2.0, 2.0, 1.0, 2.0, 1.0])


def lengths_in_velocity(
    corners: cython.const[cython.int][:, ::1],
    V: cython.const[cython.double][:, ::1],
    velocity: cython.const[cython.double][:, ::1],
    rows: cython.const[cython.int][:, ::1],
):
    """Of simplices with a velocity at each corner, a row (m, p + 1) of `velocity` (k, 6), linear in between.

    Returns
    -------
    inverse, mean, widest, slack, growth
        As `SimplexUpdate` takes them, with `mean` in the metric of the centre.
    variation : (m,) float64
        How far the lengths of edges of triangles differ between the metrics of the corners, mean square of the share.
    """
    size: cython.int = corners.shape[1]
    per: cython.double = 1.0 / size
    n_pairs: cython.int = size * (size - 1) // 2
    m = corners.shape[0]
    found = np.empty_like(velocity), np.empty((m, n_pairs)), np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    inverse: cython.double[:, ::1] = found[0]
    mean: cython.double[:, ::1] = found[1]
    widest: cython.double[::1] = found[2]
    slack: cython.double[::1] = found[3]
    growth: cython.double[::1] = found[4]
    variation: cython.double[::1] = found[5]
    squares: cython.double[24]
    here: cython.double[6]
    e: cython.double[18]
    W: cython.double[6]
    I: cython.double[6]
    E: cython.double[12]
    rise: cython.double[4]
    speed: cython.double[4]
    at: cython.pointer[cython.const[cython.double]][4]
    with cython.nogil:
        for i in range(velocity.shape[0]):
            invert(cython.address(velocity[i, 0]), cython.address(inverse[i, 0]))
        for s in range(m):
            fastest: cython.double = 0.0
            longest: cython.double = 0.0
            for k in range(6):
                W[k] = 0.0
            for i in range(size):
                at[i] = cython.address(velocity[rows[s, i], 0])
                for x in range(3):
                    for j in range(i):
                        e[3 * pair(i, j) + x] = V[corners[s, j], x] - V[corners[s, i], x]
                    E[3 * i + x] = V[corners[s, 0], x] - V[corners[s, i], x]
                for k in range(6):
                    W[k] += per * at[i][k]
                # Divisions take longer than the rest.
                speed[i] = mean_velocity(at[i])
                rise[i] = speed[0] - speed[i]
                fastest = max(fastest, speed[i])
            per_speed: cython.double = 1.0 / mean_velocity(W)
            invert(W, I)
            for i in range(size):
                squares_of(cython.address(inverse[rows[s, i], 0]), e, n_pairs, squares + 6 * i)
            squares_of(I, e, n_pairs, cython.address(mean[s, 0]))
            gradient(E + 3, rise + 1, size - 1, here)
            squares_of(W, here, 1, rise)
            steep: cython.double = sqrt(rise[0]) * per_speed
            # How much faster it is in the middle between the two fastest corners than in the mean, to first order.
            faster: cython.double = 1.0
            for k in range(n_pairs):
                # In the metrics of the corners, shortest first.
                one: cython.double = INFINITY
                next_one: cython.double = INFINITY
                two: cython.double = 0.0
                for i in range(size):
                    next_one = min(next_one, max(one, squares[6 * i + k]))
                    one, two = min(one, squares[6 * i + k]), max(two, squares[6 * i + k])
                faster = max(faster, 0.5 * (mean[s, k] / one + mean[s, k] / next_one))
                longest, widest[s] = max(longest, mean[s, k]), max(widest[s], two)
                if size == 3:
                    variation[s] += (one + two - 2.0 * sqrt(one * two)) / (3.0 * mean[s, k])
            slack[s] = 1.0 / sqrt(faster)
            # In a flat simplex, the arc over a long edge would leave it, for velocities far above those at the corners.
            fastest *= per_speed
            growth[s] = min(steep, 4.0 * sqrt(max(fastest * fastest - 1.0, 0.0) / longest))
    return found


def velocities_at_corners(
    corners: cython.const[cython.int][:, ::1],
    at_vertex: cython.const[cython.double][:, ::1],
    own: cython.const[cython.double][:, ::1],
    group: cython.const[cython.int][::1],
    share: cython.const[cython.double][::1],
    faces: cython.const[cython.int][:, ::1],
    V: cython.const[cython.double][:, ::1],
    is_metric: cython.bint,
):
    """Velocities (r, 6) of simplices at their corners, equal ones at a vertex once, and the row (m, p + 1) of each.

    They are the least `share` (n,) at the corners of what is known `at_vertex` (n, 6), and else that of the `group`
    (m,) of the simplex, its `own` (k, 6): both are velocities, or metrics. Of triangles, whose `faces` (m, 3) on
    vertices at V (n, 3) are given, else (0, 3), they are those in the plane, and across it the mean: trust in slopes
    asks it. Third are the smallest and largest eigenvalue (n, 2) there, if they were asked for.
    """
    # The first array has room for all corners; if most of it stays empty, only the rows that are written to are kept.
    found, sizes = np.empty((corners.size, 6)), np.tile([np.inf, 0.0], (len(at_vertex), 1))
    number, last = np.empty_like(corners), np.full(len(at_vertex), -1, np.int32)
    velocity: cython.double[:, ::1] = found
    extremes: cython.double[:, ::1] = sizes
    row: cython.int[:, ::1] = number
    row_at: cython.int[::1] = last
    count: cython.int = 0
    size: cython.int = corners.shape[1]
    in_plane: cython.bint = faces.shape[0] > 0
    # Of four simplices at once.
    base: cython.double[36]
    work: cython.double[288]
    with cython.nogil:
        for begin in range(0, corners.shape[0], 4):
            n: cython.int = cython.cast(cython.int, min(4, corners.shape[0] - begin))
            block = cython.address(velocity[count, 0])
            for i in range(n):
                s: cython.Py_ssize_t = begin + i
                axis = base + 9 * i
                if in_plane:
                    _lay_axes(V, faces, s, axis)
                least: cython.double = 1.0
                for c in range(size):
                    least = min(least, share[corners[s, c]])
                for c in range(size):
                    W = block + 6 * (size * i + c)
                    for k in range(6):
                        W[k] = least * at_vertex[corners[s, c], k]
                    for k in range(6 if least < 1.0 else 0):
                        W[k] += (1.0 - least) * own[group[s], k]
                    if in_plane:
                        _turn(W, axis, 1, 3)
                        W[2] = W[4] = W[5] = 0.0
                    for k in range(9 if is_metric else 0):
                        work[18 * (size * i + c) + k] = W[entry(k // 3, k % 3)]
            if is_metric:
                diagonalize(work, n * size)
            for i in range(n):
                s = begin + i
                for c in range(size):
                    v: cython.int = corners[s, c]
                    W = block + 6 * (size * i + c)
                    if is_metric:
                        of = work + 18 * (size * i + c)
                        _root(of, 2 if in_plane else 3, W, cython.address(extremes[v, 0]))
                    if in_plane:
                        W[5] = 0.5 * (W[0] + W[3])
                        _turn(W, base + 9 * i, 3, 1)
                    width: cython.double = 0.0
                    change: cython.double = INFINITY if row_at[v] < 0 else 0.0
                    for k in range(6 if row_at[v] >= 0 else 0):
                        width = max(width, fabs(velocity[row_at[v], k]))
                        change = max(change, fabs(W[k] - velocity[row_at[v], k]))
                    if change > _SAME * width:
                        for k in range(6):
                            velocity[count, k] = W[k]
                        row_at[v] = count
                        count += 1
                    row[s, c] = row_at[v]
    return found[:count] if 2 * count > len(found) else found[:count].copy(), number, sizes


@cython.cfunc
@cython.inline
@cython.nogil
def _lay_axes(
    V: cython.const[cython.double][:, ::1],
    F: cython.const[cython.int][:, ::1],
    s: cython.Py_ssize_t,
    axis: cython.p_double,
) -> cython.void:
    """The axes of triangle s: from corner 0 to corner 1, in its plane towards corner 2, and across; 0 without area."""
    for i in range(2):
        to = axis + 3 * i
        for k in range(3):
            to[k] = V[F[s, 1 + i], k] - V[F[s, 0], k]
        along: cython.double = axis[0] * to[0] + axis[1] * to[1] + axis[2] * to[2] if i == 1 else 0.0
        for k in range(3):
            to[k] -= along * axis[k]
        size: cython.double = max(sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]), DBL_MIN)
        for k in range(3):
            to[k] /= size
    cross(axis, axis + 3, axis + 6)


@cython.cfunc
@cython.inline
@cython.nogil
def _root(work: cython.p_double, p: cython.int, W: cython.p_double, extremes: cython.p_double) -> cython.void:
    """The inverse root, with absolute eigenvalues, of what `diagonalize` did; it has p eigenvalues."""
    W[1] = W[2] = W[4] = 0.0
    for k in range(3):
        W[entry(k, k)] = 1.0 / sqrt(max(fabs(work[4 * k]), DBL_MIN))
        if k < p:
            extremes[0], extremes[1] = min(extremes[0], work[4 * k]), max(extremes[1], work[4 * k])
    _turn(W, work + 9, 3, 1)


@cython.cfunc
@cython.inline
@cython.nogil
def _turn(W: cython.p_double, U: cython.p_double, a: cython.int, b: cython.int) -> cython.void:
    """Replace a symmetric matrix W by U^T W U, with entry (i, j) of U at a i + b j."""
    V: cython.double[9]
    for k in range(9):
        i: cython.int = k // 3
        x: cython.int = b * (k % 3)
        V[k] = W[entry(i, 0)] * U[x] + W[entry(i, 1)] * U[a + x] + W[entry(i, 2)] * U[2 * a + x]
    for i in range(3):
        for x in range(i, 3):
            W[entry(i, x)] = U[b * i] * V[x] + U[a + b * i] * V[3 + x] + U[2 * a + b * i] * V[6 + x]


def _add_misses(corners, W, group, first, share, result, at):
    """Add to the velocities `result` (n, 6) at vertices by how much their mean over each simplex misses the given one.

    A vertex gets the mean over its simplices, each times the least `share` at its corners; `at` (n, 6) is overwritten.
    """
    size: cython.int = corners.shape[1]
    miss: cython.double[6]
    at[:, :] = 0.0
    for s in range(corners.shape[0]):
        most: cython.double = 1.0
        for k in range(6):
            miss[k] = size * W[group[s], k]
        for c in range(size):
            v: cython.int = corners[s, c]
            most = min(most, share[v])
            for k in range(6):
                miss[k] -= result[v, k]
        for k in range(6):
            miss[k] *= most / size
        for c in range(size):
            to = cython.address(at[corners[s, c], 0])
            for k in range(6):
                to[k] += miss[k]
    for v in range(result.shape[0]):
        for k in range(6):
            result[v, k] += at[v, k] / max(first[v + 1] - first[v], 1)


def _sum_products(corners, X, W, group, component, middle, at):
    """Add up over the simplices at each vertex, in a row of `at` (n, 36), or (n, 42) for triangles, the last one 0.

    These are the products of 1, x, y, z with 1, x, y, z and the velocity at the centre, each pair once; the square of
    the velocity; and products of the unit normal. Positions and velocities are from the `middle` (9,) of the component.
    """
    size: cython.int = corners.shape[1]
    per: cython.double = 1.0 / size
    n_columns: cython.int = cython.cast(cython.int, at.shape[1])
    row: cython.double[10]
    side: cython.double[6]
    normal: cython.double[3]
    mean: cython.double[42]
    row[0] = 1.0
    for s in range(corners.shape[0]):
        o: cython.int = component[corners[s, 0]]
        for k in range(9):
            row[1 + k] = W[group[s], k - 3] - middle[o, k] if k > 2 else 0.0
        for c in range(size):
            for k in range(3):
                row[1 + k] += per * (X[corners[s, c], k] - middle[o, k])
        if size == 3:
            for k in range(6):
                side[k] = X[corners[s, 1 + k // 3], k % 3] - X[corners[s, 0], k % 3]
            cross(side, side + 3, normal)
            area: cython.double = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
            for k in range(3):
                normal[k] /= max(area, DBL_MIN)
        i: cython.int = 0
        for j in range(4):
            for k in range(j, 10):
                mean[i] = row[j] * row[k]
                i += 1
        mean[34] = mean[n_columns - 1] = 0.0
        for k in range(6):
            mean[34] += _OFTEN[k] * row[4 + k] * row[4 + k]
        i = 35
        for j in range(3 if size == 3 else 0):
            for k in range(j, 3):
                mean[i] = normal[j] * normal[k]
                i += 1
        for c in range(size):
            to = cython.address(at[corners[s, c], 0])
            for j in range(0, n_columns, 6):
                for k in range(6):
                    to[j + k] += mean[j + k]


def _sum_around(v, corners, first, incident, at, near, met, mean):
    """Set `mean` (42,) to the sum of `at` (n, c) over the corners of simplices at v; returns how many others they meet.

    `near` and `met` (n,) are room to work in, the latter 0 before and after.
    """
    size: cython.int = corners.shape[1]
    others: cython.double = -1.0
    n_met: cython.int = 0
    for j in range(42):
        mean[j] = 0.0
    for i in range(first[v], first[v + 1]):
        t: cython.int = simplex_of(incident[i], size)
        for c in range(size):
            u: cython.int = corners[t, c]
            # Overwritten by the next one, if it was met before.
            near[n_met] = u
            n_met += met[u] == 0
            met[u] += 1
    for i in range(n_met):
        u = near[i]
        others += cython.cast(cython.double, first[u + 1] - first[u]) / size
        times: cython.double = met[u]
        of = cython.address(at[u, 0])
        for j in range(0, at.shape[1], 6):
            for k in range(6):
                mean[j + k] += times * of[j + k]
        met[u] = 0
    return others


def fits_around(
    corners: cython.const[cython.int][:, ::1],
    X: cython.const[cython.double][:, ::1],
    W: cython.const[cython.double][:, ::1],
    group: cython.const[cython.int][::1],
    component: cython.const[cython.int][::1],
    middle: cython.const[cython.double][:, ::1],
    first: cython.const[cython.int][::1],
    incident: cython.const[cython.int][::1],
):
    """Linear functions fitted to velocities around vertices: their values (n, 6) there, and how far they hold (n,).

    Simplices (m,) have the velocity W (k, 6) of their `group` at their centres. Those that meet a simplex of the vertex
    count, once for each corner that they share with one. Functions hold, up to 1, by how much they explain more than
    3/4 of the variance there. Of triangles, what varies since projections on their normals do, counts as not explained.
    Each component (n,) has a `middle` (k, 9), a position and a velocity, far from which digits of products are lost.
    """
    size: cython.int = corners.shape[1]
    n_columns: cython.int = 36 if size == 4 else 42
    # As `_sum_products` adds them up.
    sums, found, shares = np.zeros((len(X), n_columns)), np.zeros((len(X), 6)), np.zeros(len(X))
    at: cython.double[:, ::1] = sums
    missed: cython.double[:, ::1] = sums.ravel()[: found.size].reshape(found.shape)
    result: cython.double[:, ::1] = found
    share: cython.double[::1] = shares
    met: cython.int[::1] = np.zeros(len(X), np.int32)
    near: cython.int[::1] = np.empty(len(X) + 1, np.int32)
    mean: cython.double[42]
    spread: cython.double[9]
    away: cython.double[3]
    slope: cython.double[18]
    i: cython.int
    with cython.nogil:
        _sum_products(corners, X, W, group, component, middle, at)
        for v in range(X.shape[0]):
            others: cython.double = _sum_around(v, corners, first, incident, at, near, met, mean)
            total: cython.double = max(mean[0], 1.0)
            about = cython.address(middle[component[v], 0])
            for k in range(n_columns):
                mean[k] /= total
            i = 10
            for j in range(3):
                away[j] = X[v, j] - about[j] - mean[1 + j]
                for k in range(j, 9):
                    product: cython.double = mean[i] - mean[1 + j] * mean[1 + k]
                    if k > 2:
                        slope[6 * j + k - 3] = product
                    else:
                        spread[3 * j + k] = spread[3 * k + j] = product
                    i += 1
            variance: cython.double = mean[34]
            square: cython.double = mean[34]
            whole: cython.double = 0.0
            turned: cython.double = 1.0 if size == 3 else 0.0
            for k in range(6):
                result[v, k] = about[3 + k] + mean[4 + k]
                variance -= _OFTEN[k] * mean[4 + k] * mean[4 + k]
                square += _OFTEN[k] * about[3 + k] * about[3 + k]
                whole += _OFTEN[k] * result[v, k] * result[v, k]
                turned -= _OFTEN[k] * mean[35 + k] * mean[35 + k]
            explained: cython.double = -turned * whole
            free: cython.double = others
            # Of x^2, y^2 and z^2.
            largest: cython.double = max(mean[10], mean[19], mean[27])
            for _ in range(3):
                i = 0
                for j in range(1, 3):
                    i = j if fabs(spread[4 * j]) > fabs(spread[4 * i]) else i
                # Centres do not differ in other directions but for rounding.
                if fabs(spread[4 * i]) <= 1e-15 * largest:
                    break
                free -= 1.0
                per: cython.double = 1.0 / spread[4 * i]
                for k in range(6):
                    explained += _OFTEN[k] * slope[6 * i + k] * slope[6 * i + k] * fabs(per)
                    result[v, k] += away[i] * slope[6 * i + k] * fabs(per)
                # What is left of the other coordinates, when what they share with this one is taken from them.
                for turn in range(1, 4):
                    j = (i + turn) % 3
                    share_of: cython.double = spread[3 * j + i] * per
                    away[j] -= share_of * away[i]
                    for k in range(6):
                        slope[6 * j + k] -= share_of * slope[6 * i + k]
                    for k in range(3):
                        spread[3 * j + k] -= share_of * spread[3 * i + k]
            # Adjusted: of no more simplices than it has coefficients, a function explains all.
            if variance > _ROUNDING * square and free > 0.0:
                share[v] = min(max(1.0 - 4.0 * (1.0 - explained / variance) * others / free, 0.0), 1.0)
        # A mean over neighbours flattens curves: until the means over the corners are the given velocities.
        for _ in range(3):
            _add_misses(corners, W, group, first, share, result, missed)
    return found, shares
