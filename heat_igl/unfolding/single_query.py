"""Near-exact distance from vertices on a mesh that is asked once: little is held at a time, and nothing twice.

On ten million vertices the tables of the walks are most of what fits into memory. So faces and sides are
those of `heat_igl.kernels.gluing`, which have indices of 32 bits and no history; the order of the vertices is found
before there are tables, and what the tables are made from is gone before there are walks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic.fans import tables
from heat_igl.intrinsic.triangulation import half_edge_head, half_edge_tail
from heat_igl.kernels import bounds, numbering
from heat_igl.mesh import Mesh, connectivity
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.asked import require_share
from heat_igl.unfolding.bounds import shorten_along
from heat_igl.unfolding.exact import ExactSurface
from heat_igl.unfolding.glued import Glued, glued
from heat_igl.unfolding.half_edges import HalfEdges, Numbered
from heat_igl.unfolding.numbered import TOLERANCE, NumberedTriangles
from heat_igl.unfolding.when_exact import FEW, costs_little_to_be_exact

__all__ = ["SingleQuery", "single_query"]


def single_query(mesh: Mesh, sources: IntArray) -> SingleQuery | None:
    """What distance from source vertices (k,) needs of a mesh; the mesh itself is not held.

    None if neighbouring faces are not oriented alike, or more than two meet at an edge, copies of a face counted once.
    """
    found = glued(mesh)
    if (found.twin == -2).any():
        reduced, _ = mesh.without_duplicate_faces()
        return None if reduced is mesh else single_query(reduced, sources)
    if found.n_across:
        return None
    key = _along_edges(found, mesh.n_vertices, sources)
    found.flip(mesh.F)
    flipped = _flipped_sides(mesh, found)
    first_face = int(np.argmax(found.vertex == sources[0])) // 3
    vertex, twin, _, _, length, number, _ = numbering.breadth_first(
        found.vertex, found.twin, None, None, found.length, mesh.n_vertices, first_face
    )
    return SingleQuery(Sides(vertex, twin, length), found.exponent, number, sources, key, flipped)


class Sides(NamedTuple):
    """Vertex of each corner (3 m,), and twin and length of each half-edge, as for `HalfEdges`."""

    vertex: AnyArray
    twin: AnyArray
    length: FloatArray


@dataclass(eq=False)
class SingleQuery:
    """Triangles in the order in which a front from the first source meets them, oriented alike.

    Attributes
    ----------
    sides : Sides or None
        The intrinsic Delaunay triangulation, by new numbers. None once `distance` has been asked.
    exponent : int
        Lengths are in units of ``2 ** exponent``.
    number : (n,) int32
        New number of each vertex.
    sources : (k,) int64
        Vertices, by the old numbers as everything below.
    key : (n,) float64
        Length of the shortest path along edges from them.
    flipped : (f, 2) int32, (f,) float64
        Ends and lengths of the sides of faces that flips have changed.
    """

    sides: Sides | None
    exponent: int
    number: AnyArray
    sources: IntArray
    key: FloatArray
    flipped: tuple[AnyArray, FloatArray]

    def distance(self, tolerance: float | None = None) -> FloatArray:
        """Distance (n,), as `UnfoldingSolver` finds it with ``refine="unfold"``; to be asked once."""
        require_share(tolerance)
        sides, self.sides = self.sides, None
        if sides is None:
            raise ValueError("this query was asked before, and has let go of the triangles: make it again")
        if self._starts_in_small_parts(sides):
            return self._by_windows(sides)
        n = len(self.number)
        triangles = NumberedTriangles(
            tables(sides.vertex.reshape(-1, 3), sides.length.reshape(-1, 3), sides.twin, n), self.number
        )
        if costs_little_to_be_exact(triangles, "unfold"):
            del triangles
            return self._by_windows(sides)
        del sides
        starts = triangles.starts_at(self.sources)
        distance = np.array(
            triangles.walks(triangles.order(self.key), starts, TOLERANCE if tolerance is None else tolerance)[
                "distance"
            ]
        )
        edges = bounds.spoke_edges(triangles.tables.first, triangles.tables.spoke)
        del triangles
        ends, length = self.flipped
        shorten_along([edges, (self.number[ends], length)], distance)
        return np.asarray(np.ldexp(distance[self.number], self.exponent))

    def _starts_in_small_parts(self, sides: Sides) -> bool:
        """Whether all sources lie in components so small that windows are taken."""
        n_reached = np.count_nonzero(self.key < np.inf)
        if n_reached > FEW * len(self.sources):
            return False
        components = connectivity.connected_components(sides.vertex.reshape(-1, 3), len(self.number))
        return bool((np.bincount(components)[components[self.number[self.sources]]] <= FEW).all())

    def _by_windows(self, sides: Sides) -> FloatArray:
        size = len(sides.vertex)
        ring, aligned = np.arange(size, dtype=np.int32), np.ones(size, np.uint8)
        face = np.arange(size // 3, dtype=np.int32)
        numbered = Numbered(sides.vertex, sides.twin, ring, aligned, sides.length, self.number, face)
        return ExactSurface(HalfEdges(numbered, self.exponent)).distance(self.sources)


def _along_edges(found: Glued, n: int, sources: IntArray) -> FloatArray:
    """Length (n,) of the shortest path along the edges before any flip."""
    F = found.vertex.reshape(-1, 3)
    # One half-edge of each edge.
    some = np.flatnonzero(found.twin < np.arange(len(found.twin), dtype=np.int32))
    graph = sp.csr_array((found.length[some], (half_edge_tail(F, some), half_edge_head(F, some))), shape=(n, n))
    del some
    return connectivity.edge_distance(graph, sources)


def _flipped_sides(mesh: Mesh, found: Glued) -> tuple[AnyArray, FloatArray]:
    """Ends and lengths of the sides of all faces of the mesh that flips have changed."""
    F = mesh.F[(found.vertex.reshape(-1, 3) != mesh.F).any(axis=1)]
    ends = np.concatenate([F[:, [1, 2]], F[:, [2, 0]], F[:, [0, 1]]])
    length = np.linalg.norm(mesh.V[ends[:, 0]] - mesh.V[ends[:, 1]], axis=1)
    return ends.astype(np.int32), np.ldexp(length, -found.exponent)
