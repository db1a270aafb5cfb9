"""Where a point of the mesh lies after faces were turned over and edges flipped.

The surface stays the same, but a face of the triangulation is not the face of the mesh with the same number. Flips are
rigid motions of the plane around one edge, so a point is carried through them one round after the other.
"""

from __future__ import annotations

from typing import NamedTuple

import igl
import numpy as np

from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["Flipped", "Merged", "Turned", "apex"]


def apex(base: FloatArray, left: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corner opposite the base of triangles whose base starts at the origin and runs along the first axis."""
    x = (base + (left - right) * ((left + right) / base)) / 2
    height = igl.doublearea(np.stack([base, left, right], axis=1), 0.0) / base
    return x, np.asarray(height)


class Merged(NamedTuple):
    """Faces that were left out because another has the same vertices.

    Attributes
    ----------
    face : (m,) int64
        What each face became.
    corner : (m, 3) int64
        Which corner of that face each corner became.
    """

    face: IntArray
    corner: IntArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """The points (k,), (k, 3) afterwards."""
        moved = np.empty_like(barycentric)
        np.put_along_axis(moved, self.corner[faces], barycentric, axis=1)
        return self.face[faces], moved

    def before(self, F: IntArray) -> IntArray:
        """The vertices (m, 3) of all faces, from those of the faces that are left."""
        return np.asarray(np.take_along_axis(F[self.face], self.corner, axis=1))


class Turned(NamedTuple):
    """Faces whose row was reversed, so that corner c became corner 2 - c.

    Attributes
    ----------
    turned : (m,) bool
        Which.
    """

    turned: BoolArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """The points (k,), (k, 3) afterwards."""
        return faces, np.where(self.turned[faces, None], barycentric[:, ::-1], barycentric)


class Flipped(NamedTuple):
    """Edges, no two in one face, that were flipped at once.

    Attributes
    ----------
    half_edge, mate : (k,) int64
        The two sides of each edge. Before: corner p opposite `half_edge` ab, corner q opposite `mate` ba. After: the
        face of the first is paq, that of the second qbp, with p and q where they were.
    lengths : (5, k) float64
        Of ab, pa, bp, aq and qb.
    """

    half_edge: IntArray
    mate: IntArray
    lengths: FloatArray

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """The points (k,), (k, 3) afterwards."""
        sides = np.concatenate([self.half_edge, self.mate])
        ascending = np.argsort(sides // 3)
        place = np.searchsorted(sides[ascending] // 3, faces)
        moved = np.flatnonzero(place < len(sides))
        moved = moved[sides[ascending[place[moved]]] // 3 == faces[moved]]
        if not len(moved):
            return faces, barycentric
        side = ascending[place[moved]]
        edge, in_second = side % len(self.mate), side >= len(self.mate)
        ab, pa, bp, aq, qb = self.lengths[:, edge]
        # a at the origin, b on the first axis, p above and q below it.
        (px, py), (qx, qy) = apex(ab, pa, bp), apex(ab, aq, qb)
        corner = (sides[side, None] + np.arange(3)) % 3
        at_apex, at_tail, at_head = np.take_along_axis(barycentric[moved], corner, axis=1).T
        x = np.where(in_second, at_tail * ab + at_apex * qx, at_head * ab + at_apex * px)
        y = at_apex * np.where(in_second, -qy, py)
        # Twice the areas that pq spans with the point, with a and with b: above 0 on the side of a.
        of_point = (px - qx) * (y + qy) - (py + qy) * (x - qx)
        of_a, of_b = (px - qx) * qy + (py + qy) * qx, (px - qx) * qy - (py + qy) * (ab - qx)
        in_first = of_point >= 0
        third = np.clip(of_point / np.where(in_first, of_a, of_b), 0.0, 1.0)
        at_p = np.clip((y + (1 - third) * qy) / (py + qy), 0.0, 1 - third)
        at_q = 1 - third - at_p
        corner = (np.where(in_first, self.half_edge[edge], self.mate[edge])[:, None] + np.arange(3)) % 3
        faces, barycentric = faces.copy(), barycentric.copy()
        faces[moved] = np.where(in_first, self.half_edge[edge], self.mate[edge]) // 3
        barycentric[moved[:, None], corner] = np.stack(
            [np.where(in_first, at_p, at_q), third, np.where(in_first, at_q, at_p)], axis=1
        )
        return faces, barycentric
