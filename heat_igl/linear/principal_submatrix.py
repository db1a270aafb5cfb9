"""The principal submatrix of a matrix on some rows, and solutions that are 0 on the others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from heat_igl.runtime import pool
from heat_igl.typing import BoolArray, FloatArray

__all__ = ["PrincipalSubmatrix"]


class PrincipalSubmatrix:
    """The rows and columns of A that are free, for solvers of one right-hand side at a time.

    Parameters
    ----------
    A : (n, n) csc_matrix
        Symmetric.
    free : (n,) bool, optional
        Rows and columns to keep, all by default.

    Attributes
    ----------
    matrix : (k, k) csc_matrix
        The submatrix.
    n_bytes : int
        Memory of the submatrix.
    """

    def __init__(self, A: sp.csc_matrix, free: BoolArray | None) -> None:
        self._free = None if free is None or free.all() else np.flatnonzero(free)
        self.matrix = (A if self._free is None else A[self._free][:, self._free]).tocsc()
        self.n_bytes = self.matrix.data.nbytes + self.matrix.indices.nbytes + self.matrix.indptr.nbytes

    def solve(self, b: FloatArray, column_solve: Callable[[FloatArray], FloatArray], n_threads: int) -> FloatArray:
        """The solution (n,) or (n, k) for `b`, by a function that solves for one column (k,) of free rows."""
        kept = b if self._free is None else b[self._free]
        columns = kept.reshape(len(kept), -1)
        if columns.shape[1] == 1 or n_threads == 1:
            solved = [column_solve(np.ascontiguousarray(column)) for column in columns.T]
        else:
            with pool(min(n_threads, columns.shape[1])) as workers:
                solved = list(workers.map(column_solve, np.ascontiguousarray(columns.T)))
        x = np.zeros(b.shape)
        into = x.reshape(len(x), -1)
        into[slice(None) if self._free is None else self._free] = np.stack(solved, axis=1)
        return x
