"""The Laplacian of the heat flow, with weights fitted to the lengths of edges."""

from __future__ import annotations

from math import factorial

import numpy as np
import scipy.sparse as sp

from heat_igl.operators import Operators
from heat_igl.typing import FloatArray


def fitted_laplacian(domain: Operators, t: float | FloatArray) -> sp.csc_matrix:
    """L with the weight of each edge fitted to heat that falls like exp(-d / sqrt(t)), however long the edge.

    If (1 - t Laplace) u = 0, the mean of u over a circle of radius r is I0(r / sqrt(t)) times the value in the
    centre, I0 the modified Bessel function. Linear elements know the first terms of that series alone, 1 + r^2 / (4 t):
    along an edge much longer than sqrt(t) heat falls by too little, and the front runs ahead there and bends. So an
    edge of length r gets the weight times (r^2 / (4 t)) / (I0(r / sqrt(t)) - 1), which is 1 for short ones. Negative
    weights are left out, so that heat is positive and keeps its digits on any triangles.

    Parameters
    ----------
    domain : Operators
        One whose `lengths` are known.
    t : float or (n_components,) float64
        Time step, a squared length.

    Returns
    -------
    (n, n) csc_matrix
        Symmetric, negative semidefinite, rows sum to 0; no entry off the diagonal is negative. In the pattern of L.

    Raises
    ------
    ValueError
        If the lengths are not known, or not that of an entry of L.

    Notes
    -----
    The weights are those of L and the lengths those of the edges, and they have to agree: t is a squared length in the
    metric of L and M. Twice L and twice M are the same metric. Twice L alone is that of edges shorter by sqrt(2): in
    M - t L it counts like 2 t, so heat falls like exp(-d / sqrt(2 t)) over short edges, but long ones would still be
    fitted at t. Give `Operators.lengths` for such an L, or keep L and pass 2 t.
    """
    L, n = domain.L, domain.n
    edges = domain.edge_lengths()
    if edges is None:
        raise ValueError("weights are fitted to the lengths of edges, which this domain does not have")
    i, j, length = edges
    fitted = _fit(length / np.sqrt(t[domain.components[i]] if isinstance(t, np.ndarray) else t))
    # Entry 0 takes the pairs that L does not couple.
    entry = sp.csc_matrix((np.arange(1, L.nnz + 1, dtype=L.indices.dtype), L.indices, L.indptr), shape=L.shape)
    factor = np.zeros(L.nnz + 1)
    for rows, columns in ((i, j), (j, i)):
        # L has one entry for all edges between the same two vertices. The largest factor is that of the shortest: heat
        # arrives along it first, and it has most of the weight, which is the length of the dual edge over the length of
        # the edge.
        np.maximum.at(factor, np.asarray(entry[rows, columns]).ravel(), fitted)
    column = np.repeat(np.arange(n), np.diff(L.indptr))
    on_diagonal = np.flatnonzero(L.indices == column)
    weight = np.maximum(L.data, 0.0)
    weight[on_diagonal] = 0
    unknown = (weight > 0) & (factor[1:] == 0)
    if unknown.any():
        first = int(np.argmax(unknown))
        raise ValueError(
            f"L[{L.indices[first]}, {column[first]}] couples vertices whose distance is not known "
            f"({int(unknown.sum())} entries do): give lengths for all that L couples, or do not fit (magnitude='unit')"
        )
    weight *= factor[1:]
    weight[on_diagonal] = -np.bincount(column, weight, n)[column[on_diagonal]]
    return sp.csc_matrix((weight, L.indices, L.indptr), shape=L.shape)


def _fit(x: FloatArray) -> FloatArray:
    """(x^2 / 4) / (I0(x) - 1): the factor of a weight whose edge has length x in units of sqrt(t)."""
    # I0 is the sum of y^k / (k!)^2, and 13 terms give it to 1e-12 up to x = 4; beyond, nothing cancels.
    y = np.minimum(x, 4.0) ** 2 / 4
    over_y = np.zeros_like(x)
    for k in range(13, 0, -1):
        over_y *= y
        over_y += 1 / factorial(k) ** 2
    fitted = 1 / over_y
    far = x > 4
    # exp(-600) is as good as no heat, and leaves the weight a number.
    beyond = np.minimum(x[far], 600.0)
    fitted[far] = beyond**2 / 4 / (np.i0(beyond) - 1)
    return np.asarray(fitted)
