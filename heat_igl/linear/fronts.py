"""Symbolic factorization: the layout of a multifrontal factor, and the pieces in which it is solved.

The factor is stored by fronts, one row index for all columns of a front, so that a solve reads little else than the
numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.kernels.linear import symbolic
from heat_igl.linear.dissection import Dissection
from heat_igl.typing import AnyArray as IntArray  # of 32 bits too

# The number of pieces of the tree that are solved in parallel, roughly; and the fewest entries of a piece, so that it
# is worth a thread.
_PIECES = 6
_SMALLEST_PIECE = 1_500_000


class Fronts(NamedTuple):
    """Layout of a factor: all that the pattern determines.

    Attributes
    ----------
    order, place : (n,) int32
        ``order[i]`` is eliminated as the i-th; `place` is the inverse.
    start : (k + 1,) int64
        Front b eliminates the columns start[b] to start[b + 1].
    parent : (k,) int64
        The front that takes the update; -1 at roots.
    first_row : (k + 1,) int64
        The rows of front b below the columns of it are ``rows[first_row[b]:first_row[b + 1]]``, ascending.
    rows : (r,) int32
        Places in the order.
    first_entry : (k,) int64
        Start of each column in the factor, front after front, each from the diagonal on down. Fronts are stored from
        the roots to the leaves, the order of back substitution, since ascending memory is read fastest; forward
        substitution for a single source skips most fronts.
    pieces : (k,) int64
        Fronts by piece of the tree, ascending within each.
    piece_end : (p + 2,) int64
        Piece i is ``pieces[piece_end[i]:piece_end[i + 1]]``; neighbours of these columns are in it or in the last one,
        piece p, which holds the fronts above all others.
    end_entry : (p + 2,) int64
        Entries of the factor before each piece, and all of them.
    own_rows : (k,) int64
        Number of a front's rows in the same piece; the rest are in piece p.
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


def fronts(ends: IntArray, neighbours: IntArray, dissection: Dissection) -> Fronts:
    """Symbolic factorization of a symmetric pattern, as `dissect` takes it."""
    order, start, parent = dissection
    place = np.empty_like(order)
    place[order] = np.arange(len(order), dtype=order.dtype)
    first_row, rows = symbolic.front_rows(ends, neighbours, order, place, start, parent)
    columns = np.diff(start)
    entries = columns * (columns + 1) // 2 + columns * np.diff(first_row)
    last, piece = symbolic.tree_pieces(parent, entries, max(entries.sum() / _PIECES, _SMALLEST_PIECE))
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
