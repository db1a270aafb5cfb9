"""Kernel of lengths in simplices whose velocity is linear between the corners."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.sweep.facets import gradient, invert, mean_velocity, pair, squares_of
from cython.cimports.libc.math import sqrt


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
