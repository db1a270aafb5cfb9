"""The backend without factors, for systems too large to factor: relaxation for heat, multigrid for Poisson."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError, MissingExtraError
from heat_igl.kernels.linear.relaxation import relax
from heat_igl.runtime import n_threads, pool
from heat_igl.typing import BoolArray, FloatArray, IntArray

# A matrix has an excess of the diagonal in every row, or it does not; this is rounding.
_EXCESS = 1e-13

# Relative change per sweep below which an unknown has converged. The remaining error adds up along the way from the
# source, to at most some 1e-8 on slivers; distances depend on the differences of neighbours only.
_TOLERANCE = 1e-11
# Largest number of sweeps. A sweep advances by one breadth-first level; slivers need a thousand sweeps more.
_MOST_SWEEPS = 200_000
# Relative residual of the Poisson problem; the largest error measured is 1e-11 of the largest value.
_RESIDUAL = 1e-10
_MOST_ITERATIONS = 300


class IterativeAnalysis:
    """In place of an ordering: there is nothing to analyse, and every matrix fits."""

    backend = "iterative"
    order: IntArray | None = None

    def __init__(self, pattern: sp.csc_matrix | None = None) -> None:
        pass

    def fits(self, A: sp.csc_matrix) -> bool:  # noqa: ARG002 - any will do
        """Whether the analysis may be used for A: always."""
        return True

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> Relaxation | Multigrid:
        """`Relaxation` if each diagonal entry exceeds the rest of its row, as in a step of heat flow, else `Multigrid`.

        Raises
        ------
        FactorizationError
            If A has a diagonal entry that is not positive.
        MissingExtraError
            If pyamg is needed and missing.
        """
        kept = np.ones(A.shape[0], bool) if free is None else free
        diagonal = A.diagonal()[kept]
        if not (diagonal > 0).all():
            raise FactorizationError(f"the matrix ({A.shape[0]} rows) is singular or not positive definite")
        excess = (A @ np.ones(A.shape[0]))[kept]
        return Relaxation(A, free) if (excess > _EXCESS * diagonal).all() else Multigrid(A, free)


def has_iterative() -> bool:
    """Whether the library that `Multigrid` needs is installed."""
    return importlib.util.find_spec("pyamg") is not None


class Relaxation:
    """Gauss-Seidel in breadth-first order from the right-hand side, to relative accuracy.

    Heat decays by hundreds of orders of magnitude over a mesh, and far from the source the direction of its gradient
    depends on the *relative* accuracy: an iteration that stops at a residual would lose it. The heat matrix on a
    Delaunay triangulation is an M-matrix, so Gauss-Seidel from 0 with a right-hand side that is nowhere negative adds
    numbers of one sign, and converges from below at every unknown. Unknowns are visited outward from the source, in a
    band that moves with the front. Each is visited some tens to hundreds of times, on meshes of any size.

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


class Multigrid:
    """Conjugate gradients, preconditioned by pyamg's classical (Ruge-Stueben) multigrid, to a residual of 1e-10.

    Parameters
    ----------
    A : (n, n) sparse matrix
        Symmetric positive definite on the vertices that are free.
    free : (n,) bool, optional
        Rows and columns to keep; the solution is 0 on the others.

    Raises
    ------
    MissingExtraError
        If pyamg is not installed.

    Notes
    -----
    Compared with smoothed aggregation, the setup takes a fraction of the time and memory, and Laplacians of
    triangulations need about as many iterations. It uses no random numbers.
    """

    backend = "iterative"
    nonzeros = 0

    def __init__(self, A: sp.csc_matrix, free: BoolArray | None = None) -> None:
        try:
            import pyamg
        except ImportError:
            raise MissingExtraError.of('backend="iterative"', "pyamg", "fast") from None
        self._arguments = A, free
        self._part = PrincipalSubmatrix(A, free)
        part = self._part.matrix  # symmetric: columns are rows
        rows = sp.csr_matrix((part.data, part.indices, part.indptr), shape=part.shape)
        self._levels: Any = pyamg.ruge_stuben_solver(rows, max_coarse=500)
        self.n_bytes = int(self._part.n_bytes * self._levels.operator_complexity())

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b for one right-hand side (n,) or several (n, k).

        Raises
        ------
        FactorizationError
            If the iteration does not converge.
        """
        return self._part.solve(b, self._column, 1)

    def _column(self, b: FloatArray) -> FloatArray:
        x, status = self._levels.solve(b, tol=_RESIDUAL, maxiter=_MOST_ITERATIONS, accel="cg", return_info=True)
        if status != 0:
            raise FactorizationError(
                f"conjugate gradients did not converge in {_MOST_ITERATIONS} iterations ({len(b)} rows): is the mesh "
                'full of slivers? Use laplacian="intrinsic-delaunay", or a direct backend'
            )
        return np.asarray(x)

    def __reduce__(self) -> tuple[type[Multigrid], tuple[sp.csc_matrix, BoolArray | None]]:
        return Multigrid, self._arguments


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
