"""Neighbours in a triangulation: the corners and edges at a vertex, and the faces behind a half-edge."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, next_half_edge, previous_half_edge
from heat_igl.mesh import connectivity, grouping
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["Adjacency"]


class Adjacency:
    """Neighbours of vertices and half-edges, also if more than two faces meet at an edge.

    The tables are made on first use.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        m triangles on n vertices.
    """

    def __init__(self, triangulation: IntrinsicTriangulation) -> None:
        self.triangulation = triangulation

    @cached_property
    def _corners(self) -> grouping.Groups:
        """The corners of faces at each vertex."""
        return grouping.group_by_label(self.triangulation.F.ravel(), self.triangulation.n)

    @cached_property
    def _crowded(self) -> tuple[IntArray, grouping.Groups]:
        """The half-edges at each edge of more than two faces, and the number (3 m,) of the edge of each half-edge.

        The vertices of such an edge identify it, because it is never flipped.
        """
        tri = self.triangulation
        half_edge = np.flatnonzero(tri.twin == -2)
        tail, head = tri.tail(half_edge), tri.head(half_edge)
        ends = np.stack([np.minimum(tail, head), np.maximum(tail, head)], axis=1)
        first, edge, _ = connectivity.unique_rows(ends, tri.n)
        edge_of = np.full(len(tri.twin), -1)
        edge_of[half_edge] = edge
        return edge_of, grouping.group_by_label(edge, len(first), half_edge)

    def corners_at(self, vertices: IntArray) -> tuple[IntArray, IntArray]:
        """The corners (k,) of faces at the given vertices, and for each the position of the vertex in `vertices`."""
        return self._corners.of(vertices)

    def spokes(self, vertices: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Edges from the given vertices: position of the vertex in `vertices`, the other end, and the length.

        An edge comes once for each face at it.
        """
        tri = self.triangulation
        corner, which = self.corners_at(vertices)
        following, preceding = next_half_edge(corner), previous_half_edge(corner)
        ends = tri.F.ravel()[np.concatenate([following, preceding])]
        lengths = tri.l.ravel()[np.concatenate([preceding, following])]
        return np.concatenate([which, which]), ends, lengths

    def behind(self, half_edge: IntArray) -> tuple[IntArray, IntArray, BoolArray]:
        """The half-edges glued to the given ones: none on the boundary, one inside, several at crowded edges.

        Returns
        -------
        which : (k,) int64
            Position in `half_edge`.
        other : (k,) int64
            The half-edge glued to that.
        aligned : (k,) bool
            Whether the two run in opposite directions.
        """
        tri = self.triangulation
        twin = tri.twin[half_edge]
        rows = np.flatnonzero(twin != -1)
        at_crowded = rows[twin[rows] == -2]
        if not len(at_crowded):
            return rows, twin[rows], tri.aligned[half_edge[rows]]
        edge_of, groups = self._crowded
        other, position = groups.of(edge_of[half_edge[at_crowded]])
        which = at_crowded[position]
        which, other = which[other != half_edge[which]], other[other != half_edge[which]]
        rows = rows[twin[rows] >= 0]
        aligned = np.append(tri.aligned[half_edge[rows]], tri.tail(half_edge[which]) == tri.head(other))
        return np.append(rows, which), np.append(twin[rows], other), aligned

    def meets_shared_edge(self, vertices: IntArray) -> bool:
        """Whether a face at one of the vertices has an edge of more than two faces."""
        corner, _ = self.corners_at(vertices)
        return bool((self.triangulation.twin.reshape(-1, 3)[corner // 3] == -2).any())
