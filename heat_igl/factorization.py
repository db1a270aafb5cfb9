"""Factor a symmetric positive definite matrix once, solve with it many times. Knows matrices, never meshes.

Each backend is one small class; `factorize` chooses among them.
"""

from __future__ import annotations

import importlib.util
from typing import Any, Literal, Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl.errors import FactorizationError, MissingExtraError
from heat_igl.iterative import factors_fit, has_iterative, iterative
from heat_igl.typing import FloatArray

__all__ = ["Backend", "CholespyFactorization", "Factorization", "ScipyFactorization", "factorize"]

Backend = Literal["auto", "scipy", "cholespy", "iterative"]


class Factorization(Protocol):
    """A factored matrix A.

    Attributes
    ----------
    backend : str
        Name of the library that holds the factor.
    """

    backend: str

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b for one right-hand side (n,) or several (n, k)."""
        ...


class ScipyFactorization:
    """SuperLU without pivoting, on a symmetric minimum-degree ordering.

    Off the diagonal an M-matrix stays nonpositive while it is eliminated without pivoting, so that a nonnegative
    right-hand side is solved without a cancellation and small results keep their *relative* accuracy. Heat far away
    depends on that.

    Parameters
    ----------
    A : (n, n) sparse matrix
        Symmetric positive definite.

    Raises
    ------
    FactorizationError
        If A is singular or clearly indefinite.
    """

    backend = "scipy"

    def __init__(self, A: sp.csc_matrix) -> None:
        self._matrix = A
        try:
            self._factor = spl.splu(
                A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise FactorizationError(f"the matrix ({A.shape[0]} rows) could not be factored: {error}") from None
        _check_probe(self, A)

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b for one right-hand side (n,) or several (n, k)."""
        return np.asarray(self._factor.solve(np.ascontiguousarray(b)))

    def __reduce__(self) -> tuple[type[ScipyFactorization], tuple[sp.csc_matrix]]:
        return ScipyFactorization, (self._matrix,)


class CholespyFactorization:
    """CHOLMOD's simplicial Cholesky on a METIS nested dissection, as cholespy bundles it.

    Parameters
    ----------
    A : (n, n) sparse matrix
        Symmetric positive definite. As with `ScipyFactorization`, an M-matrix is factored without a cancellation.

    Raises
    ------
    FactorizationError
        If A is singular or not positive definite.
    """

    backend = "cholespy"

    def __init__(self, A: sp.csc_matrix) -> None:
        import cholespy

        self._matrix = A
        try:
            # Passed as the rows of the (symmetric) matrix: given columns, cholespy 2.2 sorts them in place and hands
            # the memory of the three arrays to realloc, which numpy still owns; rows it copies first.
            self._factor: Any = cholespy.CholeskySolverD(
                A.shape[0], A.indptr.astype(np.int32), A.indices.astype(np.int32), A.data, cholespy.MatrixType.CSR
            )
        except ValueError as error:
            raise FactorizationError(f"the matrix ({A.shape[0]} rows) could not be factored: {error}") from None
        _check_probe(self, A)

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b for one right-hand side (n,) or several (n, k)."""
        b = np.ascontiguousarray(b, dtype=np.float64)
        x = np.empty_like(b)
        # cholespy takes at most 128 right-hand sides at a time; more than 16 do not pay anyway.
        if b.ndim == 1 or b.shape[1] <= 16:
            self._factor.solve(b, x)
            return x
        for start in range(0, b.shape[1], 16):
            x[:, start : start + 16] = self.solve(b[:, start : start + 16])
        return x

    def __reduce__(self) -> tuple[type[CholespyFactorization], tuple[sp.csc_matrix]]:
        return CholespyFactorization, (self._matrix,)


def _check_probe(factorization: Factorization, A: sp.csc_matrix) -> None:
    """Solve for a vector of ones and for noise, which a singular or clearly indefinite matrix does not survive."""
    ones = np.ones(A.shape[0])
    noise = np.random.default_rng(0).standard_normal(A.shape[0])
    x = factorization.solve(np.stack([A @ ones, noise], axis=1))
    if not (np.abs(x[:, 0] - 1).max() < 0.1 and noise @ x[:, 1] > 0):
        raise FactorizationError(f"the matrix ({A.shape[0]} rows) is singular or not positive definite")


_BACKENDS: dict[str, type[ScipyFactorization] | type[CholespyFactorization]] = {
    "scipy": ScipyFactorization,
    "cholespy": CholespyFactorization,
}


def factorize(A: sp.csc_matrix, backend: Backend = "auto") -> Factorization:
    """Factor the symmetric positive definite matrix `A`.

    Parameters
    ----------
    A : (n, n) csc_matrix
        Both triangles stored.
    backend : {"auto", "scipy", "cholespy", "iterative"}
        "auto" takes cholespy where it is installed and scipy elsewhere; where factors would not fit into memory, by an
        estimate made before, it takes "iterative": nothing is factored, see `iterative`.

    Raises
    ------
    FactorizationError
        If A has entries that are not finite, or is not positive definite.
    MissingExtraError
        If the backend asked for is not installed.
    ValueError
        If there is no such backend.
    """
    if backend not in ("auto", "iterative", *_BACKENDS):
        raise ValueError(f"backend must be 'auto' or one of {sorted([*_BACKENDS, 'iterative'])}, not {backend!r}")
    if not np.isfinite(A.data).all():
        raise FactorizationError(
            f"{int((~np.isfinite(A.data)).sum())} entries of the matrix are not finite: the mesh has degenerate faces"
        )
    if backend == "iterative" or (backend == "auto" and has_iterative() and not factors_fit(A)):
        return iterative(A)
    installed = importlib.util.find_spec("cholespy") is not None
    if backend == "cholespy" and not installed:
        raise MissingExtraError.of('backend="cholespy"', "cholespy", "fast")
    if backend == "auto":
        backend = "cholespy" if installed else "scipy"
    return _BACKENDS[backend](A)
