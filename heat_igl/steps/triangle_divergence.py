"""Step 2 on triangles in one pass over the faces: from heat to the divergence of the normalized gradient."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.kernels.heat.divergence import divergence_of_descent
from heat_igl.operators import TriangleElements
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["DivergenceTables", "divergence_tables", "normalized_divergence"]


class DivergenceTables(NamedTuple):
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


def divergence_tables(
    elements: TriangleElements, weights: FloatArray, full_rate: FloatArray, order: IntArray | None
) -> DivergenceTables:
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
    return DivergenceTables(order, corners[by_first], numbers)


def normalized_divergence(t: DivergenceTables, u: FloatArray, smallest: float, of_log: bool = False) -> FloatArray:
    """Integrated divergence (n, k) of -grad u / |grad u|, times |grad log u| / full_rate if that is below 1.

    It follows the gradient of log u if `of_log`, on faces with no corner below `smallest`. It is 0 if no
    component of grad u reaches `smallest`, and of length 1 if u is not positive.
    """
    divergence = np.zeros(u.shape)
    for column, of_column in zip(u.T, divergence.T, strict=True):
        ordered = column[t.order].astype(np.float64, copy=False)
        with np.errstate(divide="ignore", invalid="ignore"):
            log_u = np.log(ordered)
        of_column[t.order] = divergence_of_descent(t.corners, t.numbers, ordered, log_u, smallest, of_log)
    return divergence
