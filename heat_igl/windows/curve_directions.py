"""Directions of exact paths from curves, and the places on the curves at which the paths start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heat_igl.mesh import ON_SIDE, SurfacePoints
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.operators import Surface
from heat_igl.typing import IntArray
from heat_igl.windows.directions import PathAngles, PathDirections
from heat_igl.windows.exact import ExactSolution

__all__ = ["CurveDirections"]


class CurveDirections:
    """Angles of exact paths on the given faces, in which curves run; argument and errors as for `PathDirections`."""

    def __init__(self, surface: Surface) -> None:
        faces = surface.unfolding if surface.faces is None else surface.faces
        self._directions = PathDirections(replace(surface, triangulation=faces, uncovered=None))
        corner_at = np.zeros(faces.n, np.int64)
        corner_at[faces.F.ravel()[::-1]] = np.arange(faces.F.size)[::-1]
        # The first corner of the faces at each vertex.
        self._corner_at = corner_at

    def of_windows(self, found: ExactSolution) -> tuple[PathAngles, SurfacePoints]:
        """The angles of the paths to n vertices, and the places (n,) at which the paths start.

        The departure of a path from a place inside a face counts in that face, and from a corner around the vertex.
        Where no source is reached, the place is a corner of face 0.
        """
        root, leaving = found.origin.root, found.leaving
        if leaving is None or leaving.place is None:
            raise ValueError("of_windows needs a solution that was asked for with directed=True, from segments")
        n, first = len(root), _first_parts(found)
        start = root[first]
        at_vertex = np.flatnonzero((start >= 0) & (start < n))
        corner = np.where(root < 0, 0, leaving.corner[first])
        corner[at_vertex] = self._corner_at[start[at_vertex]]
        barycentric, faces = leaving.place[first], corner // 3
        others = np.append(at_vertex, np.flatnonzero(root < 0))
        barycentric[others] = np.eye(3)[corner[others] % 3]
        angles = self._directions.of_windows(found)
        # A segment that ends at a vertex leads there too, with an angle in the face.
        at_corner = np.flatnonzero((start >= n) & (barycentric.max(axis=1) > 1 - ON_SIDE))
        corner = corner[at_corner] // 3 * 3 + barycentric[at_corner].argmax(axis=1)
        angles.departure[at_corner] = self._directions.around_corners(corner, angles.departure[at_corner])
        barycentric[at_corner] = np.eye(3)[corner % 3]
        return angles, unchecked_points(faces, barycentric)


def _first_parts(found: ExactSolution) -> IntArray:
    """The vertex (n,) that the straight first part of each path leads to."""
    root, n = found.origin.root, len(found.distance)
    has_bend = np.flatnonzero((root >= 0) & (root < n))
    # Behind the bend; sources are their own roots.
    has_bend = has_bend[root[root[has_bend]] != root[has_bend]]
    first = np.arange(n)
    first[has_bend] = root[has_bend]
    while not ((further := first[first]) == first).all():
        first = further
    return first
