"""Triangulations known by their edge lengths and the gluing of their faces.

Half-edge ``3 * f + c`` is the side of face ``f`` opposite corner ``c``; ``l[f, c]`` is the length, as in libigl.
After flips, an edge may join a vertex to itself, and several edges may join the same two vertices. The vertices of the
faces then do not determine the gluing, so it is stored (`IntrinsicTriangulation.twin`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from heat_igl.intrinsic.history import Change, Covered
from heat_igl.mesh import connectivity
from heat_igl.typing import BoolArray, FloatArray, IntArray


def next_half_edge(half_edge: IntArray) -> IntArray:
    """The half-edge after each in the same face; of corners, the next corner."""
    # Twice as fast as by face and corner.
    return np.asarray(half_edge + 1 - 3 * (half_edge % 3 == 2))


def previous_half_edge(half_edge: IntArray) -> IntArray:
    """The half-edge before each in the same face; of corners, the previous corner."""
    return np.asarray(half_edge - 1 + 3 * (half_edge % 3 == 0))


def sides_from(half_edge: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Each half-edge, and the next and the previous one of the same face."""
    return half_edge, next_half_edge(half_edge), previous_half_edge(half_edge)


@dataclass(frozen=True, eq=False)
class IntrinsicTriangulation:
    """Triangles given by their edge lengths and their gluing.

    Attributes
    ----------
    F : (m, 3) int64
        Vertices of each triangle; a triangle may repeat a vertex, and rows may be equal.
    l : (m, 3) float64
        ``l[f, c]`` is the length of the edge opposite corner ``c``, in the mesh's unit.
    twin : (3 m,) int64
        The half-edge glued to half-edge ``3 f + c``; -1 on the boundary, -2 at edges of more than two faces.
    aligned : (3 m,) bool
        Whether the two faces at a glued half-edge run along it in opposite directions, as on an oriented surface.
    n : int
        Number of vertices, unreferenced ones included.
    n_flips : int
        Number of edges flipped so far.
    lengthening : float
        Largest length that `mollify` added to an edge; 0 unless a triangle was degenerate.
    history : tuple of Change
        The changes that led from the faces of the mesh to these faces, in order.
    """

    F: IntArray
    l: FloatArray
    twin: IntArray
    aligned: BoolArray
    n: int
    n_flips: int = 0
    lengthening: float = 0.0
    history: tuple[Change, ...] = ()

    @property
    def boundary(self) -> BoolArray:
        """Mask (n,) of the vertices on the boundary."""
        outer = np.flatnonzero(self.twin == -1)
        mask = np.zeros(self.n, bool)
        mask[self.tail(outer)] = mask[self.head(outer)] = True
        return mask

    def tail(self, half_edge: IntArray) -> IntArray:
        """Vertex at the tail of each half-edge, in the direction around the face."""
        return np.asarray(self.F.ravel()[next_half_edge(half_edge)])

    def head(self, half_edge: IntArray) -> IntArray:
        """Vertex at which each half-edge ends."""
        return np.asarray(self.F.ravel()[previous_half_edge(half_edge)])

    @property
    def edges(self) -> IntArray:
        """One half-edge (k,) of each edge; one per face at edges of more than two."""
        return np.flatnonzero((self.twin < 0) | (self.twin > np.arange(len(self.twin))))

    @property
    def mean_edge_length(self) -> float:
        """Mean length of `edges`."""
        return float(self.l.ravel()[self.edges].mean())

    @cached_property
    def n_used(self) -> int:
        """Number of vertices that a triangle uses."""
        used = np.zeros(self.n, bool)
        used[self.F] = True
        return int(np.count_nonzero(used))

    @cached_property
    def areas(self) -> FloatArray:
        """Area (m,) of each triangle, by Heron's formula in Kahan's order."""
        return np.asarray(igl.doublearea(self.l, 0.0) / 2)

    @property
    def is_cover(self) -> bool:
        """Whether the triangles cover each face of the surface twice."""
        return any(isinstance(change, Covered) for change in self.history)

    @cached_property
    def _corners(self) -> connectivity.Groups:
        """The corners of faces at each vertex."""
        return connectivity.group_by_label(self.F.ravel(), self.n)

    def corners_at(self, vertices: IntArray) -> tuple[IntArray, IntArray]:
        """The corners (k,) of faces at the given vertices, and for each the position of the vertex in `vertices`."""
        return self._corners.of(vertices)

    def spokes(self, vertices: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Edges from the given vertices: position of the vertex in `vertices`, the other end, and the length.

        An edge comes once for each face at it.
        """
        corner, which = self.corners_at(vertices)
        following, preceding = next_half_edge(corner), previous_half_edge(corner)
        ends = self.F.ravel()[np.concatenate([following, preceding])]
        lengths = self.l.ravel()[np.concatenate([preceding, following])]
        return np.concatenate([which, which]), ends, lengths

    def meets_shared_edge(self, vertices: IntArray) -> bool:
        """Whether a face at one of the vertices has an edge of more than two faces."""
        corner, _ = self.corners_at(vertices)
        return bool((self.twin.reshape(-1, 3)[corner // 3] == -2).any())

    def locate(self, faces: IntArray, barycentric: FloatArray, on_back: bool = False) -> tuple[IntArray, FloatArray]:
        """Points of the mesh, given by faces (k,) of the mesh and barycentric coordinates (k, 3), in these triangles.

        Returns the triangle of each, and the coordinates in it; of a cover, those `on_back` if so asked.
        """
        for change in self.history:
            if on_back and isinstance(change, Covered):
                faces, barycentric = change.carry_to_back(faces, barycentric)
            else:
                faces, barycentric = change.carry(faces, barycentric)
        return faces, barycentric
