"""Source points in the triangles that walks cross, on all sheets, and in the triangles on both sides of an edge."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.intrinsic.fans import Tables
from heat_igl.mesh import SurfacePoints
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.walks import INSIDE, Points

__all__ = ["LocatedPoints", "located_points", "side_direction"]

# A point whose barycentric coordinate is below this lies on the side of its face.
_ON_SIDE = 1e-8


class LocatedPoints(NamedTuple):
    """Places (e,) of points: one for each triangle that holds a point, on each sheet.

    Attributes
    ----------
    faces, barycentric : (e,) int64, (e, 3) float64
        Triangles by the numbers of the tables, and coordinates in them.
    point : (e,) int64
        The point that each is.
    turn : (e,) float64
        The angle by which the side of corners 0 and 1 is turned from that of the first triangle of the point.
    """

    faces: IntArray
    barycentric: FloatArray
    point: IntArray
    turn: FloatArray

    def listed(self, m: int, n: int) -> Points:
        """The places as the kernels read them, for m triangles; rows of points follow those of n vertices."""
        by_face = np.argsort(self.faces, kind="stable")
        ordered = self.faces[by_face]
        first = np.full(m, -1, np.int32)
        first[ordered[::-1]] = by_face[::-1]
        inside = np.zeros(len(ordered), INSIDE)
        inside["barycentric"], inside["turn"] = self.barycentric, self.turn
        inside["following"], inside["row"] = -1, n + self.point
        same = ordered[1:] == ordered[:-1]
        inside["following"][by_face[:-1][same]] = by_face[1:][same]
        return Points(first, inside)


def located_points(
    triangulation: IntrinsicTriangulation, face: AnyArray, tables: Tables, n_sheets: int, points: SurfacePoints
) -> LocatedPoints:
    """Locate points in the triangles of tables.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        The triangles before they were numbered.
    face : (n_sheets m,) int32
        Rows of the tables of the triangles.
    tables : Tables
        What the kernels read.
    n_sheets : int
        1, or 2 for the double cover of a surface that cannot be oriented.
    points : SurfacePoints
        Points on the faces from which `triangulation` was made.
    """
    faces, barycentric = triangulation.locate(points.faces, points.barycentric)
    point = np.arange(len(faces))
    if n_sheets == 2:
        # On the other sheet faces are turned over: their corners 1 and 2 change places.
        faces = np.concatenate([faces, faces + len(triangulation.F)])
        barycentric = np.concatenate([barycentric, barycentric[:, [0, 2, 1]]])
        point = np.tile(point, 2)
    faces = face[faces]
    # A point on a side also lies in the face beyond it.
    i, c = np.nonzero(barycentric < _ON_SIDE)
    beyond = tables.across(faces[i], c)
    there = np.flatnonzero(beyond >= 0)
    i, c, beyond = i[there], c[there], beyond[there]
    following = beyond - beyond % 3 + (beyond + 1) % 3
    other = np.zeros((len(i), 3))
    # The corner after the far one is at the end, as seen from here, of the side that starts after corner c.
    other[np.arange(len(i)), following % 3] = barycentric[i, (c + 2) % 3]
    other[np.arange(len(i)), (following + 1) % 3] = barycentric[i, (c + 1) % 3]
    # The same side runs the other way there.
    angle = tables.step["angle"]
    turn = side_direction(3 * faces[i] + c, angle) + np.pi - side_direction(beyond, angle)
    return LocatedPoints(
        np.concatenate([faces, following // 3]),
        np.concatenate([barycentric, other]),
        np.concatenate([point, point[i]]),
        np.concatenate([np.zeros(len(point)), turn]),
    )


def side_direction(half_edge: IntArray, angle: FloatArray) -> FloatArray:
    """The angle (k,) of half-edges in their triangles, from the side of corners 0 and 1; `angle` (3 m,) at corners."""
    first = half_edge - half_edge % 3
    return np.choose(half_edge % 3, [np.pi - angle[first + 1], angle[first] - np.pi, np.zeros(len(half_edge))])
