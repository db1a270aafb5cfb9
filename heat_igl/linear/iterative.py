"""The backend without factors, for systems too large to factor: relaxation for heat, multigrid for Poisson."""

from __future__ import annotations

import importlib.util

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError
from heat_igl.linear.multigrid import Multigrid
from heat_igl.linear.relaxation import Relaxation
from heat_igl.typing import BoolArray, IntArray

__all__ = ["IterativeAnalysis", "has_iterative", "iterative"]

# A matrix has an excess of the diagonal in every row, or it does not; this is rounding.
_EXCESS = 1e-13


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
        """See `iterative`."""
        return iterative(A, free)


def iterative(A: sp.csc_matrix, free: BoolArray | None = None) -> Relaxation | Multigrid:
    """A solver for `A` without factors: `Relaxation` if each diagonal entry exceeds the rest of its row, as in
    a step of heat flow, and `Multigrid` if rows sum to zero, as in a Poisson problem.

    Parameters
    ----------
    A : (n, n) csc_matrix
        Symmetric, both triangles stored.
    free : (n,) bool, optional
        Rows and columns to keep; solutions are 0 on the others.

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
    """Whether the library that `iterative` needs is installed."""
    return importlib.util.find_spec("pyamg") is not None
