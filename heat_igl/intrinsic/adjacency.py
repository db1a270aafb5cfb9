"""Neighbours in a triangulation: the corners and edges at a vertex."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, next_half_edge, previous_half_edge
from heat_igl.mesh import grouping
from heat_igl.typing import FloatArray, IntArray

__all__ = ["Adjacency"]


class Adjacency:
    """Neighbours of vertices, also if more than two faces meet at an edge.

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

    def meets_shared_edge(self, vertices: IntArray) -> bool:
        """Whether a face at one of the vertices has an edge of more than two faces."""
        corner, _ = self.corners_at(vertices)
        return bool((self.triangulation.twin.reshape(-1, 3)[corner // 3] == -2).any())
