"""Factorization by SuperLU, which comes with scipy."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError
from heat_igl.linear.protocols import check_finite, check_probe
from heat_igl.typing import BoolArray, FloatArray, IntArray


class SuperLUAnalysis:
    """SuperLU orders the matrix while it factors it, so there is nothing to keep."""

    backend = "scipy"
    order: IntArray | None = None

    def __init__(self, pattern: sp.csc_matrix) -> None:
        pass

    def fits(self, A: sp.csc_matrix) -> bool:  # noqa: ARG002 - the protocol's
        """Whether A has the pattern that was analysed: any matrix will do."""
        return True

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> SuperLUFactorization:
        """Factor `A`, or the principal submatrix on the vertices that are `free`."""
        return SuperLUFactorization(A, free)


class SuperLUFactorization:
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
        check_finite(restricted)
        from scipy.sparse import linalg as spl

        try:
            self._factor = spl.splu(
                restricted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise FactorizationError(
                f"the matrix ({restricted.shape[0]} rows) could not be factored: {error}"
            ) from None
        check_probe(self, A, free, indefinite=True)

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b on the free vertices for one right-hand side (n,) or several (n, k); 0 on the others."""
        if self._free is None:
            return np.asarray(self._factor.solve(np.ascontiguousarray(b)))
        x = np.zeros_like(b)
        x[self._free] = self._factor.solve(np.ascontiguousarray(b[self._free]))
        return x

    def __reduce__(self) -> tuple[type[SuperLUFactorization], tuple[sp.csc_matrix, BoolArray | None]]:
        return SuperLUFactorization, self._arguments
