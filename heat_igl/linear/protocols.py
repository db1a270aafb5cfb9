"""Interfaces of a linear solver: an analysis of a pattern, and a factorization of a matrix."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError
from heat_igl.typing import BoolArray, FloatArray, IntArray


class Factorization(Protocol):
    """A factored principal submatrix of a matrix A (n, n).

    Attributes
    ----------
    backend : str
        Storage of the factor.
    """

    backend: str

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b on the free vertices for one right-hand side (n,) or several (n, k); 0 on the others."""
        ...


class Analysis(Protocol):
    """Data from the pattern of a matrix alone: an order of elimination, and the pattern of the factor.

    Attributes
    ----------
    backend : str
        The solver that factors the matrices.
    order : (n,) int32, optional
        ``order[i]`` is eliminated as the i-th; neighbours mostly are near each other in it. None if that is not known.
    """

    backend: str
    order: IntArray | None

    def fits(self, A: sp.csc_matrix) -> bool:
        """Whether A has the pattern that was analysed."""
        ...

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> Factorization:
        """Factor `A`, or the principal submatrix on the vertices that are `free`; errors as for the function."""
        ...


def check_finite(A: sp.csc_matrix) -> None:
    """Raise a `FactorizationError` if an entry of A is not finite."""
    if not np.isfinite(A.data).all():
        raise FactorizationError(
            f"{int((~np.isfinite(A.data)).sum())} entries of the matrix are not finite: the mesh has degenerate faces"
        )


def check_probe(
    factorization: Factorization, A: sp.csc_matrix, free: BoolArray | None, indefinite: bool = False
) -> None:
    """Solve for a known solution, of ones, to find a singular matrix, and for noise if A may be indefinite.

    A FactorizationError if A turns out not to be positive definite.
    """
    n = A.shape[0]
    ones = np.ones(n) if free is None else free.astype(np.float64)
    broken = not np.abs(factorization.solve(A @ ones) - ones).max() < 0.1
    if indefinite and not broken:
        noise = np.random.default_rng(0).standard_normal(n) * ones
        broken = not noise @ factorization.solve(noise) > 0
    if broken:
        raise FactorizationError(f"the matrix ({n} rows) is singular or not positive definite")
