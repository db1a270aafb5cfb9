"""The changes that lead from a mesh to a triangulation, and the coordinates of points after them.

Merging, reversing and flipping faces keep the surface, but give a point another face or other barycentric coordinates.
A flip replaces two triangles, laid out in the plane on either side of their edge, by two others that cover the same
quadrilateral; a point keeps the same place in the plane.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.layout import apex
from heat_igl.kernels.mesh import carrying
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Faces on the back have the opposite orientation: corners 1 and 2 are swapped.
BACK_CORNERS = np.array([0, 2, 1])


class Merged(NamedTuple):
    """Faces removed because another face has the same vertices.

    Attributes
    ----------
    face : (m,) int64
        New face of each old face.
    corner : (m, 3) int64
        Corner of the new face for each corner of the old.
    """

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
    """Faces turned over by reversing their rows: corner c became corner 2 - c.

    Attributes
    ----------
    turned : (m,) bool
        Mask of these faces.
    """

    turned: BoolArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points after the change."""
        return faces, np.where(self.turned[faces, None], barycentric[:, ::-1], barycentric)


class Covered(NamedTuple):
    """Faces doubled: face f stays as the front, face m + f is the back, with corners 1 and 2 swapped.

    Attributes
    ----------
    n_faces : int
        Number m of faces before.
    """

    n_faces: int

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points on the front."""
        return faces, barycentric

    def carry_to_back(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of the same points on the back."""
        return faces + self.n_faces, barycentric[:, BACK_CORNERS]


class Flipped(NamedTuple):
    """Edges flipped at once, no two in one face.

    Attributes
    ----------
    half_edge, mate : (k,) int64
        The two half-edges of each edge. Before: `half_edge` ab opposite corner p, `mate` ba opposite corner q. After:
        the first face is paq, the second qbp; p and q are the same corners as before.
    lengths : (5, k) float64
        Of ab, pa, bp, aq and qb.
    """

    half_edge: IntArray
    mate: IntArray
    lengths: FloatArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points after the change."""
        moved, edge, _ = self.moved(faces)
        faces, barycentric = np.array(faces, np.int64), np.array(barycentric, np.float64, order="C")
        lengths = np.ascontiguousarray(self.lengths.T)
        carrying.carry_flipped(self.half_edge, self.mate, lengths, edge, moved, faces, barycentric)
        return faces, barycentric

    def turn(self, before: IntArray, after: IntArray) -> FloatArray:
        """By how much directions at points turn from the faces (k,) after the change to those before it.

        Angles in a face count from the side of its corners 0 and 1. To add is what leads from an angle in the face
        after the change to the angle of the same direction in the face before.
        """
        turn = np.zeros(len(before))
        moved, edge, in_second = self.moved(before)
        ab, pa, bp, aq, qb = self.lengths[:, edge]
        # As in `carry`: a at the origin, b on the first axis.
        (px, py), (qx, qy) = apex(ab, pa, bp), apex(ab, aq, qb)
        p, q, a, b = px + 1j * py, qx - 1j * qy, np.zeros(len(edge), complex), ab + 0j
        first, second = self.half_edge[edge], self.mate[edge]
        to_second = after[moved] == second // 3
        old = np.where(in_second, [q, b, a], [p, a, b])
        new = np.where(to_second, [q, b, p], [p, a, q])
        axes = []
        for corners, side in ((old, np.where(in_second, second, first)), (new, np.where(to_second, second, first))):
            # The first of the three stands at the corner opposite the edge that is flipped.
            start, end = ((c - side) % 3 for c in (0, 1))
            k = np.arange(len(edge))
            axes.append(corners[end, k] - corners[start, k])
        turn[moved] = np.angle(axes[1] * axes[0].conj())
        return turn

    def moved(self, faces: IntArray) -> tuple[IntArray, IntArray, BoolArray]:
        """The points whose faces (k,) change, which edge is flipped there, and whether the face is its second."""
        sides = np.concatenate([self.half_edge, self.mate])
        ascending = np.argsort(sides // 3)
        place = np.searchsorted(sides[ascending] // 3, faces)
        moved = np.flatnonzero(place < len(sides))
        moved = moved[sides[ascending[place[moved]]] // 3 == faces[moved]]
        side = ascending[place[moved]]
        return moved, side % len(self.mate), side >= len(self.mate)


class Refined(NamedTuple):
    """Faces split at new vertices and edges flipped, one after another.

    Attributes
    ----------
    kind : (k, 3) int64
        The moves in order: 0, face, first of the two new faces for a split; 1, half-edge, mate for a flip.
    numbers : (k, 5) float64
        Barycentric coordinates of the new vertex, or the lengths of `Flipped`.
    first, following : (m,) int64, (k, 3) int64
        Tables to find the next move that concerns a face, see `heat_igl.kernels.mesh.carrying`.
    """

    kind: IntArray
    numbers: FloatArray
    first: IntArray
    following: IntArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Faces (k,) and barycentric coordinates (k, 3) of points after the change."""
        faces, barycentric = np.array(faces, np.int64), np.array(barycentric, np.float64, order="C")
        carrying.carry(*self, faces, barycentric)
        return faces, barycentric


# How faces became others.
Change = Merged | Turned | Covered | Flipped | Refined
