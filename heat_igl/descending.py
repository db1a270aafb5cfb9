"""Kernel of step 2 and half of step 3: from heat to the divergence of its normalized gradient, face by face."""

from __future__ import annotations

import numpy as np

from heat_igl.fans import jit
from heat_igl.typing import FloatArray, IntArray

__all__ = ["descent"]


@jit
def descent(
    ends: IntArray,
    vertices: IntArray,
    gradient: FloatArray,
    weights: FloatArray,
    full_rate: FloatArray,
    u: FloatArray,
    smallest: float,
) -> FloatArray:
    """Integrated divergence (n, k) of -grad u / |grad u|, times |grad log u| / full_rate where that is below 1.

    The gradient is given by its rows (compressed, stacked by coordinate), per face of size `weights` (m,). Where
    `full_rate` (m,) is 0, and where u is not positive, the field has length 1; it is 0 where no component of grad u
    reaches `smallest`.
    """
    m, k = len(weights), u.shape[1]
    dimension = (len(ends) - 1) // m
    divergence = np.zeros(u.shape)
    log_u = np.log(u) if full_rate.any() else u
    X, rate = np.empty((dimension, k)), np.empty((dimension, k))
    length, damped, largest = np.empty(k), np.empty(k), np.empty(k)
    for f in range(m):
        damps = full_rate[f] > 0.0
        X[:] = 0.0
        rate[:] = 0.0
        for d in range(dimension):
            for p in range(ends[d * m + f], ends[d * m + f + 1]):
                v, g = vertices[p], gradient[p]
                for c in range(k):
                    X[d, c] += g * u[v, c]
                if damps:
                    for c in range(k):
                        rate[d, c] += g * log_u[v, c]
        for c in range(k):
            largest[c] = 0.0
            length[c] = 0.0
            damped[c] = 0.0
        for d in range(dimension):
            for c in range(k):
                largest[c] = max(largest[c], abs(X[d, c]))
        # Squares of entries below 1e-154 would vanish: the largest is made 1 first.
        for d in range(dimension):
            for c in range(k):
                X[d, c] /= largest[c]
                length[c] += X[d, c] ** 2
                damped[c] += rate[d, c] ** 2
        for c in range(k):
            scale = -weights[f] / np.sqrt(length[c])
            share = np.sqrt(damped[c]) / full_rate[f]
            if damps and share < 1.0:
                scale *= share
            length[c] = scale if largest[c] >= smallest else 0.0
            if largest[c] < smallest:
                for d in range(dimension):
                    X[d, c] = 0.0
        for d in range(dimension):
            for c in range(k):
                X[d, c] *= length[c]
            for p in range(ends[d * m + f], ends[d * m + f + 1]):
                v, g = vertices[p], gradient[p]
                for c in range(k):
                    divergence[v, c] -= g * X[d, c]
    return divergence
