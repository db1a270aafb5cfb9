"""The package's own factorization: multifrontal LDL^T (Duff and Reid 1983; Liu 1992) on a nested dissection.

Every block of the dissection is a *front*, a dense matrix over the columns of the block and the rows below that they
reach. The columns are eliminated in place and kept; the remainder, the update, is added to the parent's front. No
pivoting, for the reason that `SuperLUFactorization` gives.
"""

from __future__ import annotations

from importlib import import_module
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError
from heat_igl.kernels import builds
from heat_igl.kernels.signals import raise_caught
from heat_igl.linear.dissection import Fronts, dissect, fronts
from heat_igl.linear.protocols import check_finite, check_probe
from heat_igl.runtime import n_threads, pool, side_by_side
from heat_igl.typing import BoolArray, FloatArray, IntArray

# A pivot that has shrunk to less than this share of the diagonal is rounding.
_SINGULAR = 1e-13
# Peak memory of a factorization over that of its entries: 1.2 to 1.3 on surfaces of 40k to 160k vertices, 1.4 in a box
# of 30k, with one row per vertex or two.
_PEAK = 1.5

_elimination = import_module(builds("linear.multifrontal")[0])
_solves = import_module(builds("linear.substitution")[0])


class MultifrontalAnalysis:
    """Nested dissection and the fronts that it leads to."""

    backend = "multifrontal"

    def __init__(self, pattern: sp.csc_matrix) -> None:
        self._ends = pattern.indptr.astype(np.int32, copy=False)
        self._neighbours = pattern.indices.astype(np.int32, copy=False)
        with pool(n_threads()) as workers:
            tree = dissect(self._ends, self._neighbours, workers)
        self.fronts = fronts(self._ends, self._neighbours, tree)
        self.order: IntArray | None = self.fronts.order
        self.nonzeros = int(self.fronts.end_entry[-1])

    @property
    def two_factors_bytes(self) -> float:
        """Memory that two factors take while the second is made, which holds its updates beside its entries."""
        return 8.0 * self.nonzeros * (1.0 + _PEAK)

    def fits(self, A: sp.csc_matrix) -> bool:
        """Whether A has the pattern that was analysed."""
        own = self._ends, self._neighbours
        return all(a is b or np.array_equal(a, b) for a, b in zip(own, (A.indptr, A.indices), strict=True))

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> MultifrontalFactorization:
        """Factor `A`, or the principal submatrix on the vertices that are `free`."""
        if not self.fits(A):
            raise ValueError("A has another pattern than the matrix that was analysed: analyse A")
        return MultifrontalFactorization(self, A, free)

    def eliminate(self, A: sp.csc_matrix, free: BoolArray | None, entries: FloatArray) -> None:
        """Write the factor of `A` to `entries`; rows that are not free are those of the identity.

        Raises
        ------
        FactorizationError
            If A is not positive definite.
        """
        data = A.data.astype(np.float64, copy=False)
        is_free = np.ones(A.shape[0], np.uint8) if free is None else free.astype(np.uint8)
        failed = _elimination.factor(self._ends, self._neighbours, data, is_free, self.fronts, entries, _SINGULAR)
        if failed >= 0:
            raise_caught()
            raise FactorizationError(f"the matrix ({A.shape[0]} rows) is singular or not positive definite")


class MultifrontalFactorization:
    """LDL^T of a matrix; entries are stored front by front, as `Fronts` says."""

    backend = "multifrontal"

    def __init__(self, analysis: MultifrontalAnalysis, A: sp.csc_matrix, free: BoolArray | None) -> None:
        check_finite(A)
        self._arguments = analysis, A, free
        self._fronts = fronts = analysis.fronts
        self.nonzeros = int(fronts.end_entry[-1])
        self._held = fronts.place[:0] if free is None else fronts.place[~free]
        entries = np.empty(self.nonzeros)
        analysis.eliminate(A, free, entries)
        self._substitution = Substitution(fronts, entries)
        self.n_bytes = entries.nbytes + fronts.rows.nbytes + fronts.first_row.nbytes + fronts.first_entry.nbytes
        check_probe(self, A, free)

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b on the free vertices for one right-hand side (n,) or several (n, k); 0 on the others."""
        if b.ndim == 1:
            return self._solve_one(b)
        x = np.empty(b.shape)
        width = self._substitution.width
        for first in range(0, b.shape[1], width):
            columns = b[:, first : first + width]
            # A block costs as much as a few single columns, however many columns are used.
            if columns.shape[1] < self._substitution.few:
                for i in range(columns.shape[1]):
                    x[:, first + i] = self._solve_one(columns[:, i])
            else:
                self._solve_block(columns, x[:, first : first + width])
        return x

    def _solve_one(self, b: FloatArray) -> FloatArray:
        order = self._fronts.order
        x = np.empty(len(b))
        ordered = b[order].astype(np.float64, copy=False)
        ordered[self._held] = 0.0
        self._substitution.solve(ordered)
        x[order] = ordered
        return x

    def _solve_block(self, b: FloatArray, x: FloatArray) -> None:
        order = self._fronts.order
        block = np.zeros((len(order), self._substitution.width))
        block[:, : b.shape[1]] = b[order]
        block[self._held] = 0.0
        self._substitution.solve(block)
        x[order] = block[:, : b.shape[1]]

    def __reduce__(
        self,
    ) -> tuple[type[MultifrontalFactorization], tuple[MultifrontalAnalysis, sp.csc_matrix, BoolArray | None]]:
        return MultifrontalFactorization, self._arguments


class Substitution:
    """Forward substitution with a factor from the leaves of the tree of fronts to the roots, and back.

    The tree is cut into pieces, which are subtrees, and the few fronts above them. Pieces are independent: each stores
    its updates of the rows above in an array of its own, and these are summed in the order of the pieces. So pieces run
    in parallel, and the bits of a solution do not depend on the number of threads. `width` right-hand sides are solved
    together, and fewer than `few` faster one by one.
    """

    width: int = _solves.width
    few = 4

    def __init__(self, fronts: Fronts, L: FloatArray) -> None:
        self._kernel = _solves.Substitution(fronts, L)
        self._end_entry = fronts.end_entry
        self._above = np.flatnonzero(fronts.above >= 0)

    def solve(self, x: FloatArray) -> None:
        """Solve in place for x, (n,) or (n, width), in the order of elimination, on this thread's processors."""
        kernel = self._kernel
        forward, back = (
            (kernel.forward_one, kernel.back_one) if x.ndim == 1 else (kernel.forward_block, kernel.back_block)
        )
        last = len(self._end_entry) - 2
        k = max(1, min(n_threads(), last))
        shares = np.searchsorted(self._end_entry[:last], np.arange(k + 1) / k * self._end_entry[last])
        ranges = list(pairwise(shares))
        sums = np.zeros((last + 1, len(self._above), *x.shape[1:]))
        side_by_side(lambda pieces: forward(x, *pieces, sums), ranges)
        x[self._above] -= sums.sum(axis=0)
        forward(x, last, last + 1, sums)
        back(x, last, last + 1)
        side_by_side(lambda pieces: back(x, *pieces), ranges)
