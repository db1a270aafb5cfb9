"""Multifrontal LDL^T factorization on a tree of separators (Duff and Reid 1983; Liu 1992).

Every block of the dissection is a *front*, a dense matrix over its own columns and the rows below that they reach. The
columns are eliminated in place and kept; what is left over, the update, is added to the parent's front. The factor is
stored by fronts, one row index for a whole front's columns, so that a solve reads little else than its numbers.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numba
import numpy as np

from heat_igl.intrinsic.fans import Function
from heat_igl.linear.dissection import Dissection
from heat_igl.typing import AnyArray as IntArray  # of 32 bits too
from heat_igl.typing import BoolArray, FloatArray

__all__ = ["Fronts", "factor", "fronts", "in_panel", "jit"]

# A pivot that has shrunk to less than this share of the diagonal is rounding.
_SINGULAR = 1e-13
# Rows of an update that are finished before the next ones: with the factor's rows they fit in the second cache.
_ROWS = 192
# Pieces of the tree that are solved side by side, about; and the entries that are worth a thread.
_PIECES = 6
_SMALLEST_PIECE = 1_500_000


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
    first_entry : (k,) int64
        Where the columns of a front begin in the factor, one after the other, each from its diagonal on down. The
        fronts lie there in the order back from the roots, as ascending memory is read fastest, and a single source's
        heat skips most of the way forward.
    pieces : (k,) int64
        Fronts by piece of the tree, ascending within each.
    piece_end : (p + 2,) int64
        Piece i is ``pieces[piece_end[i]:piece_end[i + 1]]``; neighbours of its columns are in it or in the last one,
        piece p, which holds the fronts above all others.
    end_entry : (p + 1,) int64
        Entries of the factor before each piece.
    own_rows : (k,) int64
        How many of a front's rows are in its own piece; the rest are in piece p.
    above : (n,) int32
        Numbers the columns of piece p; -1 elsewhere.
    """

    order: IntArray
    place: IntArray
    start: IntArray
    parent: IntArray
    first_row: IntArray
    rows: IntArray
    first_entry: IntArray
    pieces: IntArray
    piece_end: IntArray
    end_entry: IntArray
    own_rows: IntArray
    above: IntArray


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


@jit
def _pieces(parent: IntArray, entries: IntArray) -> tuple[int, IntArray]:
    """The number of pieces, and that of each front: subtrees of about one size, small ones together.

    What is above them all is numbered as one more.
    """
    k = len(parent)
    below = entries.copy()
    for b in range(k):
        if parent[b] >= 0:
            below[parent[b]] += below[b]
    most = max(entries.sum() / _PIECES, _SMALLEST_PIECE)
    piece = np.full(k, -1, np.int64)
    count = held = 0
    for b in range(k - 1, -1, -1):
        if below[b] > most:
            continue
        if parent[b] >= 0 and piece[parent[b]] >= 0:
            piece[b] = piece[parent[b]]
            continue
        held += below[b]
        if count == 0 or held > most:
            count += 1
            held = below[b]
        piece[b] = count - 1
    for b in range(k):
        if piece[b] < 0:
            piece[b] = count
    return count, piece


def fronts(ends: IntArray, neighbours: IntArray, dissection: Dissection) -> Fronts:
    """Symbolic factorization of a symmetric pattern, as `dissect` takes it."""
    order, start, parent = dissection
    place = np.empty_like(order)
    place[order] = np.arange(len(order), dtype=order.dtype)
    first_row, rows = _rows(ends, neighbours, order, place, start, parent)
    columns = np.diff(start)
    entries = columns * (columns + 1) // 2 + columns * np.diff(first_row)
    last, piece = _pieces(parent, entries)
    pieces = np.argsort(piece, kind="stable")
    piece_end = np.searchsorted(piece[pieces], np.arange(last + 2))
    end_entry = np.concatenate([[0], np.cumsum(entries[pieces])])
    first_entry = np.empty_like(entries)
    first_entry[pieces] = end_entry[-1] - end_entry[1:]
    is_above = np.repeat(piece == last, columns)
    above = np.where(is_above, np.cumsum(is_above) - 1, -1).astype(np.int32)
    # Ancestors ascend, so the rows of a front's own piece come first.
    rows_above = np.diff(np.concatenate([[0], np.cumsum(is_above[rows])])[first_row])
    own_rows = np.diff(first_row) - np.where(piece < last, rows_above, 0)
    return Fronts(
        order,
        place,
        start,
        parent,
        first_row,
        rows,
        first_entry,
        pieces,
        piece_end,
        end_entry[piece_end],
        own_rows,
        above,
    )


@jit
def in_panel(column: int, row: int, size: int) -> int:
    """Where an entry on or below the diagonal is in the columns of a front with `size` rows."""
    return column * size - column * (column + 1) // 2 + row


@jit
def _subtract(c: FloatArray, a: FloatArray, size: int, row: int, factor_row: int, count: int) -> None:
    """Subtract from c the first `count` columns of the front a, from `row` on, as much as eliminates `factor_row`."""
    length = len(c)
    t = 0
    while t + 8 <= count:
        c0, f0 = a[in_panel(t, row, size) :], a[in_panel(t, factor_row, size)] * a[in_panel(t, t, size)]
        c1, f1 = a[in_panel(t + 1, row, size) :], a[in_panel(t + 1, factor_row, size)] * a[in_panel(t + 1, t + 1, size)]
        c2, f2 = a[in_panel(t + 2, row, size) :], a[in_panel(t + 2, factor_row, size)] * a[in_panel(t + 2, t + 2, size)]
        c3, f3 = a[in_panel(t + 3, row, size) :], a[in_panel(t + 3, factor_row, size)] * a[in_panel(t + 3, t + 3, size)]
        c4, f4 = a[in_panel(t + 4, row, size) :], a[in_panel(t + 4, factor_row, size)] * a[in_panel(t + 4, t + 4, size)]
        c5, f5 = a[in_panel(t + 5, row, size) :], a[in_panel(t + 5, factor_row, size)] * a[in_panel(t + 5, t + 5, size)]
        c6, f6 = a[in_panel(t + 6, row, size) :], a[in_panel(t + 6, factor_row, size)] * a[in_panel(t + 6, t + 6, size)]
        c7, f7 = a[in_panel(t + 7, row, size) :], a[in_panel(t + 7, factor_row, size)] * a[in_panel(t + 7, t + 7, size)]
        for i in range(length):
            c[i] -= ((c0[i] * f0 + c1[i] * f1) + (c2[i] * f2 + c3[i] * f3)) + (
                (c4[i] * f4 + c5[i] * f5) + (c6[i] * f6 + c7[i] * f7)
            )
        t += 8
    while t < count:
        column, factor = a[in_panel(t, row, size) :], a[in_panel(t, factor_row, size)] * a[in_panel(t, t, size)]
        for i in range(length):
            c[i] -= column[i] * factor
        t += 1


@jit
def _eliminate(panel: FloatArray, columns: int, size: int, update: FloatArray) -> bool:
    """LDL^T of the columns of a front in place, and what they subtract from the rest, stored by columns.

    Pivots stay on the diagonal. Taking their roots, as in Cholesky's form, would round once more.
    """
    for j in range(columns):
        column = panel[in_panel(j, j, size) : in_panel(j, size, size)]
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
        panel = L[f.first_entry[b] : f.first_entry[b] + columns * size - columns * (columns - 1) // 2]
        panel[:] = 0.0
        for j in range(columns):
            v = f.order[start + j]
            if not free[v]:
                panel[in_panel(j, j, size)] = 1.0
                continue
            for p in range(ends[v], ends[v + 1]):
                w = neighbours[p]
                row = f.place[w]
                if row >= start + j and free[w]:
                    panel[in_panel(j, row - start if row < end else local[row], size)] += data[p]
        for j in range(columns):
            diagonal[start + j] = panel[in_panel(j, j, size)]
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
                    at = in_panel(row - start, 0, size)
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
            if panel[in_panel(j, j, size)] < _SINGULAR * diagonal[start + j]:
                return int(f.order[start + j])
        for i in range(left * left):
            stack[below + i] = update[i]
        top = below + left * left
        if f.parent[b] >= 0:
            children[f.parent[b]] += 1
            waiting[n_waiting] = b
            n_waiting += 1
    return -1
