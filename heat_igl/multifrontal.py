"""Multifrontal LDL^T factorization on a tree of separators (Duff and Reid 1983; Liu 1992).

Every block of the dissection is a *front*, a dense matrix over its own columns and the rows below that they reach. The
columns are eliminated in place and kept; what is left over, the update, is added to the parent's front. The factor is
stored by fronts, one row index for a whole front's columns, so that a solve reads little else than its numbers.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numba
import numpy as np

from heat_igl.dissection import Dissection
from heat_igl.fans import Function
from heat_igl.typing import AnyArray as IntArray  # of 32 bits too
from heat_igl.typing import BoolArray, FloatArray

__all__ = ["WIDTH", "Fronts", "factor", "fronts", "solve_block", "solve_one"]

# Right-hand sides that are solved together; known to the compiler.
WIDTH = 8
# Fewer are solved one by one.
FEW = 4
# A pivot that has shrunk to less than this share of the diagonal is rounding.
_SINGULAR = 1e-13
# Rows of an update that are finished before the next ones: with the factor's rows they fit in the second cache.
_ROWS = 192


def jit(function: Function) -> Function:
    """Compile with sums in any order and fused multiplications, which never add a cancellation."""
    options = {"reassoc", "contract", "nsz"}
    return cast(Function, numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=options)(function))


class Fronts(NamedTuple):
    """Where everything is in a factor: all that the pattern determines.

    Attributes
    ----------
    order, place : (n,) int32
        ``order[i]`` is eliminated as the i-th; `place` is the inverse.
    start : (k + 1,) int64
        Front b eliminates the columns start[b] to start[b + 1].
    parent : (k,) int64
        The front that takes the update; -1 at roots.
    first_row : (k + 1,) int64
        The rows of front b below its own columns are ``rows[first_row[b]:first_row[b + 1]]``, ascending.
    rows : (r,) int32
        Places in the order.
    first_entry : (k + 1,) int64
        Where the columns of each front are in the factor, one after the other, each from its diagonal on down.
    """

    order: IntArray
    place: IntArray
    start: IntArray
    parent: IntArray
    first_row: IntArray
    rows: IntArray
    first_entry: IntArray


@jit
def _rows(
    ends: IntArray, neighbours: IntArray, order: IntArray, place: IntArray, start: IntArray, parent: IntArray
) -> tuple[IntArray, IntArray]:
    """The rows of every front: neighbours of its columns, and rows of its children, that are eliminated later."""
    n, k = len(order), len(parent)
    first_row = np.zeros(k + 1, np.int64)
    rows = np.empty(4 * n + 16, np.int32)
    child, sibling = np.full(k, -1, np.int64), np.full(k, -1, np.int64)
    seen_by = np.full(n, -1, np.int64)
    count = 0
    for b in range(k):
        end = start[b + 1]
        if count + n > len(rows):
            longer = np.empty(2 * len(rows) + n, np.int32)
            longer[:count] = rows[:count]
            rows = longer
        for i in range(start[b], end):
            v = order[i]
            for p in range(ends[v], ends[v + 1]):
                row = place[neighbours[p]]
                if row >= end and seen_by[row] != b:
                    seen_by[row] = b
                    rows[count] = row
                    count += 1
        c = child[b]
        while c >= 0:
            for p in range(first_row[c], first_row[c + 1]):
                row = rows[p]
                if row >= end and seen_by[row] != b:
                    seen_by[row] = b
                    rows[count] = row
                    count += 1
            c = sibling[c]
        rows[first_row[b] : count].sort()
        first_row[b + 1] = count
        if parent[b] >= 0:
            sibling[b] = child[parent[b]]
            child[parent[b]] = b
    return first_row, rows[:count].copy()


def fronts(ends: IntArray, neighbours: IntArray, dissection: Dissection) -> Fronts:
    """Symbolic factorization of a symmetric pattern, as `dissect` takes it."""
    order, start, parent = dissection
    place = np.empty_like(order)
    place[order] = np.arange(len(order), dtype=order.dtype)
    first_row, rows = _rows(ends, neighbours, order, place, start, parent)
    columns = np.diff(start)
    first_entry = np.concatenate([[0], np.cumsum(columns * (columns + 1) // 2 + columns * np.diff(first_row))])
    return Fronts(order, place, start, parent, first_row, rows, first_entry)


@jit
def _at(column: int, row: int, size: int) -> int:
    """Where an entry on or below the diagonal is in the columns of a front with `size` rows."""
    return column * size - column * (column + 1) // 2 + row


@jit
def _subtract(c: FloatArray, a: FloatArray, size: int, row: int, factor_row: int, count: int) -> None:
    """Subtract from c the first `count` columns of the front a, from `row` on, as much as eliminates `factor_row`."""
    length = len(c)
    t = 0
    while t + 8 <= count:
        c0, f0 = a[_at(t, row, size) :], a[_at(t, factor_row, size)] * a[_at(t, t, size)]
        c1, f1 = a[_at(t + 1, row, size) :], a[_at(t + 1, factor_row, size)] * a[_at(t + 1, t + 1, size)]
        c2, f2 = a[_at(t + 2, row, size) :], a[_at(t + 2, factor_row, size)] * a[_at(t + 2, t + 2, size)]
        c3, f3 = a[_at(t + 3, row, size) :], a[_at(t + 3, factor_row, size)] * a[_at(t + 3, t + 3, size)]
        c4, f4 = a[_at(t + 4, row, size) :], a[_at(t + 4, factor_row, size)] * a[_at(t + 4, t + 4, size)]
        c5, f5 = a[_at(t + 5, row, size) :], a[_at(t + 5, factor_row, size)] * a[_at(t + 5, t + 5, size)]
        c6, f6 = a[_at(t + 6, row, size) :], a[_at(t + 6, factor_row, size)] * a[_at(t + 6, t + 6, size)]
        c7, f7 = a[_at(t + 7, row, size) :], a[_at(t + 7, factor_row, size)] * a[_at(t + 7, t + 7, size)]
        for i in range(length):
            c[i] -= ((c0[i] * f0 + c1[i] * f1) + (c2[i] * f2 + c3[i] * f3)) + (
                (c4[i] * f4 + c5[i] * f5) + (c6[i] * f6 + c7[i] * f7)
            )
        t += 8
    while t < count:
        column, factor = a[_at(t, row, size) :], a[_at(t, factor_row, size)] * a[_at(t, t, size)]
        for i in range(length):
            c[i] -= column[i] * factor
        t += 1


@jit
def _eliminate(panel: FloatArray, columns: int, size: int, update: FloatArray) -> bool:
    """LDL^T of the columns of a front in place, and what they subtract from the rest, stored by columns.

    Pivots stay on the diagonal. Taking their roots, as in Cholesky's form, would round once more.
    """
    for j in range(columns):
        column = panel[_at(j, j, size) : _at(j, size, size)]
        _subtract(column, panel, size, j, j, j)
        if not column[0] > 0.0:
            return False
        for i in range(1, len(column)):
            column[i] /= column[0]
    left = size - columns
    for low in range(0, left, _ROWS):
        high = min(low + _ROWS, left)
        for j in range(high):
            top = max(j, low)
            _subtract(update[j * left + top : j * left + high], panel, size, columns + top, columns + j, columns)
    return True


@jit
def _largest_stack(first_row: IntArray, parent: IntArray) -> int:
    """How many entries of updates wait at the same time."""
    k = len(parent)
    waiting_for = np.zeros(k, np.int64)
    waiting = largest = 0
    for b in range(k):
        own = (first_row[b + 1] - first_row[b]) ** 2
        largest = max(largest, waiting + own)
        waiting += own - waiting_for[b]
        if parent[b] >= 0:
            waiting_for[parent[b]] += own
    return int(largest)


@jit
def factor(ends: IntArray, neighbours: IntArray, data: FloatArray, free: BoolArray, f: Fronts, L: FloatArray) -> int:
    """Factor a matrix of the pattern that `f` was made for, into L; vertices that are not free keep an identity row.

    Returns -1, or the vertex at which the matrix turned out not to be positive definite.
    """
    n, k = len(f.order), len(f.parent)
    local = np.empty(n, np.int64)
    stack = np.empty(_largest_stack(f.first_row, f.parent))
    diagonal = np.empty(n)
    children = np.zeros(k, np.int64)
    waiting = np.empty(k, np.int64)  # fronts whose updates are on the stack, in its order
    top = n_waiting = 0
    for b in range(k):
        start, end = f.start[b], f.start[b + 1]
        columns = end - start
        rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
        left = len(rows)
        size = columns + left
        for i in range(left):
            local[rows[i]] = columns + i
        panel = L[f.first_entry[b] : f.first_entry[b + 1]]
        panel[:] = 0.0
        for j in range(columns):
            v = f.order[start + j]
            if not free[v]:
                panel[_at(j, j, size)] = 1.0
                continue
            for p in range(ends[v], ends[v + 1]):
                w = neighbours[p]
                row = f.place[w]
                if row >= start + j and free[w]:
                    panel[_at(j, row - start if row < end else local[row], size)] += data[p]
        for j in range(columns):
            diagonal[start + j] = panel[_at(j, j, size)]
        update = stack[top : top + left * left]
        update[:] = 0.0
        # The children's updates lie below, the last one uppermost.
        below = top
        for _ in range(children[b]):
            n_waiting -= 1
            c = waiting[n_waiting]
            its_rows = f.rows[f.first_row[c] : f.first_row[c + 1]]
            m = len(its_rows)
            below -= m * m
            for j in range(m):
                row = its_rows[j]
                column = stack[below + j * m : below + (j + 1) * m]
                if row < end:
                    at = _at(row - start, 0, size)
                    for i in range(j, m):
                        r = its_rows[i]
                        panel[at + (r - start if r < end else local[r])] += column[i]
                else:
                    at = (local[row] - columns) * left - columns
                    for i in range(j, m):
                        update[at + local[its_rows[i]]] += column[i]
        if not _eliminate(panel, columns, size, update):
            return int(f.order[start])
        for j in range(columns):
            if panel[_at(j, j, size)] < _SINGULAR * diagonal[start + j]:
                return int(f.order[start + j])
        for i in range(left * left):
            stack[below + i] = update[i]
        top = below + left * left
        if f.parent[b] >= 0:
            children[f.parent[b]] += 1
            waiting[n_waiting] = b
            n_waiting += 1
    return -1


@jit
def solve_one(f: Fronts, L: FloatArray, x: FloatArray) -> None:
    """Solve in place for x (n,), in the order of elimination."""
    k = len(f.parent)
    room = np.empty(len(x))
    for b in range(k):
        start, end = f.start[b], f.start[b + 1]
        rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
        columns, left = end - start, len(rows)
        at = f.first_entry[b]  # of the diagonal
        below = room[:left]
        below[:] = 0.0
        for j in range(columns):
            y = x[start + j]
            own = columns - j
            if y != 0.0:
                for i in range(1, own):
                    x[start + j + i] -= L[at + i] * y
                column = L[at + own : at + own + left]
                for i in range(left):
                    below[i] += column[i] * y
            at += own + left
        for i in range(left):
            x[rows[i]] -= below[i]
    for b in range(k - 1, -1, -1):
        start, end = f.start[b], f.start[b + 1]
        rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
        columns, left = end - start, len(rows)
        below = room[:left]
        for i in range(left):
            below[i] = x[rows[i]]
        at = f.first_entry[b + 1]
        for j in range(columns - 1, -1, -1):
            own = columns - j
            at -= own + left
            total = 0.0
            column = L[at + own : at + own + left]
            for i in range(left):
                total += column[i] * below[i]
            for i in range(1, own):
                total += L[at + i] * x[start + j + i]
            x[start + j] = x[start + j] / L[at] - total


@jit
def solve_block(f: Fronts, L: FloatArray, x: FloatArray) -> None:
    """Solve in place for x (n, WIDTH), in the order of elimination."""
    k = len(f.parent)
    room = np.empty((len(x), WIDTH))
    for b in range(k):
        start, end = f.start[b], f.start[b + 1]
        rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
        columns, left = end - start, len(rows)
        size = columns + left
        panel = L[f.first_entry[b] : f.first_entry[b + 1]]
        own, below = x[start:end], room[:left]
        for j in range(columns):
            for i in range(j + 1, columns):
                entry = panel[_at(j, i, size)]
                for c in range(WIDTH):
                    own[i, c] -= entry * own[j, c]
        below[:] = 0.0
        _forward(panel, columns, left, own, below)
        for i in range(left):
            for c in range(WIDTH):
                x[rows[i], c] -= below[i, c]
    for b in range(k - 1, -1, -1):
        start, end = f.start[b], f.start[b + 1]
        rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
        columns, left = end - start, len(rows)
        size = columns + left
        panel = L[f.first_entry[b] : f.first_entry[b + 1]]
        own, below = x[start:end], room[:left]
        for i in range(left):
            for c in range(WIDTH):
                below[i, c] = x[rows[i], c]
        for j in range(columns):
            pivot = panel[_at(j, j, size)]
            for c in range(WIDTH):
                own[j, c] /= pivot
        _backward(panel, columns, left, below, own)
        for j in range(columns - 1, -1, -1):
            for i in range(j + 1, columns):
                entry = panel[_at(j, i, size)]
                for c in range(WIDTH):
                    own[j, c] -= entry * own[i, c]


@jit
def _forward(panel: FloatArray, columns: int, left: int, own: FloatArray, below: FloatArray) -> None:
    """Add the rows below the columns of a front, times `own`, to `below`; four columns per turn."""
    size = columns + left
    j = 0
    while j + 4 <= columns:
        c0, c1 = panel[_at(j, columns, size) :], panel[_at(j + 1, columns, size) :]
        c2, c3 = panel[_at(j + 2, columns, size) :], panel[_at(j + 3, columns, size) :]
        x0, x1, x2, x3 = own[j], own[j + 1], own[j + 2], own[j + 3]
        for i in range(left):
            e0, e1, e2, e3 = c0[i], c1[i], c2[i], c3[i]
            for c in range(WIDTH):
                below[i, c] += (e0 * x0[c] + e1 * x1[c]) + (e2 * x2[c] + e3 * x3[c])
        j += 4
    while j < columns:
        c0, x0 = panel[_at(j, columns, size) :], own[j]
        for i in range(left):
            e0 = c0[i]
            for c in range(WIDTH):
                below[i, c] += e0 * x0[c]
        j += 1


@jit
def _backward(panel: FloatArray, columns: int, left: int, below: FloatArray, own: FloatArray) -> None:
    """Subtract the rows below the columns of a front, times `below`, from `own`; four rows per turn."""
    size = columns + left
    for j in range(columns):
        column, x = panel[_at(j, columns, size) :], own[j]
        i = 0
        while i + 4 <= left:
            e0, e1, e2, e3 = column[i], column[i + 1], column[i + 2], column[i + 3]
            b0, b1, b2, b3 = below[i], below[i + 1], below[i + 2], below[i + 3]
            for c in range(WIDTH):
                x[c] -= (e0 * b0[c] + e1 * b1[c]) + (e2 * b2[c] + e3 * b3[c])
            i += 4
        while i < left:
            e0, b0 = column[i], below[i]
            for c in range(WIDTH):
                x[c] -= e0 * b0[c]
            i += 1
