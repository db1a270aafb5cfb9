"""Kernel of the relaxation: a band of unknowns that moves outward from the right-hand side."""

from __future__ import annotations

import numpy as np

from heat_igl.fans import jit
from heat_igl.typing import AnyArray, FloatArray

__all__ = ["relax"]


@jit
def relax(
    indptr: AnyArray,
    indices: AnyArray,
    data: FloatArray,
    b: FloatArray,
    x: FloatArray,
    tolerance: float,
    most_sweeps: int,
) -> int:
    """Solve for `x` (n,), zero at first, by Gauss-Seidel in breadth-first order from where b > 0.

    A sweep goes over a band of levels, outward. Its outer end moves on by one level per sweep; its inner end follows,
    one level behind the first unknown that changed by more than `tolerance` of itself. The result is accepted by a
    sweep over all unknowns that changes none. Returns the number of sweeps, -1 if `most_sweeps` did not suffice.
    """
    n = len(b)
    order = np.empty(n, np.int32)
    start = np.zeros(n + 2, np.int32)  # of each level, in `order`
    seen = np.zeros(n, np.bool_)
    outer = 0
    for i in range(n):
        if b[i] > 0.0:
            order[outer] = i
            seen[i] = True
            outer += 1
    start[1] = outer
    n_levels = 1
    level = 0
    for sweep in range(most_sweeps):
        inner = start[max(level - 1, 0)]
        first = outer
        for position in range(inner, outer):
            i = order[position]
            old = x[i]
            total = b[i]
            diagonal = 1.0
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if j == i:
                    diagonal = data[k]
                else:
                    total -= data[k] * x[j]
            new = total / diagonal
            if first == outer and abs(new - old) > tolerance * abs(new):
                first = position
            x[i] = new
        if start[n_levels] > start[n_levels - 1]:
            for position in range(start[n_levels - 1], start[n_levels]):
                i = order[position]
                for k in range(indptr[i], indptr[i + 1]):
                    j = indices[k]
                    if not seen[j]:
                        seen[j] = True
                        order[outer] = j
                        outer += 1
            n_levels += 1
            start[n_levels] = outer
        elif first == outer:
            if inner == 0:
                return sweep + 1
            level = 0
            continue
        while level < n_levels - 1 and start[level + 1] <= first:
            level += 1
    return -1
