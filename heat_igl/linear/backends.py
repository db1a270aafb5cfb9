"""Which linear solver factors a matrix.

`analyse` looks at the pattern alone; the result factors every matrix of that pattern, and principal submatrices,
so that the heat and the Poisson problem share one ordering. Each backend is one small class of analysis and one of
factorization in a separate file.

Libraries that were tried and left: cholespy holds the interpreter's lock and orders each matrix anew; cvxopt and
scikit-sparse are GPL; MKL's PARDISO is proprietary and for one kind of processor.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import require_choice
from heat_igl.linear.multifrontal import MultifrontalAnalysis
from heat_igl.linear.protocols import Analysis, Factorization
from heat_igl.linear.superlu import SuperLUAnalysis
from heat_igl.plan import MOST_FILL, SMALLEST_MULTIFRONTAL
from heat_igl.runtime import available_memory
from heat_igl.typing import BoolArray

# Bytes per row of each of two factors while they are made, on log2 n and on n^(1/3): the multifrontal ones of spheres
# and tori of 150k vertices took 25 to 37, those of a box of 30k vertices 35. Rather too much than too little.
_BYTES_SURFACE = 45.0
_BYTES_VOLUME = 100.0

Backend = Literal["auto", "scipy", "multifrontal"]
_ANALYSES: dict[str, Callable[[sp.csc_matrix], Analysis]] = {
    "scipy": SuperLUAnalysis,
    "multifrontal": MultifrontalAnalysis,
}


def factor_bytes(n: int, n_entries: int) -> float:
    """An estimate of the memory that a factor of an (n, n) matrix takes while it is made, before it is.

    Nested dissection leaves of the order of n log n entries on surfaces and n^(4/3) in volumes. The average row tells
    which: by Euler's formula it has 7 entries on a triangulated surface, and 13 to 15 in a volume. (A lattice of right
    angles, whose diagonals weigh nothing, is taken for a surface.)
    """
    return float(
        n * (_BYTES_VOLUME * n ** (1 / 3) if is_of_volume(n, n_entries) else _BYTES_SURFACE * np.log2(max(n, 2)))
    )


def is_of_volume(n: int, n_entries: int) -> bool:
    """Whether an (n, n) matrix with so many entries is taken for that of a volume."""
    return n_entries > 10 * n


def analyse(pattern: sp.csc_matrix, backend: Backend = "auto") -> Analysis:
    """Order and analyse symmetric matrices of a pattern (n, n) with both triangles stored; the values do not matter.

    The backend is SuperLU ("scipy"), or the package's own factorization ("multifrontal"), which "auto" takes if the
    matrix is not small and the order of elimination good. A MemoryError if two factors, of heat and of Poisson's
    problem, would not fit into the memory available now, by counts of their entries; not if a backend is named. A
    ValueError if there is no such backend.
    """
    require_choice("backend", backend, get_args(Backend))
    if getattr(pattern, "format", None) != "csc":
        raise ValueError(
            f"the matrix must be a scipy.sparse.csc_matrix, not {type(pattern).__name__}: csc_matrix(A) is"
        )
    n = pattern.shape[0]
    if backend != "auto" or n < SMALLEST_MULTIFRONTAL:
        return _ANALYSES["scipy" if backend == "auto" else backend](pattern)
    found = MultifrontalAnalysis(pattern)
    if found.nonzeros > MOST_FILL * n * np.log2(n) and not is_of_volume(n, pattern.nnz):
        return SuperLUAnalysis(pattern)
    needed, there = found.two_factors_bytes, available_memory()
    if needed > there:
        raise MemoryError(
            f"two factors of {n} rows take about {needed / 2**30:.1f} GiB, and {there / 2**30:.1f} GiB are available: "
            "take GeodesicSolver, which factors nothing, or name a backend to try it all the same"
        )
    return found


def factorize(A: sp.csc_matrix, backend: Backend = "auto", free: BoolArray | None = None) -> Factorization:
    """Factor the symmetric positive definite matrix `A`, or a principal submatrix of it.

    Parameters
    ----------
    A : (n, n) csc_matrix
        Both triangles stored.
    backend : {"auto", "scipy", "multifrontal"}
        See `analyse`.
    free : (n,) bool, optional
        Rows and columns to keep, all by default.

    Raises
    ------
    FactorizationError
        If A has entries that are not finite, or is not positive definite.
    ValueError
        As for `analyse`.
    """
    return analyse(A, backend).factorize(A, free)
