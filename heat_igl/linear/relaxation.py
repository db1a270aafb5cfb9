"""Kernel of the relaxation: a band of unknowns that moves outward from the right-hand side."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic.fans import jit
from heat_igl.typing import AnyArray, FloatArray

__all__ = ["relax"]


@jit
def _breadth_first(indptr: AnyArray, indices: AnyArray, b: FloatArray) -> tuple[AnyArray, AnyArray]:
    """Unknowns that b reaches, outward from its entries, and where each level starts in that order."""
    n = len(b)
    order = np.empty(n, np.int32)
    start = np.zeros(n + 2, np.int32)
    seen = np.zeros(n, np.bool_)
    end = 0
    for i in range(n):
        if b[i] > 0.0:
            order[end] = i
            seen[i] = True
            end += 1
    start[1] = end
    n_levels = 1
    while start[n_levels] > start[n_levels - 1]:
        for position in range(start[n_levels - 1], start[n_levels]):
            i = order[position]
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if not seen[j]:
                    seen[j] = True
                    order[end] = j
                    end += 1
        n_levels += 1
        start[n_levels] = end
    return order[:end].copy(), start[:n_levels].copy()


@jit
def _arranged(
    indptr: AnyArray, indices: AnyArray, data: FloatArray, b: FloatArray, order: AnyArray
) -> tuple[AnyArray, AnyArray, FloatArray, FloatArray]:
    """Jacobi's form x = C x + c of A x = b, in the given order, so that a sweep reads memory forward."""
    position = np.empty(len(b), np.int32)
    size = 0
    for p in range(len(order)):
        position[order[p]] = p
        size += indptr[order[p] + 1] - indptr[order[p]]
    row = np.empty(len(order) + 1, np.int64)
    column = np.empty(size, np.int32)
    C = np.empty(size, np.float64)
    c = np.empty(len(order), np.float64)
    end = 0
    for p in range(len(order)):
        i = order[p]
        row[p] = end
        diagonal = 1.0
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] == i:
                diagonal = data[k]
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] != i:
                column[end] = position[indices[k]]
                C[end] = -data[k] / diagonal
                end += 1
        c[p] = b[i] / diagonal
    row[len(order)] = end
    return row, column, C, c


@jit
def relax(
    indptr: AnyArray,
    indices: AnyArray,
    data: FloatArray,
    b: FloatArray,
    tolerance: float,
    most_sweeps: int,
) -> tuple[FloatArray, int]:
    """Solve A x = b >= 0 by Gauss-Seidel in breadth-first order from where b > 0, with x zero at first.

    A sweep goes over a band of levels, outward. Its outer end moves on by one level per sweep; its inner end follows,
    one level behind the first unknown that changed by more than `tolerance` of itself. The result is accepted by a
    sweep over all unknowns that changes none. Returns x (n,) and the number of sweeps, -1 if they did not suffice.
    """
    order, start = _breadth_first(indptr, indices, b)
    row, column, C, c = _arranged(indptr, indices, data, b, order)
    n_levels = len(start) - 1
    y = np.zeros(len(order))
    level = 0
    reached = 1
    n_sweeps = -1
    for sweep in range(most_sweeps):
        inner, outer = start[max(level - 1, 0)], start[reached]
        first = outer
        for p in range(inner, outer):
            new = c[p]
            for k in range(row[p], row[p + 1]):
                new += C[k] * y[column[k]]
            if first == outer and abs(new - y[p]) > tolerance * abs(new):
                first = p
            y[p] = new
        if reached < n_levels:
            reached += 1
        elif first == outer:
            if inner == 0:
                n_sweeps = sweep + 1
                break
            level = 0
            continue
        while level < n_levels - 1 and start[level + 1] <= first:
            level += 1
    x = np.zeros(len(b))
    for p in range(len(order)):
        x[order[p]] = y[p]
    return x, n_sweeps
