"""Kernels of step 2 and half of step 3: from heat to the divergence of its normalized gradient, face by face."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import apex
from heat_igl.intrinsic.fans import jit
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["Triangles", "descent", "descent_on_triangles", "triangles"]

# Columns of `Triangles.numbers`.
_PER_BASE, _FOOT, _PER_HEIGHT, _AREA, _PER_RATE = 0, 1, 2, 3, 4


class Triangles(NamedTuple):
    """All that the divergence takes of a triangulation, a row per face, so that a pass reads little memory.

    Attributes
    ----------
    order : (n,) int
        The vertices as they are visited.
    corners : (m, 3) int32
        Places in `order`; the faces in the order of their first corners there.
    numbers : (m, 5) float64
        One over the length of the side from corner 0 to corner 1; the foot of corner 2 on it, from 0 to 1 between the
        two; one over the height. Then the area, and one over the square of the rate below which a direction is not
        trusted fully.
    """

    order: IntArray
    corners: AnyArray
    numbers: FloatArray


def triangles(
    F: IntArray,
    l: FloatArray,  # noqa: E741
    weights: FloatArray,
    full_rate: FloatArray,
    order: IntArray | None,
) -> Triangles:
    """The tables of triangles with edge lengths `l` (m, 3); the rest as for `descent`."""
    n, m = 1 + int(F.max(initial=-1)) if order is None else len(order), len(F)
    order = np.arange(n) if order is None else order
    place = np.empty(n, np.int32)
    place[order] = np.arange(n, dtype=np.int32)
    corners = place[F]
    first = np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2])
    # No two of these numbers are equal, so that every way of sorting gives the same.
    by_first = np.sort(first.astype(np.int64) * m + np.arange(m)) % m
    base = l[:, 2]
    x, y = apex(base, l[:, 1], l[:, 0])
    numbers = np.empty((m, 5))
    with np.errstate(divide="ignore"):
        for column, values in enumerate((1 / base, x / base, 1 / y, weights, full_rate**-2.0)):
            numbers[:, column] = values[by_first]
    return Triangles(order, corners[by_first], numbers)


@jit
def _on_triangles(t: Triangles, u: FloatArray, log_u: FloatArray, smallest: float, of_log: bool) -> FloatArray:
    """`descent` for one column (n,), each triangle in the frame of `intrinsic_gradient`."""
    divergence = np.zeros(len(u))
    for f in range(len(t.corners)):
        a, b, c = t.corners[f, 0], t.corners[f, 1], t.corners[f, 2]
        per_base, foot, per_height = t.numbers[f, _PER_BASE], t.numbers[f, _FOOT], t.numbers[f, _PER_HEIGHT]
        rise = log_u[b] - log_u[a]
        x_of_log, y_of_log = per_base * rise, per_height * (log_u[c] - log_u[a] - foot * rise)
        if of_log and min(u[a], u[b], u[c]) >= smallest:
            x, y = x_of_log, y_of_log
            largest = max(abs(x), abs(y))
            if largest == 0.0:
                continue
        else:
            rise = u[b] - u[a]
            x, y = per_base * rise, per_height * (u[c] - u[a] - foot * rise)
            largest = max(abs(x), abs(y))
            if not largest >= smallest:
                continue
        share = (x_of_log * x_of_log + y_of_log * y_of_log) * t.numbers[f, _PER_RATE]
        if not share < 1.0:
            share = 1.0
        # Squares of entries below 1e-154 would vanish: the largest is made 1 first.
        x, y = x * (1.0 / largest), y * (1.0 / largest)
        scale = t.numbers[f, _AREA] * np.sqrt(share / (x * x + y * y))
        at_c = scale * y * per_height
        at_b = scale * x * per_base - foot * at_c
        divergence[a] -= at_b + at_c
        divergence[b] += at_b
        divergence[c] += at_c
    return divergence


def descent_on_triangles(t: Triangles, u: FloatArray, smallest: float, of_log: bool = False) -> FloatArray:
    """`descent`, for triangles in their tables; along the gradient of log u where no corner is below `smallest`."""
    divergence = np.zeros(u.shape)
    for column, of_column in zip(u.T, divergence.T, strict=True):
        ordered = column[t.order]
        with np.errstate(divide="ignore", invalid="ignore"):
            of_column[t.order] = _on_triangles(t, ordered, np.log(ordered), smallest, of_log)
    return divergence


@jit
def _single(
    ends: IntArray,
    vertices: IntArray,
    gradient: FloatArray,
    weights: FloatArray,
    full_rate: FloatArray,
    u: FloatArray,
    smallest: float,
    of_log: bool,
) -> FloatArray:
    """`descent` for one column (n,) and up to three coordinates, which then stay in registers."""
    m = len(weights)
    dimension = (len(ends) - 1) // m
    divergence = np.zeros(len(u))
    log_u = np.log(u) if of_log or full_rate.any() else u
    for f in range(m):
        damps = full_rate[f] > 0.0
        x = y = z = x_of_log = y_of_log = z_of_log = 0.0
        coldest = np.inf
        for d in range(dimension):
            total = total_of_log = 0.0
            for p in range(ends[d * m + f], ends[d * m + f + 1]):
                total += gradient[p] * u[vertices[p]]
                coldest = min(coldest, u[vertices[p]])
                total_of_log += gradient[p] * log_u[vertices[p]]
            if d == 0:
                x, x_of_log = total, total_of_log
            elif d == 1:
                y, y_of_log = total, total_of_log
            else:
                z, z_of_log = total, total_of_log
        along_log = of_log and coldest >= smallest
        if along_log:
            x, y, z = x_of_log, y_of_log, z_of_log
        largest = max(abs(x), abs(y), abs(z))
        if not largest >= (np.finfo(np.float64).tiny if along_log else smallest):
            continue
        # Squares of entries below 1e-154 would vanish: the largest is made 1 first.
        x, y, z = x / largest, y / largest, z / largest
        scale = weights[f] / np.sqrt(x * x + y * y + z * z)
        if damps:
            share = np.sqrt(x_of_log**2 + y_of_log**2 + z_of_log**2) / full_rate[f]
            if share < 1.0:
                scale *= share
        for d in range(dimension):
            component = scale * (x if d == 0 else y if d == 1 else z)
            for p in range(ends[d * m + f], ends[d * m + f + 1]):
                divergence[vertices[p]] += gradient[p] * component
    return divergence


@jit
def _several(
    ends: IntArray,
    vertices: IntArray,
    gradient: FloatArray,
    weights: FloatArray,
    full_rate: FloatArray,
    u: FloatArray,
    smallest: float,
) -> FloatArray:
    """`descent` for several columns at once."""
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


def descent(
    ends: IntArray,
    vertices: IntArray,
    gradient: FloatArray,
    weights: FloatArray,
    full_rate: FloatArray,
    u: FloatArray,
    smallest: float,
    of_log: bool = False,
) -> FloatArray:
    """Integrated divergence (n, k) of -grad u / |grad u|, times |grad log u| / full_rate where that is below 1.

    The gradient is given by its rows (compressed, stacked by coordinate), per face of size `weights` (m,). Where
    `full_rate` (m,) is 0, and where u is not positive, the field has length 1; it is 0 where no component of grad u
    reaches `smallest`. It follows the gradient of log u if `of_log`, where no corner is below `smallest`.
    """
    if of_log or (u.shape[1] == 1 and len(ends) - 1 <= 3 * len(weights)):
        divergence = np.empty(u.shape)
        for column, of_column in zip(u.T, divergence.T, strict=True):
            of_column[:] = _single(ends, vertices, gradient, weights, full_rate, column.copy(), smallest, of_log)
        return divergence
    return np.asarray(_several(ends, vertices, gradient, weights, full_rate, u, smallest))
