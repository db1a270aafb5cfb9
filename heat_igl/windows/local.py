"""Exact distances between vertices that are near each other, each query at the cost of what it touches."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError, SourceError, names_guessed, positive, shown
from heat_igl.mesh import Mesh, MeshLike, MeshPart, as_simplices
from heat_igl.runtime import TimeLeft, available_memory, n_threads
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import ArrayLike, FloatArray, IntArray
from heat_igl.windows import local_searches
from heat_igl.windows.engine import distances_instead
from heat_igl.windows.tables import Tables, from_mesh

# Bytes that each distance of a sparse array takes while the array is put together.
_BYTES = 48
# Where more are asked for than the mesh has vertices, the most entries of the result.
_MOST_PADDED = 2**28


@names_guessed
def distances_within(
    mesh: MeshLike, radius: float, sources: Sources | None = None, *, region: ArrayLike | None = None
) -> sp.csr_array:
    """Exact distances from each of some vertices to all vertices up to a radius.

    Parameters
    ----------
    mesh : mesh
        Triangles on n vertices: whatever `as_mesh` takes.
    radius : float
        In the mesh's unit, positive; ``inf`` for all that can be reached.
    sources : int, sequence of int, or (n,) mask of bool, optional
        The k vertices that are asked, each for itself; all n if not given.
    region : (n,) or (m,) array_like of bool, optional
        What paths may enter, as for `GeodesicSolver`. Without sources, rows of vertices elsewhere are empty.

    Returns
    -------
    scipy.sparse.csr_array
        Shape (k, n), in the mesh's unit, with sorted indices. What is stored is a distance, the 0 of a vertex from
        itself too; what is not stored is farther than the radius.

    Raises
    ------
    ValueError
        If `radius` is not a positive number.
    MemoryError
        If the distances up to this radius will not fit into memory, as soon as the first searches tell.
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
    triangles, part = _triangles(mesh, region)
    chosen = _chosen(sources, triangles, part)
    found = _rows_within(triangles, from_mesh(triangles, int(chosen[0])), chosen, limit)
    if triangles.has_copies:
        found = found[:, triangles.originals]
    return found if sources is not None or part is None else _with_empty_rows(found, np.flatnonzero(part.inside))


def blocks_within(
    mesh: MeshLike, radius: float, sources: Sources | None = None, most_entries: int = 2**24
) -> Iterator[sp.csr_array]:
    """The rows of `distances_within`, some after the other, so that not all need fit into memory.

    Parameters
    ----------
    mesh, radius, sources
        As for `distances_within`.
    most_entries : int
        About so many distances are in memory at a time: the first block has few rows, and says how many the next has.

    Yields
    ------
    scipy.sparse.csr_array
        Shape (rows, n).
    """
    limit = positive("radius", radius, infinite=True)
    triangles, part = _triangles(mesh)
    chosen = _chosen(sources, triangles, part)
    tables = from_mesh(triangles, int(chosen[0]))
    least = local_searches.CHUNK * n_threads()
    start, rows = 0, least
    while start < len(chosen):
        block = _rows_within(triangles, tables, chosen[start : start + rows], limit)
        yield block
        start += rows
        rows = max(int(most_entries * block.shape[0] / max(block.nnz, 1)) // least, 1) * least


def _rows_within(triangles: Mesh, tables: Tables, chosen: IntArray, limit: float) -> sp.csr_array:
    number = tables.number[chosen]
    order = np.argsort(number, kind="stable")
    count = _Count(len(chosen), available_memory() / _BYTES)
    parts = local_searches.in_chunks(
        tables,
        number[order],
        lambda work, part: count(local_searches.within(work, part, float(tables.scaled(limit)))),
        triangles.V,
    )
    counts = np.concatenate([part.counts for part in parts])
    ends = np.concatenate([[0], np.cumsum(counts)])
    columns = np.concatenate([part.vertex for part in parts])
    values = tables.unscaled(np.concatenate([part.distance for part in parts]))
    found = sp.csr_array((values, columns, ends), shape=(len(chosen), tables.n))
    wrong = _wrong(parts)
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
    found.sort_indices()
    return found


@names_guessed
def nearest_vertices(
    mesh: MeshLike, k: int, sources: Sources | None = None, *, region: ArrayLike | None = None
) -> tuple[IntArray, FloatArray]:
    """The k vertices nearest to each of some vertices, by exact distance.

    Parameters
    ----------
    k : int
        How many vertices; the vertex itself is the first of them.
    mesh, sources, region
        As for `distances_within`, s sources; without these, vertices outside the region have no nearest ones.

    Returns
    -------
    indices : (s, k) int64
        In the order of their distance, and of equally near ones of their index. If fewer than k can be reached, the
        rest is -1.
    distances : (s, k) float64
        In the mesh's unit; ``inf`` where the index is -1.

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
    triangles, part = _triangles(mesh, region)
    chosen = _chosen(sources, triangles, part)
    tables = from_mesh(triangles, int(chosen[0]))
    # More than all vertices cannot be found.
    wanted = min(int(k), triangles.n_vertices)
    indices, distances = _unfilled(len(chosen), int(k), triangles.n_vertices)
    number = tables.number[chosen]
    order = np.argsort(number, kind="stable")
    parts = local_searches.in_chunks(
        tables, number[order], lambda work, part: local_searches.nearest(work, part, wanted), triangles.V
    )
    i, j = np.nonzero(np.arange(int(k)) < np.concatenate([part.counts for part in parts])[:, None])
    indices[order[i], j] = np.concatenate([part.vertex for part in parts])
    distances[order[i], j] = tables.unscaled(np.concatenate([part.distance for part in parts]))
    wrong = order[_wrong(parts)]
    if len(wrong):
        rows = distances_instead(triangles, chosen[wrong])
        nearest = np.argsort(rows, axis=1, kind="stable")[:, :wanted]
        distances[wrong, :wanted] = np.take_along_axis(rows, nearest, axis=1)
        indices[wrong, :wanted] = np.where(np.isfinite(distances[wrong, :wanted]), nearest, -1)
    if sources is None and part is not None:
        spread = _unfilled(triangles.n_vertices, int(k), triangles.n_vertices)
        spread[0][part.inside], spread[1][part.inside] = indices, distances
        return spread
    return indices, distances


def _unfilled(s: int, k: int, n: int) -> tuple[IntArray, FloatArray]:
    """Indices and distances (s, k) of nothing."""
    # Before the arrays are filled, a system may give away more memory than it has.
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
    """Exact distance between the two vertices of each of some pairs.

    Parameters
    ----------
    mesh : mesh
        Triangles: whatever `as_mesh` takes.
    pairs : (p, 2) array_like of int
        Vertices. Pairs with the same first vertex share one search, which ends at the farthest of the second ones.
        A search for one pair leaves out what is too far from the second vertex along a straight line in space.
    region : (n,) or (m,) array_like of bool, optional
        What paths may enter, as for `GeodesicSolver`. The first vertices must lie there.

    Returns
    -------
    (p,) float64
        In the mesh's unit; ``inf`` for vertices of different components.

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
    triangles, part = _triangles(mesh, region)
    first, second = triangles.originals[_checked_pairs(pairs, triangles.n_vertices)].T
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
    parts = local_searches.in_chunks(
        tables,
        sources,
        lambda work, part: local_searches.to_goals(work, part, goals[ends[part.start] : ends[part.stop]], ends),
        triangles.V,
    )
    distance[joined] = tables.unscaled(np.concatenate([part.distance for part in parts]))
    wrong = tables.old_vertex[sources[_wrong(parts)]]
    for source, row in zip(wrong, distances_instead(triangles, wrong), strict=True):
        distance[first == source] = row[second[first == source]]
    return distance


def _wrong(parts: list[local_searches.Near]) -> IntArray:
    """The sources, in the order that they were asked in, whose answers contradict themselves."""
    return np.flatnonzero(np.concatenate([part.is_wrong for part in parts]))


class _Count:
    """Counts the distances from some of k sources: says how long the rest takes, or that they will be too many."""

    def __init__(self, k: int, most: float) -> None:
        self._k, self._most = k, most
        self._sources = self._found = 0
        self._left = TimeLeft("sources are done", k)

    def __call__(self, near: local_searches.Near) -> local_searches.Near:
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


def _triangles(mesh: MeshLike, region: ArrayLike | None = None) -> tuple[Mesh, MeshPart | None]:
    """The triangles that paths may enter, on all vertices; and the part of the mesh that they are."""
    triangles = as_simplices(mesh)
    if triangles.is_tetrahedral:
        raise MeshError("exact distances need triangles, and the mesh holds tetrahedra: take distance_matrix")
    part = None if region is None else MeshPart.of(triangles, region)
    return triangles if part is None else part.mesh, part


def _chosen(sources: Sources | None, mesh: Mesh, part: MeshPart | None) -> IntArray:
    if sources is None:
        return mesh.originals if part is None else mesh.originals[part.inside]
    named = mesh.originals[named_vertices(sources, mesh.n_vertices)]
    if part is not None:
        part.require_vertices(named)
    return named


def _with_empty_rows(found: sp.csr_array, rows: IntArray) -> sp.csr_array:
    """A matrix (n, n) with these rows (k,), and others empty."""
    n = found.shape[1]
    counts = np.zeros(n, found.indptr.dtype)
    counts[rows] = np.diff(found.indptr)
    return sp.csr_array((found.data, found.indices, np.append(0, np.cumsum(counts))), shape=(n, n))


def _checked_pairs(pairs: ArrayLike, n: int) -> IntArray:
    try:
        array = np.asarray(pairs)
    except ValueError:
        raise SourceError("pairs must be an array of shape (p, 2), not a ragged sequence") from None
    if array.ndim != 2 or array.shape[1] != 2:
        raise SourceError(f"pairs must be an array of shape (p, 2), but it has shape {array.shape}")
    if array.dtype.kind not in "iu":
        raise SourceError(f"pairs must hold indices of vertices, not {array.dtype}: convert with astype(int)")
    outside = np.flatnonzero(((array < 0) | (array >= n)).any(axis=1))
    if len(outside):
        first = int(outside[0])
        raise SourceError(
            f"pairs[{first}] = {array[first].tolist()} names no two vertices ({len(outside)} of {len(array)} do not): "
            f"the mesh has {n} vertices, so indices run from 0 to {n - 1}"
        )
    return np.asarray(array, np.int64)
