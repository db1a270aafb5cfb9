"""Exact distances between nearby vertices; the cost of a query depends on the part of the mesh that it visits.

Window searches, each from a single vertex, run on all processors. Each ends once its distances are known.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import SourceError, as_array, names_guessed, positive, raise_at_first, shown
from heat_igl.kernels.mesh import checking
from heat_igl.kernels.windows import windows
from heat_igl.mesh import Mesh, MeshLike, MeshPart, connectivity, triangles_inside
from heat_igl.runtime import TimeLeft, available_memory, n_threads, over_rows
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.windows.exact import TOLERANCE, Found, Leaving, require_memory
from heat_igl.windows.guards import distances_instead
from heat_igl.windows.invariants import ROUNDING
from heat_igl.windows.tables import Tables, from_mesh

# Peak memory per stored distance while a sparse array is assembled, in bytes: 26 on a sphere; reordered rows take more.
_BYTES = 48
# Largest result, in entries, if more vertices are requested than the mesh has.
_MOST_PADDED = 2**28
#: Largest number of sources that a thread takes at a time. Neighbourhoods of few vertices take 1.6 times as long with
#: 16 and .75 with 256, large ones as long.
CHUNK = 64
# Initial capacity of a thread's result arrays.
_ROOM = 2**16
# What needs triangles, in the message for tetrahedra.
_WHAT = "exact distances, unlike those of distance_matrix, need"
_NO_VERTICES = np.empty(0, np.int32)
_NONE_WRONG = np.empty(0, bool)
_NO_WAYS, _NO_LINES = np.empty((0, 3), np.int32), np.empty((0, 3))


@names_guessed
def distances_within(
    mesh: MeshLike, radius: float, sources: Sources | None = None, *, region: ArrayLike | None = None
) -> sp.csr_array:
    """Exact distances from each source vertex to all vertices within a radius.

    Parameters
    ----------
    mesh : mesh
        Triangles on n vertices: whatever `as_mesh` takes.
    radius : float
        Positive, in the unit of the mesh; ``inf`` for all reachable vertices.
    sources : int, sequence of int, or (n,) mask of bool, optional
        The k source vertices, one row each; all n if not given.
    region : (n,) or (m,) array_like of bool, optional
        The vertices or faces that paths may enter, as for `GeodesicSolver`. Without sources, rows of vertices outside
        the region are empty.

    Returns
    -------
    scipy.sparse.csr_array
        Shape (k, n), in the unit of the mesh, with sorted indices. Stored entries are distances, including the 0 of a
        vertex from itself; vertices without an entry are farther than the radius.

    Raises
    ------
    ValueError
        If `radius` is not a positive number.
    MemoryError
        If the distances within this radius are estimated, from the first searches, not to fit into memory.
    MeshError
        If the mesh cannot be used, or is tetrahedral.
    SourceError
        If `sources` does not name vertices.

    Examples
    --------
    >>> from heat_igl import distances_within, shapes
    >>> near = distances_within(shapes.strip(100, 1), 2.5, sources=[50])
    >>> near.indices[:5].tolist(), near.data[:5].round(6).tolist()
    ([48, 49, 50, 51, 52], [2.0, 1.0, 0.0, 1.0, 2.0])
    """
    limit = positive("radius", radius, infinite=True)
    triangles, part = triangles_inside(mesh, region, _WHAT)
    chosen = _chosen(sources, triangles, part)
    found = _rows_within(triangles, from_mesh(triangles, int(chosen[0])), chosen, limit)
    if sources is not None or part is None:
        return found
    # Empty rows for the vertices outside.
    counts = np.zeros(found.shape[1], found.indptr.dtype)
    counts[part.inside] = np.diff(found.indptr)
    return sp.csr_array((found.data, found.indices, np.append(0, np.cumsum(counts))), shape=(len(counts),) * 2)


def blocks_within(
    mesh: MeshLike, radius: float, sources: Sources | None = None, most_entries: int = 2**24
) -> Iterator[sp.csr_array]:
    """The rows of `distances_within` in blocks, so that the whole matrix need not fit into memory.

    Blocks have about `most_entries` distances; the first has few rows, and is used to estimate the next.
    """
    limit = positive("radius", radius, infinite=True)
    triangles, part = triangles_inside(mesh, None, _WHAT)
    chosen = _chosen(sources, triangles, part)
    tables = from_mesh(triangles, int(chosen[0]))
    least = CHUNK * n_threads()
    start, rows = 0, least
    while start < len(chosen):
        block = _rows_within(triangles, tables, chosen[start : start + rows], limit)
        yield block
        start += rows
        rows = max(int(most_entries * block.shape[0] / max(block.nnz, 1)) // least, 1) * least


def _rows_within(triangles: Mesh, tables: Tables, chosen: IntArray, limit: float) -> sp.csr_array:
    count, radius = _Count(len(chosen), available_memory() / _BYTES), float(tables.scaled(limit))
    order, near = search_each(tables, chosen, triangles.V, lambda work, numbers, _: count(work.within(numbers, radius)))
    ends = np.concatenate([[0], np.cumsum(near.counts)])
    found = sp.csr_array((near.distance, near.vertex, ends), shape=(len(chosen), tables.n))
    wrong = np.flatnonzero(near.is_wrong)
    if len(wrong):
        rows = distances_instead(triangles, chosen[order[wrong]])
        i, j = np.nonzero(rows <= limit)
        ends = np.searchsorted(i, np.arange(len(wrong) + 1))
        found = sp.vstack([found, sp.csr_array((rows[i, j], j, ends), shape=rows.shape)], format="csr")
        at = np.arange(len(chosen))
        at[wrong] = len(chosen) + np.arange(len(wrong))
        found = found[at]
    if (np.diff(order) != 1).any():
        found = found[np.argsort(order)]
    if triangles.has_copies:
        found = found[:, triangles.originals]
    found.sort_indices()
    return found


@names_guessed
def nearest_vertices(
    mesh: MeshLike, k: int, sources: Sources | None = None, *, region: ArrayLike | None = None
) -> tuple[IntArray, FloatArray]:
    """The k vertices nearest to each source vertex, by exact distance.

    Parameters
    ----------
    k : int
        Number of vertices, including the source itself, which comes first.
    mesh, sources, region
        As for `distances_within`, with s sources; without sources, rows of vertices outside the region are -1.

    Returns
    -------
    indices : (s, k) int64
        By ascending distance, ties by ascending index; -1 in the last columns if fewer than k vertices are reachable.
    distances : (s, k) float64
        In the unit of the mesh; ``inf`` where the index is -1.

    Raises
    ------
    ValueError
        If `k` is not a positive integer.
    MemoryError
        If s rows of k do not fit into memory.
    MeshError, SourceError
        As for `distances_within`.

    Examples
    --------
    >>> import heat_igl
    >>> indices, distances = heat_igl.nearest_vertices(heat_igl.shapes.strip(4, 3), 3, sources=[0])
    >>> indices.tolist(), distances.round(6).tolist()
    ([[0, 1, 5]], [[0.0, 1.0, 1.0]])
    """
    if isinstance(k, bool) or not isinstance(k, int | np.integer) or k < 1:
        raise ValueError(f"k must be a positive integer, not {shown(k)}")
    triangles, part = triangles_inside(mesh, region, _WHAT)
    chosen = _chosen(sources, triangles, part)
    tables = from_mesh(triangles, int(chosen[0]))
    # No more vertices than the mesh has can be found.
    wanted = min(int(k), triangles.n_vertices)
    indices, distances = _unfilled(len(chosen), int(k), triangles.n_vertices)
    order, near = search_each(tables, chosen, triangles.V, lambda work, numbers, _: work.nearest(numbers, wanted))
    i, j = np.nonzero(np.arange(int(k)) < near.counts[:, None])
    indices[order[i], j], distances[order[i], j] = near.vertex, near.distance
    wrong = order[near.is_wrong]
    if len(wrong):
        rows = distances_instead(triangles, chosen[wrong])
        nearest = np.argsort(rows, axis=1, kind="stable")[:, :wanted]
        distances[wrong, :wanted] = np.take_along_axis(rows, nearest, axis=1)
        indices[wrong, :wanted] = np.where(np.isfinite(distances[wrong, :wanted]), nearest, -1)
    if triangles.has_copies:
        everywhere = np.arange(triangles.n_vertices) if part is None else np.flatnonzero(part.inside)
        named = everywhere if sources is None else named_vertices(sources, triangles.n_vertices)
        _put_copies(indices, distances, named, triangles.originals)
    if sources is None and part is not None:
        spread = _unfilled(triangles.n_vertices, int(k), triangles.n_vertices)
        spread[0][part.inside], spread[1][part.inside] = indices, distances
        return spread
    return indices, distances


def _put_copies(indices: IntArray, distances: FloatArray, sources: IntArray, originals: IntArray) -> None:
    """Give rows (s, k) of the nearest originals the copies of each, and put the source (s,) of a row first."""
    counts = np.bincount(originals)
    first = np.cumsum(counts) - counts
    found = indices >= 0
    entry, copy = connectivity.enumerate_runs(counts[indices[found]])
    vertex = np.argsort(originals, kind="stable")[first[indices[found]][entry] + copy]
    row, value = np.nonzero(found)[0][entry], distances[found][entry]
    order = np.lexsort((vertex, vertex != sources[row], value, row))
    rank = connectivity.enumerate_runs(np.bincount(row))[1]
    kept = rank < indices.shape[1]
    row, order = row[order][kept], order[kept]
    indices[row, rank[kept]], distances[row, rank[kept]] = vertex[order], value[order]


def _unfilled(s: int, k: int, n: int) -> tuple[IntArray, FloatArray]:
    """Indices -1 and distances ``inf`` (s, k)."""
    # The operating system may grant more memory than it has, and fail only when the arrays are filled.
    if k <= n or s * k <= _MOST_PADDED:
        try:
            return np.full((s, k), -1, np.int64), np.full((s, k), np.inf)
        except (MemoryError, ValueError):
            pass
    raise MemoryError(
        f"k = {k} for each of {s} vertices does not fit into memory: take a smaller k (the mesh has {n} vertices) or "
        "fewer sources"
    )


@names_guessed
def pair_distances(mesh: MeshLike, pairs: ArrayLike, *, region: ArrayLike | None = None) -> FloatArray:
    """Exact distance between the two vertices of each pair.

    Parameters
    ----------
    mesh : mesh
        Triangles: whatever `as_mesh` takes.
    pairs : (p, 2) array_like of int
        Vertices. Pairs with the same first vertex share one search, which ends at the farthest second vertex. A search
        for a single pair drops paths whose straight distance to the second vertex is too large.
    region : (n,) or (m,) array_like of bool, optional
        The vertices or faces that paths may enter, as for `GeodesicSolver`. The first vertices must be inside.

    Returns
    -------
    (p,) float64
        In the unit of the mesh; ``inf`` for vertices of different components.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or is tetrahedral.
    SourceError
        If `pairs` has another shape or type, or an entry is no vertex.

    Examples
    --------
    >>> import heat_igl
    >>> heat_igl.pair_distances(heat_igl.shapes.strip(4, 3), [[0, 4], [0, 19]]).round(6).tolist()
    [4.0, 5.0]
    """
    triangles, part = triangles_inside(mesh, region, _WHAT)
    array, n = as_array("pairs", pairs, SourceError), triangles.n_vertices
    if array.ndim != 2 or array.shape[1] != 2:
        raise SourceError(f"pairs must be an array of shape (p, 2), but it has shape {array.shape}")
    if array.dtype.kind not in "iu":
        raise SourceError(f"pairs must hold indices of vertices, not {array.dtype}: convert with astype(int)")
    remedy = f"the mesh has {n} vertices, so indices run from 0 to {n - 1}"
    outside = ((array < 0) | (array >= n)).any(axis=1)
    raise_at_first(outside, "pairs", array, "must be two vertices", remedy, SourceError)
    first, second = triangles.originals[array].T
    if part is not None:
        part.require_vertices(first, "pairs")
    distance = np.full(len(first), np.inf)
    components = triangles.components
    joined = np.flatnonzero(components[first] == components[second])
    if not len(joined):
        return distance
    tables = from_mesh(triangles, int(first[joined].min()))
    joined = joined[np.argsort(tables.number[first[joined]], kind="stable")]
    sources, begin = np.unique(tables.number[first[joined]], return_index=True)
    ends = np.append(begin, len(joined))
    goals = tables.number[second[joined]]

    def to_goals(work: Workspace, numbers: AnyArray, rows: slice) -> Near:
        first = ends[rows.start : rows.stop + 1]
        return work.to_goals(numbers, goals[first[0] : first[-1]], first - first[0])

    asked = tables.old_vertex[sources]
    _, near = search_each(tables, asked, triangles.V, to_goals)
    distance[joined] = near.distance
    wrong = asked[near.is_wrong]
    for source, row in zip(wrong, distances_instead(triangles, wrong), strict=True):
        distance[first == source] = row[second[first == source]]
    return distance


class _Count:
    """Counts the distances found from k sources: reports the remaining time; a MemoryError if they will not fit."""

    def __init__(self, k: int, most: float) -> None:
        self._k, self._most = k, most
        self._sources = self._found = 0
        self._left = TimeLeft("sources are done", k)

    def __call__(self, near: Near) -> Near:
        self._sources += len(near.counts)
        self._found += len(near.vertex)
        expected = self._found / self._sources * self._k
        if expected > self._most:
            raise MemoryError(
                f"about {expected:.2g} distances lie within the radius, {expected / self._k:.3g} from each vertex, and "
                "do not fit into memory: take a smaller radius (in the unit of the mesh) or fewer sources, or write "
                "rows to a file with write_distances_within"
            )
        self._left(len(near.counts), f" for {expected:.2g} distances, less with a smaller radius")
        return near


def _chosen(sources: Sources | None, mesh: Mesh, part: MeshPart | None) -> IntArray:
    if sources is None:
        return mesh.originals if part is None else mesh.originals[part.inside]
    named = mesh.originals[named_vertices(sources, mesh.n_vertices)]
    if part is not None:
        part.require_vertices(named)
    return named


class Near(NamedTuple):
    """The number of vertices found from each source, and the vertices and their distances, source after source.

    From a directed search, `way` and `line` (r, 3) describe the path to each vertex, see `windows.search_each`.
    `is_wrong` marks sources whose distances violate the bounds of straight lines or edge lengths.
    """

    counts: IntArray
    vertex: AnyArray
    distance: FloatArray
    way: AnyArray = _NO_WAYS
    line: FloatArray = _NO_LINES
    is_wrong: BoolArray = _NONE_WRONG

    @classmethod
    def joined(cls, parts: list[Near]) -> Near:
        """The concatenated results of several searches."""
        return cls(*(np.concatenate(column) for column in zip(*parts, strict=True)))


class Workspace:
    """The arrays that the searches of one thread write. Every search restores their initial state.

    With `directed`, searches also find the directions of paths; this requires consistently oriented faces.
    """

    def __init__(self, tables: Tables, position: FloatArray, directed: bool = False) -> None:
        self._tables, self._is_directed = tables, directed
        self._found, self._position, self._scratch = Found.of(tables.n, tables.n), position, np.full(tables.n, np.inf)
        leaving = Leaving.of(tables.n) if directed else None
        self._front = windows.Front(tables, self._found, TOLERANCE, leaving, position.ravel())

    def checked(self, sources: AnyArray, near: Near, limit: FloatArray | float) -> Near:
        """The results with `is_wrong` set; each must hold all vertices within its limit."""
        tables, limits = self._tables, np.broadcast_to(limit, len(near.counts)).astype(np.float64)
        found = tables.number[near.vertex]
        answers = sources, near.counts, found, near.distance, limits
        wrong = checking.wrong_rows(tables, self._position, *answers, self._scratch, ROUNDING)
        return near._replace(is_wrong=wrong)

    def search(
        self,
        sources: AnyArray,
        found: AnyArray,
        value: FloatArray,
        *,
        goals: AnyArray = _NO_VERTICES,
        first_goal: AnyArray | None = None,
        cutoff: float = np.inf,
        n_nearest: int = 0,
        way: AnyArray = _NO_WAYS,
        line: FloatArray = _NO_LINES,
    ) -> IntArray:
        """Search from each source; returns the ends of the results of those sources whose results fitted."""
        ends = np.zeros(len(sources), np.int64)
        n_done = windows.search_each(
            self._front,
            sources,
            goals,
            np.zeros(len(sources) + 1, np.int64) if first_goal is None else first_goal,
            cutoff,
            n_nearest,
            self._tables.old_vertex,
            found,
            value,
            ends,
            way,
            line,
        )
        require_memory(n_done >= 0, n_done == -2)
        return ends[:n_done]

    def within(self, sources: AnyArray, radius: float) -> Near:
        """All vertices within a radius; the arrays are doubled until the results of the next source fit."""
        rows, done, room = [], 0, _ROOM
        while done < len(sources):
            found, value, of_paths = np.empty(room, np.int32), np.empty(room), room if self._is_directed else 0
            way, line = np.empty((of_paths, 3), np.int32), np.empty((of_paths, 3))
            ends = self.search(sources[done:], found, value, cutoff=radius, way=way, line=line)
            if not len(ends):
                room *= 2
                continue
            done += len(ends)
            n = ends[-1]
            found, value, way, line = found[:n].copy(), value[:n].copy(), way[:n].copy(), line[:n].copy()
            rows.append(Near(np.diff(ends, prepend=0), found, value, way, line))
        return self.checked(sources, Near.joined(rows), radius)

    def nearest(self, sources: AnyArray, k: int) -> Near:
        """The k nearest vertices of each source."""
        found, value = np.empty(k * len(sources), np.int32), np.empty(k * len(sources))
        ends = self.search(sources, found, value, n_nearest=k)
        near = Near(np.diff(ends, prepend=0), found[: ends[-1]], value[: ends[-1]])
        return self.checked(sources, near, np.where(near.counts < k, np.inf, value[ends - 1]))

    def to_goals(self, sources: AnyArray, goals: AnyArray, first: IntArray) -> Near:
        """Distances of the goals (g,) of each source; those of source i are ``first[i]`` to ``first[i + 1]``."""
        value = np.empty(len(goals))
        self.search(sources, np.empty(1, np.int32), value, goals=goals, first_goal=first)
        return self.checked(sources, Near(np.diff(first), self._tables.old_vertex[goals], value), 0.0)


def search_each(
    tables: Tables,
    vertices: IntArray,
    V: FloatArray,
    search: Callable[[Workspace, AnyArray, slice], Near],
    directed: bool = False,
) -> tuple[IntArray, Near]:
    """Searches from k vertices on all processors: returns the order in which they ran, and the results in this order.

    `search` is called for several sources at a time, with their numbers in the tables and a slice of the order. In
    ascending order of these numbers, a search often finds its data in the processor's cache. V (n, 3) are the positions
    of the vertices.
    """
    number = tables.number[vertices]
    order = np.argsort(number, kind="stable")
    asked, position = number[order], np.ascontiguousarray(tables.scaled(V[tables.old_vertex]))
    spare: deque[Workspace] = deque()

    def run(rows: slice) -> Near:
        try:
            work = spare.pop()
        except IndexError:  # the first of a thread
            work = Workspace(tables, position, directed)
        found = search(work, asked[rows], rows)
        spare.append(work)
        return found

    near = Near.joined(over_rows(run, len(asked), CHUNK))
    return order, near._replace(distance=tables.unscaled(near.distance))
