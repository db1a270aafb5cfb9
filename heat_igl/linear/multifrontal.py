"""The package's own factorization: multifrontal LDL^T (Duff and Reid 1983; Liu 1992) on a nested dissection.

**Order.** George (1973) with separators from a sweep: in each piece of the graph two vertices far apart are found by
breadth-first searches, and the vertices are sorted by the difference of their distances from both. Every threshold in
that order cuts the piece in two; all thresholds are compared in one pass. On meshes this leaves somewhat more nonzeros
than METIS's multilevel scheme, in a fraction of the time: METIS (pymetis) uses one processor and holds the
interpreter's lock.

**Layout.** Every block of the dissection is a *front*, a dense matrix over the columns of the block and the rows below
that they reach. The symbolic factorization stores one row index for all columns of a front, so that a solve reads
little else than the numbers, and cuts the tree into pieces that are solved in parallel.

**Numbers.** The columns of a front are eliminated in place and kept; the remainder, the update, is added to the
parent's front. No pivoting, for the reason that `SuperLUFactorization` gives.
"""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from importlib import import_module
from itertools import pairwise
from typing import Any, NamedTuple, cast

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import FactorizationError
from heat_igl.kernels import builds
from heat_igl.kernels.linear import dissection, symbolic
from heat_igl.kernels.signals import raise_caught
from heat_igl.linear.protocols import check_finite, check_probe
from heat_igl.runtime import Pool, n_threads, side_by_side
from heat_igl.typing import AnyArray as IntArray  # of 32 bits too
from heat_igl.typing import BoolArray, FloatArray

# A vertex with more neighbours than this many roots of the number of vertices belongs to every separator, like the pole
# of a cylinder with caps. Of 28 such cylinders, cones and wheels of 100 to 60 000 vertices, factors of eight have 1.2
# to 4.3 times the entries with 10, of four 1.2 to 1.7 times with 5; with 1.25 they are the same to 2 %.
_HUB = 2.5
# Pieces with more vertices than this, and than this share of all, are cut one at a time, and their parts are dissected
# in parallel; smaller pieces are dissected by one thread. On six surfaces and a box, on one thread, 500 takes 1.05 to
# 1.25 of the time, and 30000 0.93; a share of 1/256 takes as long. Entries of the factor are the same.
_LARGE = 3000
_SHARE = 1 / 64
# Small components are dissected together, up to this many vertices at a time: 4000 of 12 vertices take 6 times as long
# with 16, 1.9 with 64, and 0.75 with 1024; 60 of 642 as long with all.
_TOGETHER = 256

# The number of pieces of the tree that are solved in parallel, roughly; and the fewest entries of a piece, so that it
# is worth a thread. On one thread, 2 and 24 pieces and such of 300 000 entries take as long, within 10 %.
_PIECES = 6
_SMALLEST_PIECE = 1_500_000
# A pivot that has shrunk to less than this share of the diagonal is rounding. From 1e-16 to 1e-8 heat matrices of 80
# shapes pass; of their Laplacians, which are singular, two do up to 1e-13.
_SINGULAR = 1e-13
# Peak memory of a factorization over that of its entries: 1.2 to 1.3 on surfaces of 40k to 160k vertices, 1.4 in a box
# of 30k, with one row per vertex or two.
_PEAK = 1.5
# A block of right-hand sides costs as much as 2.7 to 3.1 single ones, however many of its columns are used (spheres of
# 10k and 41k vertices, a grid of 15k, a box of 7k, one thread).
_FEW = 4

_elimination = import_module(builds("linear.multifrontal")[0])
_solves = import_module(builds("linear.substitution")[0])


class Dissection(NamedTuple):
    """Vertices in order of elimination, in blocks that are eliminated together.

    ``order[i]`` is eliminated as the i-th, and block b holds ``order[start[b]:start[b + 1]]``. Blocks are numbered in
    postorder of the elimination tree. `parent` is the separator that cut a block off from the rest, -1 at roots: all
    neighbours of a block are in the block, its descendants or its ancestors.
    """

    order: IntArray
    start: IntArray
    parent: IntArray


def dissect(ends: IntArray, neighbours: IntArray, workers: Executor | None = None) -> Dissection:
    """An order of elimination for symmetric matrices of a given pattern.

    The neighbours of v are ``neighbours[ends[v]:ends[v + 1]]``: the pattern as scipy stores it, both triangles, with or
    without the diagonal. Threads of `workers` take large pieces; the result does not depend on them.
    """
    n = len(ends) - 1
    is_hub = np.diff(ends) > _HUB * np.sqrt(n)
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


class MultifrontalAnalysis:
    """Nested dissection and the fronts that it leads to."""

    backend = "multifrontal"

    def __init__(self, pattern: sp.csc_matrix) -> None:
        self.pattern = pattern.indptr.astype(np.int32, copy=False), pattern.indices.astype(np.int32, copy=False)
        with Pool(n_threads()) as workers:
            tree = dissect(*self.pattern, workers)
        self.fronts = fronts(*self.pattern, tree)
        # Of the type that numpy indexes with: converting others at each use takes three times as long as the indexing.
        self.order: IntArray | None = self.fronts.order.astype(np.intp)
        self.place = self.fronts.place.astype(np.intp)
        self.nonzeros = int(self.fronts.end_entry[-1])

    @property
    def two_factors_bytes(self) -> float:
        """Memory that two factors take while the second is made, which holds its updates beside its entries."""
        return 8.0 * self.nonzeros * (1.0 + _PEAK)

    def fits(self, A: sp.csc_matrix) -> bool:
        """Whether A has the pattern that was analysed."""
        return all(a is b or np.array_equal(a, b) for a, b in zip(self.pattern, (A.indptr, A.indices), strict=True))

    def factorize(self, A: sp.csc_matrix, free: BoolArray | None = None) -> MultifrontalFactorization:
        """Factor `A`, or the principal submatrix on the vertices that are `free`."""
        if not self.fits(A):
            raise ValueError("A has another pattern than the matrix that was analysed: analyse A")
        return MultifrontalFactorization(self, A, free)


class MultifrontalFactorization:
    """LDL^T of a matrix; entries are stored front by front, as `Fronts` says.

    Substitution goes from the leaves of the tree of fronts to the roots, and back. The tree is cut into pieces, which
    are subtrees, and the few fronts above them. Pieces are independent: each stores its updates of the rows above in an
    array of its own, and these are summed in the order of the pieces. So pieces run in parallel, and the bits of a
    solution do not depend on the number of threads.
    """

    backend = "multifrontal"

    def __init__(self, analysis: MultifrontalAnalysis, A: sp.csc_matrix, free: BoolArray | None) -> None:
        check_finite(A)
        self._arguments = analysis, A, free
        self._fronts = fronts = analysis.fronts
        self._held = fronts.place[:0] if free is None else fronts.place[~free]
        entries = np.empty(analysis.nonzeros)
        # Rows that are not free become those of the identity.
        is_free = np.ones(A.shape[0], np.uint8) if free is None else free.astype(np.uint8)
        data = A.data.astype(np.float64, copy=False)
        failed = _elimination.factor(*analysis.pattern, data, is_free, fronts, entries, _SINGULAR)
        if failed >= 0:
            raise_caught()
            raise FactorizationError(f"the matrix ({A.shape[0]} rows) is singular or not positive definite")
        self._kernel, self._above = _solves.TriangularSolves(fronts, entries), np.flatnonzero(fronts.above >= 0)
        check_probe(self, A, free)

    def solve(self, b: FloatArray) -> FloatArray:
        """Solve A x = b on the free vertices for one right-hand side (n,) or several (n, k); 0 on the others."""
        x, width = np.empty(b.shape), _solves.width
        given, solved = b.reshape(len(b), -1), x.reshape(len(b), -1)
        for first in range(0, given.shape[1], width):
            until = min(first + width, given.shape[1])
            step = width if until - first >= _FEW else 1
            for i in range(first, until, step):
                self._solve(given[:, i : i + step], solved[:, i : i + step])
        return x

    def _solve(self, b: FloatArray, x: FloatArray) -> None:
        """Write the solution for b, (n, 1) or at most as many columns as a block has, to x."""
        order, place, k = cast(IntArray, self._arguments[0].order), self._arguments[0].place, b.shape[1]
        ordered = np.zeros((len(place), 1 if k == 1 else _solves.width))
        ordered[:, :k] = b.take(order, axis=0)
        ordered[self._held] = 0.0
        self._substitute(ordered)
        np.take(ordered[:, :k], place, axis=0, out=x, mode="clip")

    def _substitute(self, x: FloatArray) -> None:
        """Solve in place for x, (n, 1) or a block, in the order of elimination, on this thread's processors."""
        kernel, end_entry = self._kernel, self._fronts.end_entry
        last = len(end_entry) - 2
        k = max(1, min(n_threads(), last))
        shares = np.searchsorted(end_entry[:last], np.arange(k + 1) / k * end_entry[last])
        ranges = list(pairwise(shares))
        sums = np.zeros((last + 1, len(self._above), x.shape[1]))
        side_by_side(lambda pieces: kernel.forward(x, *pieces, sums), ranges)
        x[self._above] -= sums.sum(axis=0)
        kernel.forward(x, last, last + 1, sums)
        kernel.back(x, last, last + 1)
        side_by_side(lambda pieces: kernel.back(x, *pieces), ranges)

    def __reduce__(
        self,
    ) -> tuple[type[MultifrontalFactorization], tuple[MultifrontalAnalysis, sp.csc_matrix, BoolArray | None]]:
        return MultifrontalFactorization, self._arguments
