"""Relaxation: Gauss-Seidel iteration on an M-matrix, which keeps the relative accuracy of small results.

Heat falls by hundreds of decades over a mesh, and only its *relative* accuracy gives far directions: an iteration that
stops at a residual would lose them. The heat matrix on a Delaunay triangulation is an M-matrix, so Gauss-Seidel from 0
with a right-hand side that is nowhere negative adds up numbers of one sign and rises towards the solution at every
unknown. Visiting unknowns outward from the source, a band that is already right follows the front, and each unknown is
visited some tens to hundreds of times, however large the mesh.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError
from heat_igl.kernels.relaxation import relax
from heat_igl.linear.principal_submatrix import PrincipalSubmatrix
from heat_igl.runtime import n_threads
from heat_igl.typing import BoolArray, FloatArray

__all__ = ["Relaxation"]

# Relative change per sweep below which an unknown is left alone. The remaining error adds up along the way from the
# source, to at most some 1e-8 on slivers; distances see the differences of neighbours only.
_TOLERANCE = 1e-11
# A sweep goes out by one level of unknowns at a time; slivers need a thousand more.
_MOST_SWEEPS = 200_000


class Relaxation:
    """Gauss-Seidel in breadth-first order from the right-hand side, to relative accuracy.

    Parameters
    ----------
    A : (n, n) sparse matrix
        Symmetric positive definite, with an inverse that has no negative entry: an M-matrix, or one with a few small
        positive entries off the diagonal such as obtuse angles at a boundary bring.
    free : (n,) bool, optional
        Rows and columns to keep; the solution is 0 on the others.
    """

    backend = "iterative"
    nonzeros = 0

    def __init__(self, A: sp.csc_matrix, free: BoolArray | None = None) -> None:
        self._arguments = A, free
        self._part = PrincipalSubmatrix(A, free)
        self.n_bytes = self._part.n_bytes

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b for one right-hand side (n,) or several (n, k); columns run on all processors.

        Raises
        ------
        FactorizationError
            If the solution for a right-hand side that is nowhere negative is negative somewhere.
        """
        return self._part.solve(b, self._column, n_threads())

    def _column(self, b: FloatArray) -> FloatArray:
        if (b < 0).any():
            return self._rising(np.maximum(b, 0)) - self._rising(np.maximum(-b, 0))
        return self._rising(b)

    def _rising(self, b: FloatArray) -> FloatArray:
        A = self._part.matrix  # symmetric: columns are rows
        x, sweeps = relax(
            A.indptr.astype(np.int32, copy=False),
            A.indices.astype(np.int32, copy=False),
            A.data.astype(np.float64, copy=False),
            b.astype(np.float64, copy=False),
            _TOLERANCE,
            _MOST_SWEEPS,
        )
        if sweeps < 0 or (x < 0).any():
            raise FactorizationError(
                f"relaxation failed ({'no end' if sweeps < 0 else 'negative heat'}): edges with negative weights let "
                'heat turn negative; use laplacian="intrinsic-delaunay", or a direct backend'
            )
        return np.asarray(x)

    def __reduce__(self) -> tuple[type[Relaxation], tuple[sp.csc_matrix, BoolArray | None]]:
        return Relaxation, self._arguments
