"""Shortest paths along edges by A* with lower bounds from landmark distances.

A* visits fewer vertices than Dijkstra's algorithm if a lower bound of the distance to the target is known. For the
distances d from a landmark, |d(v) - d(target)| is such a bound by the triangle inequality (Goldberg and Harrelson 2005;
Peyre and Cohen 2009, on surfaces), provided that d changes along no edge by more than the length of the edge. Exact
geodesic distance satisfies this, since an edge is a path on the surface. Heat distance violates it on some edges, and
rounding can violate it. `EdgeSearch` therefore divides d by the largest change per length over all edges, so the bound
is valid for any d, and the paths found are shortest paths.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import SourceError
from heat_igl.mesh import Mesh, MeshLike, as_simplices
from heat_igl.typing import ArrayLike, FloatArray, IntArray

# Relative allowance for rounding in the difference of two distances.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class EdgePath:
    """A shortest path along edges.

    Attributes
    ----------
    vertices : (k,) int64
        Vertices from the source to the target; empty if the target is unreachable.
    length : float
        Length in the unit of the mesh; ``inf`` if the target is unreachable.
    n_expanded : int
        Number of vertices whose neighbours were visited.
    """

    vertices: IntArray
    length: float
    n_expanded: int


class EdgeSearch:
    """Shortest paths along the edges of a mesh, from one vertex to another.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes; n vertices.
    landmark_distances : (k, n) array_like, optional
        Distances from k landmarks, one row each, as returned by ``solver.distances(landmarks)``. Distances along edges
        give the best bounds. Without landmarks the search is Dijkstra's algorithm.

    Attributes
    ----------
    steepness : (k,) float64
        The largest change of each row along an edge, per length. Rows with a value above 1 were divided by it.

    Raises
    ------
    ValueError
        If `landmark_distances` does not have shape (k, n), or an entry is NaN or negative.

    Examples
    --------
    >>> from heat_igl import HeatMethodSolver, farthest_points, shapes
    >>> from heat_igl.applications import EdgeSearch
    >>> mesh = shapes.icosphere(4)
    >>> solver = HeatMethodSolver(mesh)
    >>> landmarks = farthest_points(solver, 8)
    >>> search = EdgeSearch(mesh, solver.distances(landmarks))
    >>> found, plain = search.path(100, 2000), EdgeSearch(mesh).path(100, 2000)
    >>> found.length == plain.length, found.n_expanded < plain.n_expanded
    (True, True)
    """

    def __init__(self, mesh: MeshLike, landmark_distances: ArrayLike | None = None) -> None:
        mesh = as_simplices(mesh)
        n = mesh.n_vertices
        a, b = mesh.edges.T
        graph = sp.csr_array(
            (np.tile(mesh.edge_lengths, 2), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n)
        )
        ends = np.stack([graph.indptr[:-1], graph.indptr[1:]], axis=1).tolist()
        neighbours, lengths = graph.indices.tolist(), graph.data.tolist()
        self._neighbours = [list(zip(neighbours[i:j], lengths[i:j], strict=True)) for i, j in ends]
        rows = np.empty((0, n)) if landmark_distances is None else _checked(landmark_distances, n)
        self.steepness = _steepness(mesh, rows)
        self._bounds: FloatArray = rows / np.maximum(1.0, self.steepness[:, None])

    def path(self, source: int, target: int) -> EdgePath:
        """The shortest path between two vertices.

        Raises
        ------
        SourceError
            If `source` or `target` is not a vertex.
        """
        n = len(self._neighbours)
        for name, vertex in (("source", source), ("target", target)):
            if not isinstance(vertex, int | np.integer) or not 0 <= vertex < n:
                raise SourceError(f"{name} = {vertex!r} is no vertex: indices run from 0 to {n - 1}")
        source, target = int(source), int(target)
        to_go = self._to_go(target)
        length = [np.inf] * n
        previous = [-1] * n
        is_done = bytearray(n)
        length[source] = 0.0
        queue = [(to_go[source], source)]
        n_expanded = 0
        while queue:
            _, v = heapq.heappop(queue)
            if v == target:
                return EdgePath(_chain(previous, target), length[target], n_expanded)
            if is_done[v]:
                continue
            is_done[v] = 1
            n_expanded += 1
            for w, step in self._neighbours[v]:
                by_v = length[v] + step
                if by_v < length[w]:
                    length[w] = by_v
                    previous[w] = v
                    heapq.heappush(queue, (by_v + to_go[w], w))
        return EdgePath(np.empty(0, np.int64), np.inf, n_expanded)

    def _to_go(self, target: int) -> list[float]:
        """A lower bound (n,) of the distance to `target`; along an edge it changes by at most the length."""
        reaching = self._bounds[np.isfinite(self._bounds[:, target])]
        if not len(reaching):
            return [0.0] * self._bounds.shape[1]
        found: list[float] = np.abs(reaching - reaching[:, [target]]).max(axis=0).tolist()
        return found


def _chain(previous: list[int], last: int) -> IntArray:
    chain = [last]
    while previous[chain[-1]] >= 0:
        chain.append(previous[chain[-1]])
    return np.array(chain[::-1])


def _checked(landmark_distances: ArrayLike, n: int) -> FloatArray:
    rows = np.asarray(landmark_distances, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != n:
        raise ValueError(f"landmark_distances must have shape (k, {n}), a row per landmark, not {rows.shape}")
    bad = ~(rows >= 0)
    if bad.any():
        row, vertex = (int(i) for i in np.argwhere(bad)[0])
        raise ValueError(f"landmark_distances[{row}, {vertex}] = {rows[row, vertex]} is no distance")
    return rows


def _steepness(mesh: Mesh, rows: FloatArray) -> FloatArray:
    """The largest change per length of each row along an edge, (k,).

    The value is ``inf`` if a row changes along an edge of length 0; such a row gives no bound. Edges that the landmark
    does not reach are ignored.
    """
    a, b = mesh.edges.T
    with np.errstate(invalid="ignore", divide="ignore"):
        slope = np.abs(rows[:, a] - rows[:, b]) / mesh.edge_lengths
    return np.asarray(np.fmax.reduce(slope, axis=1, initial=0.0) * (1 + _ROUNDING))
