"""The directions in which shortest paths leave their sources and arrive, in the tangent planes of the vertices."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import PolarAngles, carried_angles, lay_out, polar_angles
from heat_igl.intrinsic.triangulation import Flipped, next_half_edge, previous_half_edge
from heat_igl.mesh import ON_SIDE, SurfacePoints
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.operators import Surface
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.windows.exact import ExactSolution

_WHOLE = 2 * np.pi


def in_circle(angles: FloatArray) -> FloatArray:
    """Angles (k,) in [0, 2 pi)."""
    # A fifth of the time of a remainder, which for tiny negative angles would be 2 pi, too.
    found = angles - _WHOLE * np.floor(angles / _WHOLE)
    return np.where((found >= 0) & (found < _WHOLE), found, 0.0)


class PathAngles(NamedTuple):
    """Directions of the shortest paths to n vertices, angles in [0, 2 pi); nan at sources and where there is no path.

    Attributes
    ----------
    departure : (n,) float64
        Polar angle at which the path leaves its source vertex; from a source in a face, the angle from the side of
        corners 0 and 1 of the face.
    back : (n,) float64
        Polar angle at the vertex at which the path sets out backwards.
    turning : (n,) float64
        Sum of the angles by which the path turns at the vertices where it bends, counterclockwise, in [-pi, pi]: in
        their tangent planes, on the boundary in the plane of the faces.
    """

    departure: FloatArray
    back: FloatArray
    turning: FloatArray


class WindowWays(NamedTuple):
    """How n paths run that windows found.

    Attributes
    ----------
    vertex : (n,) int64
        The vertex that each leads to.
    root : (n,) int64
        The path that leads to its last bend or its source vertex; n + i for source point i, -1 for no path.
    corner : (n,) int64
        Corner ``3 f + c`` of the triangulation out of which the straight last part leaves the root; -1 for no path.
    direction : (n, 2) float64
        There, from the side to the next corner.
    entered, crossing : (n,) int64, (n,) float64
        As in `Origin`.
    turn : (n,) float64, optional
        As in `Leaving`, for source points.
    """

    vertex: IntArray
    root: IntArray
    corner: IntArray
    direction: FloatArray
    entered: IntArray
    crossing: FloatArray
    turn: FloatArray | None = None


class PathDirections:
    """Angles in the triangles as polar angles of the mesh.

    Parameters
    ----------
    surface : Surface
        An oriented manifold of triangles whose faces are known.

    Raises
    ------
    MeshError
        If the surface has no polar angles, see `polar_angles`.
    """

    def __init__(self, surface: Surface) -> None:
        if surface.faces is None:
            raise MeshError("directions need the faces of the mesh, which this domain does not know")
        given = polar_angles(surface.faces)
        #: Around the vertices of the triangulation.
        self.angles: PolarAngles = (
            given if surface.faces is surface.unfolding else carried_angles(given, surface.unfolding)
        )
        self._faces, self._triangulation = surface.faces, surface.unfolding

    def of_windows(self, found: ExactSolution, points: SurfacePoints | None = None) -> PathAngles:
        """The angles of exact paths, of which `found` knows how they leave, with p sources at `points` in faces.

        Without `points`, the departure of a path from a place inside a face counts in the triangle of that place.
        """
        origin, leaving = found.origin, found.leaving
        if leaving is None:
            raise ValueError("of_windows needs a solution that was asked for with directed=True")
        vertices = np.arange(len(found.distance))
        ways = WindowWays(
            vertices,
            origin.root,
            leaving.corner,
            leaving.direction,
            origin.entered,
            origin.crossing,
            leaving.turn,
        )
        return self.of_ways(ways, points)

    def of_ways(self, ways: WindowWays, points: SurfacePoints | None = None) -> PathAngles:
        """The angles of paths that are named one after the other; `points` as for `of_windows`."""
        angles, n = self.angles, len(ways.vertex)
        row = np.flatnonzero((ways.corner >= 0) & (ways.root >= 0))
        corner, root, (x, y) = ways.corner[row], ways.root[row], ways.direction[row].T
        departure, back = np.full((2, n), np.nan)
        at_vertex = root < n
        seen = np.arctan2(y, x)
        if at_vertex.all():
            departure[row] = self._at_corners(corner, seen)
        else:
            outward = np.flatnonzero(at_vertex)
            departure[row] = seen
            departure[row[outward]] = self._at_corners(corner[outward], seen[outward])
            if points is not None and ways.turn is not None:
                inside = row[~at_vertex]
                departure[inside] += ways.turn[inside] + self._turns(points)[root[~at_vertex] - n]
        # Over the half-edge opposite, or from the source point in the same face.
        entered, crossing = ways.entered[row], ways.crossing[row]
        over = entered >= 0
        half_edge = entered[over]
        # The vertex from the tail; from the angle, as libigl's areas are slow for a few thousand triangles.
        side = self._triangulation.l.ravel()[previous_half_edge(half_edge)]
        turn = angles.corners.ravel()[next_half_edge(half_edge)]
        fx, fy = side * np.cos(turn), side * np.sin(turn)
        seen = np.arctan2(fy * crossing[over], fx * (fx - crossing[over]) + fy * fy)
        back[row[over]] = self._at_corners(half_edge, seen)
        faces = corner[~over] // 3
        if len(faces):
            at = (self._triangulation.F[faces] == ways.vertex[row[~over], None]).argmax(axis=1)
            k, places = np.arange(len(faces)), lay_out(self._triangulation.l[faces])
            ux, uy = (places[k, (at + 1) % 3] - places[k, at]).T
            seen = np.arctan2(uy * x[~over] - ux * y[~over], -ux * x[~over] - uy * y[~over])
            back[row[~over]] = self._at_corners(3 * faces + at, seen)
        scale = np.where(angles.on_boundary, angles.scale, 1.0)[ways.vertex]
        return PathAngles(*_handed_on(row, ways.root, departure, back, scale))

    def _at_corners(self, corner: IntArray, seen: FloatArray) -> FloatArray:
        """Polar angles (k,) of directions that are turned by `seen` from the side to the next corner."""
        angles, v = self.angles, self._triangulation.F.ravel()[corner]
        return _polar(angles.outgoing[previous_half_edge(corner)], seen, angles.scale[v], angles.on_boundary[v])

    def around_corners(self, corner: IntArray, departure: FloatArray) -> FloatArray:
        """Polar angles (k,) of directions at corners, whose angles (k,) count from the first sides of the triangles."""
        seen = departure - self._direction(previous_half_edge(corner))
        return in_circle(self._at_corners(corner, seen - _WHOLE * np.rint(seen / _WHOLE)))

    def _direction(self, half_edge: IntArray) -> FloatArray:
        """The angle (k,) of half-edges in their triangles, from the side of corners 0 and 1."""
        first, angle = half_edge - half_edge % 3, self.angles.corners.ravel()
        return np.choose(half_edge % 3, [np.pi - angle[first + 1], angle[first] - np.pi, np.zeros(len(half_edge))])

    def _turns(self, points: SurfacePoints) -> FloatArray:
        """The angle (p,) of corners 0 and 1 of the triangles that hold points, in the given faces: flips turn them."""
        faces, barycentric = points.faces, points.barycentric
        turn = np.zeros(len(points))
        for flips in self._triangulation.history:
            if not isinstance(flips, Flipped):
                continue  # with other changes there are no polar angles
            after, barycentric = flips.carry(faces, barycentric)
            turn += flips.turn(faces, after)
            faces = after
        return turn


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
        n, first = len(root), first_parts(root)
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


def first_parts(root: IntArray) -> IntArray:
    """The vertex (n,) that the straight first part of each path leads to, from the vertices and sources `root` (n,).

    Sources are their own roots, n and more are source points, and -1 is no path.
    """
    n = len(root)
    first = np.arange(n)
    bends = np.flatnonzero((root >= 0) & (root < n))
    bends = bends[root[root[bends]] != root[bends]]
    first[bends] = root[bends]
    while not ((further := first[first]) == first).all():
        first = further
    return first


def _polar(begin: FloatArray, angles: FloatArray, scale: FloatArray, on_boundary: BoolArray) -> FloatArray:
    """Polar angles (k,) of angles in fans; at the boundary no further than the faces."""
    found = begin + scale * angles
    return np.where(on_boundary, np.clip(found, 0.0, np.pi), found)


def _handed_on(row: IntArray, root: IntArray, departure: FloatArray, back: FloatArray, scale: FloatArray) -> FloatArray:
    """Departure, direction back and turning (3, n) of whole paths, from those of the straight last parts.

    Parameters
    ----------
    row : (k,) int64
        The vertices that have a path.
    root : (n,) int64
        The bend or the source where the last part begins; n and more for source points.
    departure, back : (n,) float64
        Polar angles of the last part, at the root and at the vertex.
    scale : (n,) float64
        Of polar angles over angles as turns count them.
    """
    n = len(scale)
    has_path = np.zeros(n, bool)
    has_path[row] = True
    bends = row[root[row] < n]
    bends = bends[has_path[root[bends]]]
    # The vertex that the part of the path before the first bend ends at. Each step doubles the number that is skipped.
    top, turning, bend = np.arange(n), np.zeros(n), root[bends]
    top[bends] = bend
    turning[bends] = (departure[bends] - back[bend]) / scale[bend] - np.pi
    while True:
        further = top[top]
        if (further == top).all():
            break
        turning += turning[top]
        top = further
    found = np.full((3, n), np.nan)
    found[0, row], found[1, row] = in_circle(departure[top[row]]), in_circle(back[row])
    found[2, row] = turning[row] - _WHOLE * np.rint(turning[row] / _WHOLE)
    return found
