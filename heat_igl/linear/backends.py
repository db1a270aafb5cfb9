"""Factor a symmetric positive definite matrix once, solve with it many times. Knows matrices, never meshes.

`analyse` looks at the pattern alone; what it returns factors every matrix of that pattern, and principal submatrices,
so that the heat and the Poisson problem share one ordering. Each backend is one small class of analysis and one of
factorization; scripts/tune_backends.py measures them.

SuperLU comes with scipy and is the choice without numba. The package's own `multifrontal` solver is faster from a few
hundred vertices on. Libraries that were tried and left:
cholespy holds the interpreter's lock and orders each matrix anew; cvxopt and scikit-sparse are GPL; MKL's PARDISO is
proprietary and for one kind of processor.
"""

from __future__ import annotations

import importlib.util
from concurrent.futures import ThreadPoolExecutor
from typing import Literal, Protocol, get_args

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl.errors import FactorizationError, MissingExtraError
from heat_igl.linear.iterative import IterativeAnalysis, factors_fit, has_iterative
from heat_igl.runtime import n_threads
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["Analysis", "Backend", "Factorization", "analyse", "factorize"]

Backend = Literal["auto", "scipy", "multifrontal", "iterative"]

# Smaller matrices take milliseconds either way, and loading the compiled kernels takes longer.
_SMALLEST_MULTIFRONTAL = 1000


class Factorization(Protocol):
    """A factored principal submatrix of a matrix A (n, n).

    Attributes
    ----------
    backend : str
        What holds the factor.
    nonzeros : int
        Entries of the factor.
    n_bytes : int
        Memory that a solve reads twice: entries and their indices.
    """

    backend: str
    nonzeros: int
    n_bytes: int

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b on the free vertices for one right-hand side (n,) or several (n, k); 0 on the others."""
        ...


class Analysis(Protocol):
    """What the pattern of a matrix alone determines: an order of elimination, and where the factor has entries.

    Attributes
    ----------
    backend : str
        What factors the matrices.
    order : (n,) int32, optional
        ``order[i]`` is eliminated as the i-th; neighbours mostly are near each other in it. None if that is not known.
    """

    backend: str
    order: IntArray | None

    def fits(self, A: sp.csc_matrix) -> bool:
        """Whether A has the pattern that was analysed."""
        ...

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> Factorization:
        """Factor `A`, or its principal submatrix on the vertices that are `free`; errors as for the function."""
        ...


class _ScipyAnalysis:
    """SuperLU orders the matrix while it factors it, so there is nothing to keep."""

    backend = "scipy"
    order: IntArray | None = None

    def fits(self, A: sp.csc_matrix) -> bool:  # noqa: ARG002 - the protocol's
        return True

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> Factorization:
        return _ScipyFactorization(A, free)


class _ScipyFactorization:
    """SuperLU without pivoting, on a symmetric minimum-degree ordering.

    Off the diagonal an M-matrix stays nonpositive while it is eliminated without pivoting, so that a nonnegative
    right-hand side is solved without a cancellation and small results keep their *relative* accuracy. Heat far away
    depends on that.
    """

    backend = "scipy"

    def __init__(self, A: sp.csc_matrix, free: BoolArray | None) -> None:
        if not A.has_sorted_indices:
            # SuperLU's wrapper would sort in place indices that other matrices share.
            A = A.sorted_indices()
        self._arguments = A, free
        self._free = None if free is None or free.all() else np.flatnonzero(free)
        restricted = A.tocsc() if self._free is None else A[self._free][:, self._free].tocsc()
        _check_finite(restricted)
        try:
            self._factor = spl.splu(
                restricted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise FactorizationError(
                f"the matrix ({restricted.shape[0]} rows) could not be factored: {error}"
            ) from None
        self.nonzeros = int(self._factor.nnz)
        self.n_bytes = 12 * self.nonzeros
        _check_probe(self, A, free, indefinite=True)

    def solve(self, b: FloatArray) -> FloatArray:
        if self._free is None:
            return np.asarray(self._factor.solve(np.ascontiguousarray(b)))
        x = np.zeros_like(b)
        x[self._free] = self._factor.solve(np.ascontiguousarray(b[self._free]))
        return x

    def __reduce__(self) -> tuple[type[_ScipyFactorization], tuple[sp.csc_matrix, BoolArray | None]]:
        return _ScipyFactorization, self._arguments


class _MultifrontalAnalysis:
    """Nested dissection and the fronts that it leads to."""

    backend = "multifrontal"

    def __init__(self, pattern: sp.csc_matrix) -> None:
        from heat_igl.linear import dissection, multifrontal

        self._ends, self._neighbours = pattern.indptr, pattern.indices
        with ThreadPoolExecutor(n_threads()) as workers:
            tree = dissection.dissect(self._ends, self._neighbours, workers)
        self.fronts = multifrontal.fronts(self._ends, self._neighbours, tree)
        self.order: IntArray | None = self.fronts.order

    def fits(self, A: sp.csc_matrix) -> bool:
        own = self._ends, self._neighbours
        return all(a is b or np.array_equal(a, b) for a, b in zip(own, (A.indptr, A.indices), strict=True))

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> Factorization:
        if not self.fits(A):
            raise ValueError("A has another pattern than the matrix that was analysed: analyse A")
        return _MultifrontalFactorization(self, A, free)


class _MultifrontalFactorization:
    """Cholesky factor of the package's own; `multifrontal` says how. No pivoting, as with `_ScipyFactorization`."""

    backend = "multifrontal"

    def __init__(self, analysis: _MultifrontalAnalysis, A: sp.csc_matrix, free: BoolArray | None) -> None:
        from heat_igl.linear import multifrontal

        _check_finite(A)
        self._arguments = analysis, A, free
        self._fronts = fronts = analysis.fronts
        self.nonzeros = int(fronts.end_entry[-1])
        self._held = np.empty(0, np.intp) if free is None else np.flatnonzero(~free)
        self._entries = np.empty(self.nonzeros)
        everywhere = np.ones(A.shape[0], bool) if free is None else free
        failed = multifrontal.factor(A.indptr, A.indices, A.data, everywhere, fronts, self._entries)
        if failed >= 0:
            raise FactorizationError(f"the matrix ({A.shape[0]} rows) is singular or not positive definite")
        self.n_bytes = self._entries.nbytes + fronts.rows.nbytes + fronts.first_row.nbytes + fronts.first_entry.nbytes
        _check_probe(self, A, free)

    def solve(self, b: FloatArray) -> FloatArray:
        from heat_igl.linear import substitution

        order, width = self._fronts.order, substitution.WIDTH
        # A block costs as much as a few single columns, however many of its columns are used.
        if b.ndim == 1 or b.shape[1] < substitution.FEW:
            x = np.empty(b.shape)
            for column, its_x in zip(b.reshape(len(b), -1).T, x.reshape(len(b), -1).T, strict=True):
                ordered = column[order].astype(np.float64, copy=False)
                ordered[self._fronts.place[self._held]] = 0.0
                substitution.substitute(self._fronts, self._entries, ordered)
                its_x[order] = ordered
            return x
        x = np.empty(b.shape)
        block = np.zeros((len(order), width))
        for first in range(0, b.shape[1], width):
            columns = b[:, first : first + width]
            if columns.shape[1] < substitution.FEW:
                x[:, first:] = self.solve(columns)
                continue
            block[:, : columns.shape[1]] = columns[order]
            block[:, columns.shape[1] :] = 0.0
            block[self._fronts.place[self._held]] = 0.0
            substitution.substitute(self._fronts, self._entries, block)
            x[order, first : first + width] = block[:, : columns.shape[1]]
        return x

    def __reduce__(
        self,
    ) -> tuple[type[_MultifrontalFactorization], tuple[_MultifrontalAnalysis, sp.csc_matrix, BoolArray | None]]:
        return _MultifrontalFactorization, self._arguments


def _check_finite(A: sp.csc_matrix) -> None:
    if not np.isfinite(A.data).all():
        raise FactorizationError(
            f"{int((~np.isfinite(A.data)).sum())} entries of the matrix are not finite: the mesh has degenerate faces"
        )


def _check_probe(
    factorization: Factorization, A: sp.csc_matrix, free: BoolArray | None, indefinite: bool = False
) -> None:
    """Solve for ones, which a singular matrix does not survive, and for noise if A may be indefinite."""
    n = A.shape[0]
    ones = np.ones(n) if free is None else free.astype(np.float64)
    broken = not np.abs(factorization.solve(A @ ones) - ones).max() < 0.1
    if indefinite and not broken:
        noise = np.random.default_rng(0).standard_normal(n) * ones
        broken = not noise @ factorization.solve(noise) > 0
    if broken:
        raise FactorizationError(f"the matrix ({n} rows) is singular or not positive definite")


def analyse(pattern: sp.csc_matrix, backend: Backend = "auto") -> Analysis:
    """Order and analyse symmetric matrices of a pattern.

    Parameters
    ----------
    pattern : (n, n) csc_matrix
        Both triangles stored, indices sorted or not; the values do not matter.
    backend : {"auto", "scipy", "multifrontal", "iterative"}
        SuperLU; the package's own factorization, which needs numba; or no factors at all, see `iterative`, which needs
        pyamg too. "auto" takes the second where numba is installed and the matrix is not small, and the third where
        factors would not fit into memory, by an estimate made before.

    Raises
    ------
    MissingExtraError
        If the backend asked for is not installed.
    ValueError
        If there is no such backend.
    """
    if backend not in get_args(Backend):
        raise ValueError(f"backend must be one of {', '.join(map(repr, get_args(Backend)))}, not {backend!r}")
    if backend == "iterative" or (backend == "auto" and has_iterative() and not factors_fit(pattern)):
        return IterativeAnalysis()
    installed = importlib.util.find_spec("numba") is not None
    if backend == "multifrontal" and not installed:
        raise MissingExtraError.of('backend="multifrontal"', "numba", "fast")
    if backend == "auto":
        backend = "multifrontal" if installed and pattern.shape[0] >= _SMALLEST_MULTIFRONTAL else "scipy"
    return _ScipyAnalysis() if backend == "scipy" else _MultifrontalAnalysis(pattern)


def factorize(A: sp.csc_matrix, backend: Backend = "auto", free: BoolArray | None = None) -> Factorization:
    """Factor the symmetric positive definite matrix `A`, or a principal submatrix of it.

    Parameters
    ----------
    A : (n, n) csc_matrix
        Both triangles stored.
    backend : {"auto", "scipy", "multifrontal", "iterative"}
        See `analyse`.
    free : (n,) bool, optional
        Rows and columns to keep, all by default.

    Raises
    ------
    FactorizationError
        If A has entries that are not finite, or is not positive definite.
    MissingExtraError, ValueError
        As for `analyse`.
    """
    return analyse(A, backend).factorize(A, free)
