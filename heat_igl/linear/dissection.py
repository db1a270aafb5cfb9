"""Nested dissection: an order of elimination with little fill-in, and the tree of its separators.

George (1973) with separators from a sweep: in each piece of the graph two vertices far apart are found by breadth-first
searches, and the vertices are sorted by the difference of their distances from both. Every threshold in that order cuts
the piece in two; all thresholds are compared in one pass. On meshes this leaves somewhat more nonzeros than METIS's
multilevel scheme, in a fraction of the time: METIS (pymetis) uses one processor and holds the interpreter's lock.

The symbolic factorization that follows lays out a multifrontal factor, and the pieces in which it is solved. It is
stored by fronts, one row index for all columns of a front, so that a solve reads little else than the numbers.
"""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from heat_igl.kernels.linear import dissection, symbolic
from heat_igl.typing import AnyArray as IntArray  # of 32 bits too

# Pieces with more vertices than this, and than this share of all, are cut one at a time, and their parts are dissected
# in parallel; smaller pieces are dissected by one thread.
_LARGE = 3000
_SHARE = 1 / 64
# Small components are dissected together, up to this many vertices at a time.
_TOGETHER = 256

# The number of pieces of the tree that are solved in parallel, roughly; and the fewest entries of a piece, so that it
# is worth a thread.
_PIECES = 6
_SMALLEST_PIECE = 1_500_000


class Dissection(NamedTuple):
    """Vertices in order of elimination, in blocks that are eliminated together.

    Attributes
    ----------
    order : (n,) int32
        ``order[i]`` is eliminated as the i-th.
    start : (k + 1,) int64
        Block b holds ``order[start[b]:start[b + 1]]``. Children come before their parents, subtrees in one piece.
    parent : (k,) int64
        The separator that cut a block off from the rest; -1 at roots. Neighbours of a block are in it, below it or in
        its ancestors.
    """

    order: IntArray
    start: IntArray
    parent: IntArray


def dissect(ends: IntArray, neighbours: IntArray, workers: Executor | None = None) -> Dissection:
    """An order of elimination for symmetric matrices of a given pattern.

    Parameters
    ----------
    ends : (n + 1,) int32
        The neighbours of v are ``neighbours[ends[v]:ends[v + 1]]``: the pattern of a symmetric matrix as scipy stores
        it, both triangles, with or without the diagonal.
    neighbours : (nnz,) int32
        Vertices.
    workers : Executor, optional
        Threads for large pieces. The result does not depend on them.
    """
    n = len(ends) - 1
    # A vertex with very many neighbours belongs to every separator.
    is_hub = np.diff(ends) > max(10 * np.sqrt(n), 64)
    others = dissection.breadth_first(ends, neighbours, is_hub.view(np.uint8))
    order = np.concatenate([others, np.flatnonzero(is_hub).astype(np.int32)])
    inner = n - int(is_hub.sum())
    is_start, parent = np.zeros(n, np.uint8), np.full(n, -1, np.int64)
    is_start[inner:][:1] = 1
    large = max(_LARGE, _SHARE * n)

    def cut(graph: tuple[IntArray, IntArray], low: int, high: int, above: int) -> list[Any]:
        """Dissect order[low:high], or cut it once if it is large, and return the pieces left to dissect."""
        some = np.arange(high - low, dtype=np.int32)
        parent_here = parent[low:high]
        rest = dissection.dissect_pieces(*graph, some, is_start[low:high], parent_here, large)
        order[low:high] = order[low:high][some]
        parent_here[:] = np.where(parent_here < 0, above, parent_here + low)
        return [
            (dissection.subgraph(*graph, some[first:end]), low + first, low + end, above if up < 0 else up + low)
            for first, end, up in rest.tolist()
        ]

    pieces = [
        (graph, low, high, inner if inner < n else -1)
        for graph, low, high in _apart(*dissection.subgraph(ends, neighbours, order[:inner]))
    ]
    running: set[Future[list[Any]]] = set()
    while pieces or running:
        if workers is None:
            pieces.extend(cut(*pieces.pop()))
            continue
        running.update(workers.submit(cut, *piece) for piece in pieces)
        done, running = wait(running, return_when=FIRST_COMPLETED)
        pieces = [piece for future in done for piece in future.result()]
    start = np.flatnonzero(is_start)
    number = np.cumsum(is_start, dtype=np.int64) - 1
    return Dissection(order, np.append(start, n), np.where(parent[start] < 0, -1, number[parent[start]]))


def _apart(ends: IntArray, neighbours: IntArray) -> list[tuple[tuple[IntArray, IntArray], int, int]]:
    """Parts of a graph in breadth-first order that no edge joins, each with the first vertex and the end.

    A part is searched again for each component that is split off from it, so all components but the last one have at
    most `_TOGETHER` vertices together.
    """
    n = len(ends) - 1
    vertex = np.repeat(np.arange(n), np.diff(ends))
    # All vertices but the first of their component have a neighbour before them.
    root = np.flatnonzero(np.bincount(vertex[neighbours < vertex], minlength=n) == 0)
    first = root[np.unique(root // _TOGETHER, return_index=True)[1]]
    parts = []
    for low, high in pairwise([*first.tolist(), n]):
        inside = slice(ends[low], ends[high])
        parts.append(((ends[low : high + 1] - ends[low], neighbours[inside] - np.int32(low)), low, high))
    return parts


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
