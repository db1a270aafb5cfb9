"""Distances as lengths of paths: one answer of exact windows, to be differentiated by the lengths of the sides.

`heat_igl.kernels.windows.derivatives` derives them. A path is known by the last vertex or source point
before each vertex, from which a straight line leads to it; up to there it is the path of that vertex.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.kernels.windows import derivatives as kernels
from heat_igl.mesh import SurfacePoints
from heat_igl.sources import SourceSet
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.windows.exact import ExactSurface, search, starts_at


class Change(NamedTuple):
    """The derivative of a weighted sum of distances by what paths are found on, or how that changes.

    Attributes
    ----------
    by_side : (m, 3) float64
        By the length of the side opposite each corner; an edge of two faces changes both of its sides.
    by_place : (p, 3) float64 or None
        By the coordinates of each source point, up to a constant in each row; None without points.
    """

    by_side: FloatArray
    by_place: FloatArray | None = None


class PathLengths:
    """The paths of one answer, which exact windows find from vertices and points.

    Parameters
    ----------
    surface : ExactSurface
        The triangles that the paths run on.
    triangulation : IntrinsicTriangulation
        What the surface was made from: m triangles on n vertices.
    sources : SourceSet
        Vertices, and points in the faces of the mesh.
    """

    def __init__(self, surface: ExactSurface, triangulation: IntrinsicTriangulation, sources: SourceSet) -> None:
        self._points = points = sources.points
        has_points = len(points.faces) > 0
        places = SurfacePoints(points.faces, points.barycentric) if has_points else None
        late = points.offset if has_points else None
        self.triangulation, self._tables = triangulation, surface.tables
        starts = starts_at(surface.tables, sources.vertices, sources.vertex_offset, places, late, None)
        found = search(surface.tables, starts).found
        order = np.argsort(found.distance, kind="stable")
        self._places, self._arguments = starts.points, (surface.tables, found, starts, order)

    def pull_back(self, g: FloatArray) -> Change:
        """The derivative of the sum of distances times g (n,), by the sides of the triangulation."""
        tables, e = self._tables, len(self._places.faces)
        weight, by_table, by_place = np.zeros(tables.n + e), np.zeros(len(tables.edges.length)), np.zeros((e, 3))
        weight[tables.number] = g
        kernels.pull_back(*self._arguments, weight, by_table, by_place)
        by_side = np.zeros(self.triangulation.l.shape)
        by_side[tables.face] = by_table.reshape(-1, 3)
        return Change(by_side, self._by_points(tables.unscaled(by_place)) if len(self._points.faces) else None)

    def _by_points(self, by_place: FloatArray) -> FloatArray:
        """The derivative (p, 3) by the coordinates of each source point in its own triangle.

        Of a point on a side, the triangle on the other side has a copy: it knows the derivative along the side alone.
        """
        result = np.zeros((len(self._points.faces), 3))
        for c, (known, point, corner) in enumerate(self._own_corners()):
            np.add.at(result, (point, corner), by_place[known, c])
        return result

    def _at_places(self, by_point: FloatArray) -> FloatArray:
        """The changes of all places, from those (p, 3) of the coordinates of each source point in its own triangle."""
        result = np.zeros((len(self._places.faces), 3))
        for c, (known, point, corner) in enumerate(self._own_corners()):
            result[known, c] = by_point[point, corner]
        return result

    def _own_corners(self) -> list[tuple[BoolArray, IntArray, IntArray]]:
        """For each corner of the places' triangles: whether the point's own triangle has it, the point, the corner."""
        places, points = self._places, self._points
        F = self.triangulation.F[self._tables.face[places.faces]]
        own_faces, _ = self.triangulation.locate(points.faces, points.barycentric)
        own = self.triangulation.F[own_faces[places.point]]
        same = [own == F[:, [c]] for c in range(3)]
        known = [at.any(axis=1) for at in same]
        return [(k, places.point[k], at.argmax(axis=1)[k]) for at, k in zip(same, known, strict=True)]

    def push_forward(self, change: Change) -> FloatArray:
        """How the distances (n,) change with the sides and the places of points, those of the triangulation alone."""
        moves = np.zeros((len(self._places.faces), 3)) if change.by_place is None else self._at_places(change.by_place)
        return self._summed(change.by_side, moves, np.zeros(self._tables.n + len(moves)))

    def lengths(self) -> FloatArray:
        """Distances (n,) summed along the paths; 0 where there is none."""
        # A line is homogeneous in the sides (Euler); to it comes the distance at which the source starts.
        tables, found, starts, _ = self._arguments
        begin = np.where(found.root == np.arange(tables.n), found.distance, 0.0)
        moves = np.zeros((len(self._places.faces), 3))
        return self._summed(self.triangulation.l, moves, np.concatenate([begin, starts.point_offset]))

    def _summed(self, by_side: FloatArray, moves: FloatArray, change: FloatArray) -> FloatArray:
        """Changes (n,) of distances when sides and places change, and offsets of sources, in the unit of the tables."""
        tables = self._tables
        kernels.push_forward(*self._arguments, tables.scaled(by_side[tables.face]).ravel(), moves, change)
        return tables.unscaled(change[tables.number])
