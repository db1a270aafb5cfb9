"""Solves with a multifrontal factor: forward from the leaves of the tree of fronts to its roots, and back.

The tree is cut into pieces, subtrees, and the few fronts above them. Pieces know nothing of one another: what one
subtracts from the rows above, it keeps to itself, and the sum is taken in the order of the pieces. So they run side by
side, and the bits of a solution do not depend on the number of threads.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from heat_igl.linear.multifrontal import Fronts, in_panel, jit
from heat_igl.runtime import n_threads, side_by_side
from heat_igl.runtime.prefetch import prefetch
from heat_igl.typing import FloatArray

__all__ = ["FEW", "WIDTH", "substitute"]

# Right-hand sides that are solved together; known to the compiler.
WIDTH = 8
# Fewer are solved one by one.
FEW = 4
# Entries of the factor, which lie behind on the way forward, that are fetched before they are needed.
_AHEAD = 512


def substitute(f: Fronts, L: FloatArray, x: FloatArray) -> None:
    """Solve in place for x, (n,) or (n, WIDTH), in the order of elimination, on this thread's share of processors."""
    forward, back = (_forward_one, _back_one) if x.ndim == 1 else (_forward_block, _back_block)
    last = len(f.piece_end) - 2
    k = max(1, min(n_threads(), last))
    shares = np.searchsorted(f.end_entry[:last], np.arange(k + 1) / k * f.end_entry[last])
    ranges = list(pairwise(shares))
    sums = np.zeros((last + 1, int(f.above.max()) + 1, *x.shape[1:]))
    side_by_side(lambda pieces: forward(f, L, x, *pieces, sums), ranges)
    x[f.above >= 0] -= sums.sum(axis=0)
    forward(f, L, x, last, last + 1, sums)
    back(f, L, x, last, last + 1)
    side_by_side(lambda pieces: back(f, L, x, *pieces), ranges)


@jit
def _forward_one(f: Fronts, L: FloatArray, x: FloatArray, first: int, until: int, sums: FloatArray) -> None:
    """Eliminate the columns of some pieces from x (n,); `sums` takes what each subtracts from the rows above."""
    room = np.empty(len(x))
    for piece in range(first, until):
        for b in f.pieces[f.piece_end[piece] : f.piece_end[piece + 1]]:
            start, end = f.start[b], f.start[b + 1]
            rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
            columns, left = end - start, len(rows)
            # Of a source's heat, most fronts have none on the way forward.
            nothing = True
            for j in range(start, end):
                nothing &= x[j] == 0.0
            if nothing:
                continue
            at = f.first_entry[b]  # of the diagonal
            ahead = at - _AHEAD
            below = room[:left]
            below[:] = 0.0
            for j in range(columns):
                y = x[start + j]
                own = columns - j
                for i in range(0, own + left, 8):
                    prefetch(L, ahead - i)
                ahead -= own + left
                for i in range(1, own):
                    x[start + j + i] -= L[at + i] * y
                column = L[at + own : at + own + left]
                for i in range(left):
                    below[i] += column[i] * y
                at += own + left
            for i in range(f.own_rows[b]):
                x[rows[i]] -= below[i]
            for i in range(f.own_rows[b], left):
                sums[piece, f.above[rows[i]]] += below[i]


@jit
def _back_one(f: Fronts, L: FloatArray, x: FloatArray, first: int, until: int) -> None:
    """Solve for the columns of some pieces in x (n,), given those above."""
    room = np.empty(len(x))
    for b in f.pieces[f.piece_end[first] : f.piece_end[until]][::-1]:
        start, end = f.start[b], f.start[b + 1]
        rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
        columns, left = end - start, len(rows)
        below = room[:left]
        for i in range(left):
            below[i] = x[rows[i]]
        at = f.first_entry[b]
        for j in range(columns):
            own = columns - j
            total = 0.0
            column = L[at + own : at + own + left]
            for i in range(left):
                total += column[i] * below[i]
            x[start + j] = x[start + j] / L[at] - total
            at += own + left
        for j in range(columns - 1, -1, -1):
            own = columns - j
            at -= own + left
            total = 0.0
            for i in range(1, own):
                total += L[at + i] * x[start + j + i]
            x[start + j] -= total


@jit
def _forward_block(f: Fronts, L: FloatArray, x: FloatArray, first: int, until: int, sums: FloatArray) -> None:
    """As `_forward_one`, for x (n, WIDTH)."""
    room = np.empty((len(x), WIDTH))
    for piece in range(first, until):
        for b in f.pieces[f.piece_end[piece] : f.piece_end[piece + 1]]:
            start, end = f.start[b], f.start[b + 1]
            rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
            columns, left = end - start, len(rows)
            size = columns + left
            panel = L[f.first_entry[b] :]
            own, below = x[start:end], room[:left]
            nothing = True
            for j in range(columns):
                for c in range(WIDTH):
                    nothing &= own[j, c] == 0.0
            if nothing:
                continue
            for j in range(columns):
                for i in range(j + 1, columns):
                    entry = panel[in_panel(j, i, size)]
                    for c in range(WIDTH):
                        own[i, c] -= entry * own[j, c]
            below[:] = 0.0
            _add_below(panel, columns, left, own, below)
            for i in range(f.own_rows[b]):
                for c in range(WIDTH):
                    x[rows[i], c] -= below[i, c]
            for i in range(f.own_rows[b], left):
                for c in range(WIDTH):
                    sums[piece, f.above[rows[i]], c] += below[i, c]


@jit
def _back_block(f: Fronts, L: FloatArray, x: FloatArray, first: int, until: int) -> None:
    """As `_back_one`, for x (n, WIDTH)."""
    room = np.empty((len(x), WIDTH))
    for b in f.pieces[f.piece_end[first] : f.piece_end[until]][::-1]:
        start, end = f.start[b], f.start[b + 1]
        rows = f.rows[f.first_row[b] : f.first_row[b + 1]]
        columns, left = end - start, len(rows)
        size = columns + left
        panel = L[f.first_entry[b] :]
        own, below = x[start:end], room[:left]
        for i in range(left):
            for c in range(WIDTH):
                below[i, c] = x[rows[i], c]
        for j in range(columns):
            pivot = panel[in_panel(j, j, size)]
            for c in range(WIDTH):
                own[j, c] /= pivot
        _subtract_below(panel, columns, left, below, own)
        for j in range(columns - 1, -1, -1):
            for i in range(j + 1, columns):
                entry = panel[in_panel(j, i, size)]
                for c in range(WIDTH):
                    own[j, c] -= entry * own[i, c]


@jit
def _add_below(panel: FloatArray, columns: int, left: int, own: FloatArray, below: FloatArray) -> None:
    """Add the rows below the columns of a front, times `own`, to `below`; four columns per turn."""
    size = columns + left
    j = 0
    while j + 4 <= columns:
        c0, c1 = panel[in_panel(j, columns, size) :], panel[in_panel(j + 1, columns, size) :]
        c2, c3 = panel[in_panel(j + 2, columns, size) :], panel[in_panel(j + 3, columns, size) :]
        x0, x1, x2, x3 = own[j], own[j + 1], own[j + 2], own[j + 3]
        for i in range(left):
            e0, e1, e2, e3 = c0[i], c1[i], c2[i], c3[i]
            for c in range(WIDTH):
                below[i, c] += (e0 * x0[c] + e1 * x1[c]) + (e2 * x2[c] + e3 * x3[c])
        j += 4
    while j < columns:
        c0, x0 = panel[in_panel(j, columns, size) :], own[j]
        for i in range(left):
            e0 = c0[i]
            for c in range(WIDTH):
                below[i, c] += e0 * x0[c]
        j += 1


@jit
def _subtract_below(panel: FloatArray, columns: int, left: int, below: FloatArray, own: FloatArray) -> None:
    """Subtract the rows below the columns of a front, times `below`, from `own`; four rows per turn."""
    size = columns + left
    for j in range(columns):
        column, x = panel[in_panel(j, columns, size) :], own[j]
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
