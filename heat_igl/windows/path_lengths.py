"""Distances as lengths of paths: one answer of exact windows, to be differentiated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import HalfEdges, IntrinsicTriangulation
from heat_igl.mesh import SurfacePoints
from heat_igl.sources import SourceSet
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.windows.exact import ExactSurface
from heat_igl.windows.path_derivatives import Change, Paths, Places, Starts, Ways

__all__ = ["PathLengths", "SideChange", "from_windows"]


class SideChange(NamedTuple):
    """How what an answer was found on changes.

    Attributes
    ----------
    by_side : (m, 3) float64
        The sides of the triangulation.
    by_place : (p, 3) float64 or None
        The coordinates of source points in it.
    by_given, by_given_place : (m', 3), (p, 3) float64, or None
        The same of the faces before any flip.
    """

    by_side: FloatArray
    by_place: FloatArray | None = None
    by_given: FloatArray | None = None
    by_given_place: FloatArray | None = None


class PathLengths:
    """The paths of one answer, on the triangulation that they were found on.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        m triangles on n vertices.
    paths : Paths
        On these triangles.
    points : SurfacePoints or None
        Source points in the faces of the mesh.
    """

    def __init__(
        self,
        triangulation: IntrinsicTriangulation,
        paths: Paths,
        points: SurfacePoints | None,
    ) -> None:
        self.triangulation, self._paths, self._points = triangulation, paths, points

    @property
    def lost(self) -> IntArray:
        """Vertices whose path could not be followed to its end: it does not count in the derivative."""
        return np.flatnonzero(self._paths.is_lost)

    def pull_back(self, g: FloatArray) -> Change:
        """The derivative of the sum of distances times g (n,), by the sides of the triangulation."""
        change = self._paths.pull_back(g)
        if change.by_place is not None:
            change = change._replace(by_place=self._by_points(change.by_place))
        return change

    def _by_points(self, by_place: FloatArray) -> FloatArray:
        """The derivative (p, 3) by the coordinates of each source point in its own triangle.

        Of a point on a side, the triangle on the other side has a copy: it knows the derivative along the side alone.
        """
        if self._points is None:
            return by_place
        result = np.zeros((len(self._points), 3))
        for c, (known, point, corner) in enumerate(self._own_corners(self._points)):
            np.add.at(result, (point, corner), by_place[known, c])
        return result

    def _at_places(self, by_point: FloatArray) -> FloatArray:
        """The changes of all places, from those (p, 3) of the coordinates of each source point in its own triangle."""
        if self._points is None:
            return by_point
        result = np.zeros((len(self._paths.places.faces), 3))
        for c, (known, point, corner) in enumerate(self._own_corners(self._points)):
            result[known, c] = by_point[point, corner]
        return result

    def _own_corners(self, points: SurfacePoints) -> list[tuple[BoolArray, IntArray, IntArray]]:
        """For each corner of the places' triangles: whether the point's own triangle has it, the point, the corner."""
        places = self._paths.places
        F = self._paths.corners(places.faces)
        own_faces, _ = self.triangulation.locate(points.faces, points.barycentric)
        own = self.triangulation.F[own_faces[places.point]]
        same = [own == F[:, [c]] for c in range(3)]
        known = [at.any(axis=1) for at in same]
        return [(k, places.point[k], at.argmax(axis=1)[k]) for at, k in zip(same, known, strict=True)]

    def push_forward(self, change: SideChange) -> FloatArray:
        """How the distances (n,) change with the sides and the places of points, those of the triangulation alone."""
        by_place = None if change.by_place is None else self._at_places(change.by_place)
        return np.asarray(self._paths.push_forward(change.by_side, by_place))

    def lengths(self) -> FloatArray:
        """Lengths (n,) of the paths; 0 at unreachable vertices."""
        return np.asarray(self._paths.lengths())


def from_windows(surface: ExactSurface, triangulation: IntrinsicTriangulation, sources: SourceSet) -> PathLengths:
    """The paths that exact windows on a triangulation find from vertices and points."""
    starts = Starts.of(sources)
    found = surface.solve(starts.vertices, starts.offsets, starts.points, starts.point_offsets)
    origin, n = found.origin, triangulation.n
    places = Places.none()
    begins = np.append(found.distance, 0.0)
    if starts.points is not None and starts.point_offsets is not None:
        placed = surface.located(starts.points)
        places = Places(*placed, starts.point_offsets[placed[2]])
        begins = np.concatenate([found.distance, starts.point_offsets, [0.0]])
    length = triangulation.l.ravel()[origin.entered]
    ways = Ways(found.distance, origin.entered, origin.crossing / length, found.distance - begins[origin.root])
    paths = Paths(HalfEdges.of(triangulation), places, ways, is_source=origin.root == np.arange(n))
    return PathLengths(triangulation, paths, starts.points)
