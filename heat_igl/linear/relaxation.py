"""Relaxation: Gauss-Seidel iteration on an M-matrix, which keeps the relative accuracy of small results.

Heat decays by hundreds of orders of magnitude over a mesh, and far from the source the direction of its gradient
depends on the *relative* accuracy: an iteration that stops at a residual would lose it. The heat matrix on a Delaunay
triangulation is an M-matrix, so Gauss-Seidel from 0 with a right-hand side that is nowhere negative adds numbers of one
sign, and converges from below at every unknown. Unknowns are visited outward from the source, in a band that moves with
the front. Each is visited some tens to hundreds of times, on meshes of any size.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError
from heat_igl.kernels.linear.relaxation import relax
from heat_igl.linear.principal_submatrix import PrincipalSubmatrix
from heat_igl.runtime import n_threads
from heat_igl.typing import BoolArray, FloatArray

__all__ = ["Relaxation"]

# Relative change per sweep below which an unknown has converged. The remaining error adds up along the way from the
# source, to at most some 1e-8 on slivers; distances depend on the differences of neighbours only.
_TOLERANCE = 1e-11
# Largest number of sweeps. A sweep advances by one breadth-first level; slivers need a thousand sweeps more.
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
