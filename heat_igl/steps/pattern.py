"""The pattern that the matrices of steps 1 and 3 have in common: that of L, and the whole diagonal."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.linear import Analysis, Backend, analyse
from heat_igl.typing import FloatArray

__all__ = ["analysis", "shifted"]


def analysis(L: sp.csc_matrix, backend: Backend = "auto", known: Analysis | None = None) -> Analysis:
    """Order and analyse the pattern that the matrices of the heat flow and of the Poisson problem have in common.

    Of the Laplacian `L` only the pattern matters. An analysis that is `known` is returned as it is if it fits.
    """
    pattern = shifted(L, 1.0, np.zeros(L.shape[0]))
    return known if known is not None and known.fits(pattern) else analyse(pattern, backend)


def shifted(L: sp.csc_matrix, factor: float | FloatArray, diagonal: FloatArray) -> sp.csc_matrix:
    """``L * factor + diag(diagonal)`` with the pattern of L and the whole diagonal, zeros stored.

    `factor` is a number, or one (n,) for each column.
    """
    if np.ndim(factor):
        factor = np.repeat(factor, np.diff(L.indptr))
    on_diagonal = np.flatnonzero(L.indices == np.repeat(np.arange(len(diagonal)), np.diff(L.indptr)))
    if len(on_diagonal) == len(diagonal):
        data = factor * L.data
        data[on_diagonal] += diagonal
        return sp.csc_matrix((data, L.indices, L.indptr), shape=L.shape)
    # Vertices that no face uses have no entry of their own.
    entries = sp.csc_matrix((factor * L.data, L.indices, L.indptr), shape=L.shape).tocoo()
    everyone = np.arange(len(diagonal))
    rows, columns = np.append(entries.row, everyone), np.append(entries.col, everyone)
    return sp.csc_matrix((np.append(entries.data, diagonal), (rows, columns)), shape=L.shape)
