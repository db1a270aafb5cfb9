"""Triangulations known by their edge lengths and the gluing of their faces, and the changes that led to them.

Half-edge ``3 * f + c`` is the side of face ``f`` opposite corner ``c``; ``l[f, c]`` is the length, as in libigl.
After flips, an edge may join a vertex to itself, and several edges may join the same two vertices. The vertices of the
faces then do not determine the gluing, so it is stored (`IntrinsicTriangulation.twin`).

Merging, reversing and flipping faces keep the surface, but give a point another face or other barycentric coordinates.
A flip replaces two triangles, laid out in the plane on either side of their edge, by two others that cover the same
quadrilateral; a point keeps the same place in the plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import igl
import numpy as np

from heat_igl.kernels.mesh import carrying
from heat_igl.mesh import connectivity
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Faces on the back have the opposite orientation: corners 1 and 2 are swapped.
BACK_CORNERS = np.array([0, 2, 1])


def apex(base: FloatArray, left: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corner (x, y), y >= 0, opposite the bases of triangles that run from the origin along the positive first axis.

    `base`, `left` and `right` (k,) are the lengths of the bases, and of the sides at the origin and at the other end.
    The height y comes from the area by Kahan's form of Heron's formula: ``sqrt(left^2 - x^2)`` loses the digits of
    slivers.
    """
    x = (base + (left - right) * ((left + right) / base)) / 2
    height = igl.doublearea(np.stack([base, left, right], axis=1), 0.0) / base
    return x, np.asarray(height)


def lay_out(l: FloatArray) -> FloatArray:
    """Corners (k, 3, 2) of triangles with edge lengths `l` (k, 3): corner 0 at the origin, corner 1 at (l[:, 2], 0)."""
    x, y = apex(l[:, 2], l[:, 1], l[:, 0])
    corners = np.zeros((len(l), 3, 2))
    corners[:, 1, 0], corners[:, 2, 0], corners[:, 2, 1] = l[:, 2], x, y
    return corners


def corner_angles(l: FloatArray) -> FloatArray:
    """Angle (k, 3) at each corner of triangles with edge lengths `l` (k, 3), opposite the corners.

    From half the angle, ``tan^2 = (s - b)(s - c) / (s (s - a))`` with s half the perimeter. The error is that of a
    change of the lengths by some 1e-16 of the longest; the arccosine of the cosine rule loses half the digits of a
    small angle.
    """
    beside = np.roll(l, -1, axis=1), np.roll(l, 1, axis=1)
    half = l.sum(axis=1, keepdims=True) / 2
    opposite = np.maximum((half - beside[0]) * (half - beside[1]), 0.0)
    return np.asarray(2 * np.arctan2(np.sqrt(opposite), np.sqrt(np.maximum(half * (half - l), 0.0))))


class Merged(NamedTuple):
    """Faces removed because another has the same vertices: the new face of each, and the corners (m, 3) of that."""

    face: IntArray
    corner: IntArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points after the change."""
        moved = np.empty_like(barycentric)
        np.put_along_axis(moved, self.corner[faces], barycentric, axis=1)
        return self.face[faces], moved

    def before(self, F: IntArray) -> IntArray:
        """The vertices (m, 3) of the old faces, from those of the new."""
        return np.asarray(np.take_along_axis(F[self.face], self.corner, axis=1))


class Turned(NamedTuple):
    """Faces turned over by reversing their rows, those of the mask (m,): corner c became corner 2 - c."""

    turned: BoolArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points after the change."""
        return faces, np.where(self.turned[faces, None], barycentric[:, ::-1], barycentric)


class Covered(NamedTuple):
    """Faces doubled: face f of m stays as the front, face m + f is the back, with corners 1 and 2 swapped."""

    n_faces: int

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points on the front."""
        return faces, barycentric


class Moved(NamedTuple):
    """Edges flipped, and faces split at new vertices, one after another.

    A flip of the half-edges ab opposite corner p and ba opposite corner q makes the first face paq and the second qbp;
    p and q are the same corners as before.

    Attributes
    ----------
    kind : (k, 3) int64
        The moves in order: 0, face, first of the two new faces for a split; 1, half-edge ab, ba for a flip.
    numbers : (k, 5) float64
        Barycentric coordinates of the new vertex, or the lengths of ab, pa, bp, aq and qb.
    first, following : (m,) int64, (k, 3) int64
        Tables to find the next move that concerns a face, see `heat_igl.kernels.mesh.carrying`.
    """

    kind: IntArray
    numbers: FloatArray
    first: IntArray
    following: IntArray

    @classmethod
    def of(cls, kind: IntArray, numbers: FloatArray, m: int) -> Moved:
        """Moves that lead to m faces."""
        return cls(kind, numbers, *carrying.index_moves(kind, m))

    def carry(
        self, faces: IntArray, barycentric: FloatArray, turn: FloatArray | None = None
    ) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points after the change.

        To `turn` (k,) is added what leads from an angle in the face after the change to the angle of the same direction
        in the face before, if all moves are flips. Angles in a face count from the side of its corners 0 and 1.
        """
        faces, barycentric = np.array(faces, np.int64), np.array(barycentric, np.float64, order="C")
        carrying.carry(*self, faces, barycentric, np.empty(0) if turn is None else turn)
        return faces, barycentric


# How faces became others.
Change = Merged | Turned | Covered | Moved


def next_half_edge(half_edge: IntArray) -> IntArray:
    """The half-edge after each in the same face; of corners, the next corner."""
    # Twice as fast as by face and corner.
    return np.asarray(half_edge + 1 - 3 * (half_edge % 3 == 2))


def previous_half_edge(half_edge: IntArray) -> IntArray:
    """The half-edge before each in the same face; of corners, the previous corner."""
    return np.asarray(half_edge - 1 + 3 * (half_edge % 3 == 0))


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
        return connectivity.mask_of(np.concatenate([self.tail(outer), self.head(outer)]), self.n)

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

    @cached_property
    def mean_edge_length(self) -> float:
        """Mean length of `edges`."""
        return float(self.l.ravel()[self.edges].mean())

    @cached_property
    def n_used(self) -> int:
        """Number of vertices that a triangle uses."""
        return int(np.count_nonzero(connectivity.mask_of(self.F, self.n)))

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

    def locate(self, faces: IntArray, barycentric: FloatArray, on_back: bool = False) -> tuple[IntArray, FloatArray]:
        """Points of the mesh, given by faces (k,) of the mesh and barycentric coordinates (k, 3), in these triangles.

        Returns the triangle of each, and the coordinates in it; in a cover they are on the front, or `on_back`.
        """
        for change in self.history:
            faces, barycentric = change.carry(faces, barycentric)
            if on_back and isinstance(change, Covered):
                faces, barycentric = faces + change.n_faces, barycentric[:, BACK_CORNERS]
        return faces, barycentric
