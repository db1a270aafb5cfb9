"""The Laplacian of the heat flow, its weights fitted to the lengths of edges."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.operators import Operators
from heat_igl.typing import FloatArray, IntArray

__all__ = ["fitted_laplacian"]


def fitted_laplacian(domain: Operators, t: float) -> sp.csc_matrix:
    """L with the weight of each edge fitted to heat that falls like exp(-d / sqrt(t)), however long the edge.

    Where (1 - t Laplace) u = 0, the mean of u over a circle of radius r is I0(r / sqrt(t)) times its value in the
    centre, I0 the modified Bessel function. Linear elements know the first terms of that series alone, 1 + r^2 / (4 t):
    along an edge much longer than sqrt(t) heat falls by too little, and the front runs ahead there and bends. So an
    edge of length r gets its weight times (r^2 / (4 t)) / (I0(r / sqrt(t)) - 1), which is 1 for short ones. Negative
    weights are left out, so that heat is positive and keeps its digits on any triangles.

    Parameters
    ----------
    domain : Operators
        One whose lengths are known (`Operators.has_lengths`).
    t : float
        Time step, a squared length.

    Returns
    -------
    (n, n) csc_matrix
        Symmetric, negative semidefinite, rows sum to 0; no entry off the diagonal is negative.

    Raises
    ------
    ValueError
        If the lengths are not known.
    """
    n = domain.n
    if domain.triangulation is not None:
        rows, columns, weight, length = _edge_weights(domain.triangulation, domain.weights)
    elif domain.chords is not None:
        above = sp.triu(domain.L, 1, format="coo")
        rows, columns, weight = above.row, above.col, above.data
        length = sp.triu(domain.chords, 1, format="coo").data
    else:
        raise ValueError("weights are fitted to the lengths of edges, which this domain does not have")
    weight = np.maximum(weight, 0.0) * _fit(length / np.sqrt(t))
    total = np.bincount(rows, weight, n) + np.bincount(columns, weight, n)
    everyone = np.arange(n)
    entries = np.concatenate([weight, weight, -total])
    return sp.csc_matrix(
        (entries, (np.concatenate([rows, columns, everyone]), np.concatenate([columns, rows, everyone]))), shape=(n, n)
    )


def _edge_weights(
    triangulation: IntrinsicTriangulation, areas_counted: FloatArray
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Both ends, cotangent weight and length of each edge; triangles count by the area that they have in the domain."""
    square, areas = triangulation.l**2, triangulation.areas
    scale = areas_counted / (8 * areas**2)
    half_cotangents = (square[:, 0] + square[:, 1] + square[:, 2])[:, None] - 2 * square
    half_cotangents *= scale[:, None]
    half_cotangents = half_cotangents.ravel()
    edges, twin = triangulation.edges, triangulation.twin[triangulation.edges]
    weight = half_cotangents[edges] + np.where(twin >= 0, half_cotangents[twin], 0.0)
    return triangulation.tail(edges), triangulation.head(edges), weight, triangulation.l.ravel()[edges]


def _fit(x: FloatArray) -> FloatArray:
    """(x^2 / 4) / (I0(x) - 1)."""
    # I0 is the sum of y^k / (k!)^2, and 13 terms give it to 1e-12 up to x = 4; beyond, nothing cancels.
    y = np.minimum(x, 4.0) ** 2 / 4
    share = np.ones_like(x)
    for k in range(13, 1, -1):
        share *= y
        share /= k * k
        share += 1
    fitted = 1 / share
    far = x > 4
    # exp(-600) is as good as no heat, and leaves the weight a number.
    beyond = np.minimum(x[far], 600.0)
    fitted[far] = beyond**2 / 4 / (np.i0(beyond) - 1)
    return np.asarray(fitted)
