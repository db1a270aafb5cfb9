"""Solves with a multifrontal factor: forward from the leaves of the tree of fronts to the roots, and back.

The tree is cut into pieces, which are subtrees, and the few fronts above them. Pieces are independent: each stores its
updates of the rows above in an array of its own, and these are summed in the order of the pieces. So pieces run in
parallel, and the bits of a solution do not depend on the number of threads.
"""

from __future__ import annotations

from importlib import import_module
from itertools import pairwise

import numpy as np

from heat_igl.kernels import builds
from heat_igl.linear.fronts import Fronts
from heat_igl.runtime import n_threads, side_by_side
from heat_igl.typing import FloatArray

__all__ = ["Substitution"]

_kernel = import_module(builds("linear.substitution")[0])


class Substitution:
    """Forward and back substitution with a factor.

    Parameters
    ----------
    fronts : Fronts
        Layout of the factor.
    L : (entries,) float64
        The factor.

    Attributes
    ----------
    width : int
        Right-hand sides that are solved together.
    few : int
        Fewer right-hand sides than this are solved faster one by one.
    """

    width: int = _kernel.width
    few = 4

    def __init__(self, fronts: Fronts, L: FloatArray) -> None:
        self._kernel = _kernel.Substitution(fronts, L)
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
