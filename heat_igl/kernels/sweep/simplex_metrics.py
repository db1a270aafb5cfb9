"""Kernels of velocities: inverse roots of tensors, fits around vertices, lengths where velocity is linear."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.rotation import diagonalize
from cython.cimports.heat_igl.kernels.sweep.facets import gradient, invert, mean_velocity, pair, squares_of
from cython.cimports.libc.float import DBL_MIN
from cython.cimports.libc.math import fabs, sqrt


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
    variation : float
        How far the lengths of edges differ between the metrics of the corners, mean square of the share.
    """
    size: cython.int = corners.shape[1]
    n_pairs: cython.int = size * (size - 1) // 2
    m = corners.shape[0]
    found = np.zeros_like(velocity), np.zeros((m, n_pairs)), np.zeros(m), np.ones(m), np.zeros(m)
    inverse: cython.double[:, ::1] = found[0]
    mean: cython.double[:, ::1] = found[1]
    widest: cython.double[::1] = found[2]
    slack: cython.double[::1] = found[3]
    growth: cython.double[::1] = found[4]
    variation: cython.double = 0.0
    squares: cython.double[24]
    here: cython.double[6]
    e: cython.double[18]
    W: cython.double[6]
    I: cython.double[6]
    E: cython.double[12]
    rise: cython.double[4]
    with cython.nogil:
        for i in range(velocity.shape[0]):
            invert(cython.address(velocity[i, 0]), cython.address(inverse[i, 0]))
        for s in range(m):
            fastest: cython.double = 0.0
            longest: cython.double = 0.0
            for k in range(6):
                W[k] = 0.0
            for i in range(size):
                fastest = max(fastest, mean_velocity(cython.address(velocity[rows[s, i], 0])))
                for x in range(3):
                    for j in range(i):
                        e[3 * pair(i, j) + x] = V[corners[s, j], x] - V[corners[s, i], x]
                    E[3 * i + x] = V[corners[s, 0], x] - V[corners[s, i], x]
                for k in range(6):
                    W[k] += velocity[rows[s, i], k] / size
                rise[i] = mean_velocity(cython.address(velocity[rows[s, 0], 0]))
                rise[i] -= mean_velocity(cython.address(velocity[rows[s, i], 0]))
            invert(W, I)
            squares_of(I, e, n_pairs, cython.address(mean[s, 0]))
            gradient(E + 3, rise + 1, size - 1, here)
            squares_of(W, here, 1, cython.address(growth[s]))
            growth[s] = sqrt(growth[s]) / mean_velocity(W)
            for k in range(n_pairs):
                longest = max(longest, mean[s, k])
            # In a flat simplex, the arc over a long edge would leave it, for velocities far above those at the corners.
            fastest /= mean_velocity(W)
            growth[s] = min(growth[s], 4.0 * sqrt(max(fastest * fastest - 1.0, 0.0) / longest))
            for i in range(size):
                squares_of(cython.address(inverse[rows[s, i], 0]), e, n_pairs, squares + 6 * i)
                for k in range(n_pairs):
                    widest[s] = max(widest[s], squares[6 * i + k])
                for j in range(i):
                    for k in range(6):
                        W[k] = 0.5 * (velocity[rows[s, i], k] + velocity[rows[s, j], k])
                    invert(W, I)
                    squares_of(I, e, n_pairs, here)
                    for k in range(n_pairs):
                        if here[k] < slack[s] * mean[s, k]:
                            slack[s] = here[k] / mean[s, k]
            slack[s] = sqrt(slack[s])
            for k in range(n_pairs):
                one: cython.double = squares[k]
                two: cython.double = squares[k]
                for i in range(1, size):
                    one, two = min(one, squares[6 * i + k]), max(two, squares[6 * i + k])
                two = sqrt(two) - sqrt(one)
                variation += two * two / (n_pairs * m * mean[s, k])
    return *found, variation


def inverses(g: cython.const[cython.double][:, :, ::1], is_root: cython.bint, least: cython.double):
    """The inverses, or inverse roots, of symmetric matrices (k, p, p), p = 2 or 3, by Jacobi's rotations.

    Those of absolute eigenvalues, without those below the share `least` of the largest. Second: eigenvalues (k, p).
    """
    p: cython.int = g.shape[1]
    found, values = np.zeros((g.shape[0], p, p)), np.empty((g.shape[0], p))
    result: cython.double[:, :, ::1] = found
    sizes: cython.double[:, ::1] = values
    work: cython.double[18]
    with cython.nogil:
        for i in range(g.shape[0]):
            for k in range(9):
                work[k] = g[i, k // 3, k % 3] if k // 3 < p and k % 3 < p else 0.0
            diagonalize(work)
            largest: cython.double = max(fabs(work[0]), fabs(work[4]), fabs(work[8]))
            for k in range(p):
                sizes[i, k] = work[4 * k]
                size: cython.double = fabs(work[4 * k])
                if size < least * largest:
                    continue
                size = max(size, DBL_MIN)
                size = 1.0 / (sqrt(size) if is_root else size)
                for x in range(p):
                    for y in range(p):
                        result[i, x, y] += size * work[9 + 3 * k + x] * work[9 + 3 * k + y]
    return found, values


def sums_around(
    corners: cython.const[cython.int][:, ::1],
    X: cython.const[cython.double][:, ::1],
    values: cython.const[cython.double][:, ::1],
    group: cython.const[cython.int][::1],
    first: cython.const[cython.int][::1],
    incident: cython.const[cython.int][::1],
):
    """Sums (n, 4, 4 + c) of 1, x, y, z of centres, times these and the values (k, c), over simplices around vertices.

    The values of simplices (m,) are those of their `group`. Simplices count as often as they meet one at the vertex.
    Second are the numbers (n,) of corners that meet in the vertices around, counted once.
    """
    size: cython.int = corners.shape[1]
    n_columns: cython.int = 4 + values.shape[1]
    found, here = np.zeros((2, X.shape[0], 4, n_columns))
    sums: cython.double[:, :, ::1] = found
    at: cython.double[:, :, ::1] = here
    row: cython.double[17]
    row[0] = 1.0
    counts, times = np.zeros((2, X.shape[0]), np.int32)
    count: cython.int[::1] = counts
    met: cython.int[::1] = times
    with cython.nogil:
        for s in range(corners.shape[0]):
            for k in range(3):
                row[1 + k] = 0.0
                for c in range(size):
                    row[1 + k] += X[corners[s, c], k] / size
            for k in range(4, n_columns):
                row[k] = values[group[s], k - 4]
            for c in range(size):
                for j in range(4):
                    for k in range(n_columns):
                        at[corners[s, c], j, k] += row[j] * row[k]
        for v in range(X.shape[0]):
            for i in range(first[v], first[v + 1]):
                for c in range(size):
                    met[corners[incident[i] // size, c]] += 1
            for i in range(first[v], first[v + 1]):
                for c in range(size):
                    u: cython.int = corners[incident[i] // size, c]
                    if met[u] > 0:
                        count[v] += first[u + 1] - first[u]
                        for j in range(4):
                            for k in range(n_columns):
                                sums[v, j, k] += met[u] * at[u, j, k]
                        met[u] = 0
    return found, counts


def add_misses(
    found: cython.double[:, ::1],
    corners: cython.const[cython.int][:, ::1],
    values: cython.const[cython.double][:, ::1],
    group: cython.const[cython.int][::1],
    weight: cython.const[cython.double][::1],
    first: cython.const[cython.int][::1],
) -> None:
    """Add to what is `found` (n, c) at vertices by how much its means miss the values of simplices, times the weight.

    At a vertex it is the mean over the simplices there.
    """
    size: cython.int = corners.shape[1]
    missed: cython.double[:, ::1] = np.zeros_like(found)
    with cython.nogil:
        for s in range(corners.shape[0]):
            for k in range(found.shape[1]):
                miss: cython.double = values[group[s], k]
                for c in range(size):
                    miss -= found[corners[s, c], k] / size
                for c in range(size):
                    missed[corners[s, c], k] += weight[s] * miss
        for v in range(found.shape[0]):
            for k in range(found.shape[1]):
                found[v, k] += missed[v, k] / max(first[v + 1] - first[v], 1)
