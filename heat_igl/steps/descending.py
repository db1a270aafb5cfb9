"""The kernel of step 2 on triangles: from heat to the divergence of its normalized gradient, face by face."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.fans import jit
from heat_igl.operators import TriangleElements
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["Triangles", "normalized_divergence", "triangles"]

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
    elements: TriangleElements, weights: FloatArray, full_rate: FloatArray, order: IntArray | None
) -> Triangles:
    """The tables of `elements`, for faces of area `weights` (m,) and vertices visited in `order`.

    `full_rate` (m,) is the rate of decay from which on a direction is trusted fully, 0 for any.
    """
    F = elements.corners
    n, m = 1 + int(F.max(initial=-1)) if order is None else len(order), len(F)
    order = np.arange(n) if order is None else order
    place = np.empty(n, np.int32)
    place[order] = np.arange(n, dtype=np.int32)
    corners = place[F]
    first = np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2])
    # No two of these numbers are equal, so that every way of sorting gives the same.
    by_first = np.sort(first.astype(np.int64) * m + np.arange(m)) % m
    numbers = np.empty((m, 5))
    with np.errstate(divide="ignore"):
        for column, values in enumerate((*elements.frames(), weights, full_rate**-2.0)):
            numbers[:, column] = values[by_first]
    return Triangles(order, corners[by_first], numbers)


@jit
def _on_triangles(t: Triangles, u: FloatArray, log_u: FloatArray, smallest: float, of_log: bool) -> FloatArray:
    """`normalized_divergence` for one column (n,), in the order of the tables."""
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


def normalized_divergence(t: Triangles, u: FloatArray, smallest: float, of_log: bool = False) -> FloatArray:
    """Integrated divergence (n, k) of -grad u / |grad u|, times |grad log u| / full_rate where that is below 1.

    It follows the gradient of log u if `of_log`, on faces where no corner is below `smallest`. It is 0 where no
    component of grad u reaches `smallest`, and of length 1 where u is not positive.
    """
    divergence = np.zeros(u.shape)
    for column, of_column in zip(u.T, divergence.T, strict=True):
        ordered = column[t.order]
        with np.errstate(divide="ignore", invalid="ignore"):
            of_column[t.order] = _on_triangles(t, ordered, np.log(ordered), smallest, of_log)
    return divergence
