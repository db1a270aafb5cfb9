"""The directions in which shortest paths leave their sources and arrive, in the tangent planes of the vertices."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import (
    PolarAngles,
    TangentFrames,
    carried_angles,
    corner_angles,
    intrinsic_triangulation,
    lay_out,
    polar_angles,
)
from heat_igl.intrinsic.triangulation import Moved, next_half_edge, previous_half_edge
from heat_igl.kernels.windows.surface import SEVERAL_FANS
from heat_igl.mesh import ON_SIDE, Mesh, SurfacePoints
from heat_igl.mesh.cloud_orientation import on_one_side
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.operators import Surface
from heat_igl.sources import SourcePoints, SourceSet, source_set
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows.exact import ExactSolution, Origin, search
from heat_igl.windows.invariants import Invariants
from heat_igl.windows.tables import Tables, from_mesh

_WHOLE = 2 * np.pi
# An edge before and after mollification: largest relative difference of its lengths, and of two angles in radians.
_SAME_LENGTH, _SAME_ANGLE = 1e-7, 1e-5
# Angles around the source are compared at this number of edges at least: with one, a wrong match is not noticed.
_FEWEST_EDGES = 2


def in_circle(angles: FloatArray) -> FloatArray:
    """Angles (k,) in [0, 2 pi)."""
    # Takes a fifth of the time of np.mod, which returns 2 pi for tiny negative angles.
    found = angles - _WHOLE * np.floor(angles / _WHOLE)
    return np.where((found >= 0) & (found < _WHOLE), found, 0.0)


class PathAngles(NamedTuple):
    """Directions of the shortest paths to n vertices, angles in [0, 2 pi); nan at sources and where there is no path.

    Attributes
    ----------
    departure : (n,) float64
        Polar angle at which the path leaves its source vertex; for a source inside a face, the angle from the side of
        corners 0 and 1 of the face.
    back : (n,) float64
        Polar angle at the end vertex of the direction back along the path.
    turning : (n,) float64
        Sum of the counterclockwise turning angles at the vertices where the path bends, in [-pi, pi]: measured in the
        tangent planes of these vertices, on the boundary in the plane of the unfolded faces.
    """

    departure: FloatArray
    back: FloatArray
    turning: FloatArray


class PathDirections:
    """Converts directions in triangles to polar angles at the vertices of the mesh, an oriented manifold.

    A MeshError if it has no polar angles, see `polar_angles`.
    """

    def __init__(self, surface: Surface) -> None:
        given = polar_angles(surface.faces)
        #: Polar angles of the half-edges around the vertices of the triangulation.
        self.angles: PolarAngles = (
            given if surface.faces is surface.unfolding else carried_angles(given, surface.unfolding)
        )
        self._triangulation = surface.unfolding
        # One corner of the given faces at each vertex.
        self._first = np.maximum(given.first, 0)

    def of_windows(self, found: ExactSolution, sources: SourceSet) -> tuple[PathAngles, SurfacePoints]:
        """The angles of the shortest paths of a directed search, and the points (n,) at which they start.

        The departure of a path is measured in the face of its start point, or around the vertex if the point is at a
        corner. Without a path, the point is a corner of face 0.
        """
        origin, vertices = found.origin, np.arange(len(found.distance))
        if origin.place is not None:
            return self._of_curves(self.of_ways(vertices, origin), origin, origin.place)
        # The last entry stands for no source, whose label is -1.
        corner, points, nothing = self._first[sources.vertices], sources.points, np.zeros(1, np.int64)
        faces = np.concatenate([corner // 3, points.faces, nothing])
        barycentric = np.concatenate([np.eye(3)[corner % 3], points.barycentric, np.eye(3)[:1]])
        starts = unchecked_points(faces[origin.label], barycentric[origin.label])
        return self.of_ways(vertices, origin, points), starts

    def _of_curves(self, angles: PathAngles, origin: Origin, place: FloatArray) -> tuple[PathAngles, SurfacePoints]:
        """`of_windows` for paths from segments."""
        root, corner = origin.root, origin.corner
        n, first = len(root), first_parts(root)
        start = root[first]
        at_vertex = np.flatnonzero((start >= 0) & (start < n))
        corner = np.where(root < 0, 0, corner[first])
        corner[at_vertex] = self._first[start[at_vertex]]
        barycentric, faces = place[first], corner // 3
        others = np.append(at_vertex, np.flatnonzero(root < 0))
        barycentric[others] = np.eye(3)[corner[others] % 3]
        # Paths from the end of a segment at a vertex: their angle in the face is converted to one around the vertex.
        at_corner = np.flatnonzero((start >= n) & (barycentric.max(axis=1) > 1 - ON_SIDE))
        corner = corner[at_corner] // 3 * 3 + barycentric[at_corner].argmax(axis=1)
        seen = angles.departure[at_corner] - self._direction(previous_half_edge(corner))
        angles.departure[at_corner] = in_circle(self._at_corners(corner, seen - _WHOLE * np.rint(seen / _WHOLE)))
        barycentric[at_corner] = np.eye(3)[corner % 3]
        return angles, unchecked_points(faces, barycentric)

    def of_ways(self, vertex: IntArray, ways: Origin, points: SourcePoints | None = None) -> PathAngles:
        """The angles of n paths to `vertex` (n,), with p sources at `points` in faces.

        Roots in `ways` are indices of the paths to the last bend or to the source vertex, and n + i for source point i.
        Without `points`, the departure of a path from a point inside a face is measured in the triangle of the point.
        """
        angles, n, corner = self.angles, len(vertex), ways.corner
        row = np.flatnonzero((corner >= 0) & (ways.root >= 0))
        corner, root, (x, y) = corner[row], ways.root[row], ways.direction[row].T
        departure, back = np.full((2, n), np.nan)
        at_vertex = root < n
        seen = np.arctan2(y, x)
        departure[row] = seen
        departure[row[at_vertex]] = self._at_corners(corner[at_vertex], seen[at_vertex])
        if points is not None and ways.turn is not None:
            inside = row[~at_vertex]
            departure[inside] += ways.turn[inside] + self._turns(points)[root[~at_vertex] - n]
        # The path enters over the opposite half-edge, or comes from a source point in the same face.
        entered, crossing = ways.entered[row], ways.crossing[row]
        over = entered >= 0
        half_edge = entered[over]
        # Position of the vertex relative to the tail, from the angle, since libigl's areas are slow for few triangles.
        side = self._triangulation.l.ravel()[previous_half_edge(half_edge)]
        turn = angles.corners.ravel()[next_half_edge(half_edge)]
        fx, fy = side * np.cos(turn), side * np.sin(turn)
        seen = np.arctan2(fy * crossing[over], fx * (fx - crossing[over]) + fy * fy)
        back[row[over]] = self._at_corners(half_edge, seen)
        faces = corner[~over] // 3
        if len(faces):
            at = (self._triangulation.F[faces] == vertex[row[~over], None]).argmax(axis=1)
            k, places = np.arange(len(faces)), lay_out(self._triangulation.l[faces])
            ux, uy = (places[k, (at + 1) % 3] - places[k, at]).T
            seen = np.arctan2(uy * x[~over] - ux * y[~over], -ux * x[~over] - uy * y[~over])
            back[row[~over]] = self._at_corners(3 * faces + at, seen)
        scale = np.where(angles.on_boundary, angles.scale, 1.0)[vertex]
        return PathAngles(*_handed_on(row, ways.root, departure, back, scale))

    def _at_corners(self, corner: IntArray, seen: FloatArray) -> FloatArray:
        """Polar angles (k,) of directions at angles `seen` from the side to the next corner; none leaves the faces."""
        angles, v = self.angles, self._triangulation.F.ravel()[corner]
        found = angles.outgoing[previous_half_edge(corner)] + angles.scale[v] * seen
        return np.where(angles.on_boundary[v], np.clip(found, 0.0, np.pi), found)

    def _direction(self, half_edge: IntArray) -> FloatArray:
        """The angle (k,) of half-edges in their triangles, from the side of corners 0 and 1."""
        first, angle = half_edge - half_edge % 3, self.angles.corners.ravel()
        return np.choose(half_edge % 3, [np.pi - angle[first + 1], angle[first] - np.pi, np.zeros(len(half_edge))])

    def _turns(self, points: SourcePoints) -> FloatArray:
        """Angle (p,) by which flips turn the side of corners 0 and 1 of the triangles that contain the points."""
        faces, barycentric = points.faces, points.barycentric
        turn = np.zeros(len(faces))
        for flips in self._triangulation.history:
            if isinstance(flips, Moved):  # surfaces with other changes have no polar angles
                faces, barycentric = flips.carry(faces, barycentric, turn)
        return turn


def first_parts(root: IntArray) -> IntArray:
    """The vertex (n,) at which the first straight part of each path ends, from the roots of the last parts (n,).

    Source vertices are their own roots; roots of n and more are source points, and -1 means no path.
    """
    n = len(root)
    first = np.arange(n)
    bends = np.flatnonzero((root >= 0) & (root < n))
    bends = bends[root[root[bends]] != root[bends]]
    first[bends] = root[bends]
    while not ((further := first[first]) == first).all():
        first = further
    return first


def _handed_on(row: IntArray, root: IntArray, departure: FloatArray, back: FloatArray, scale: FloatArray) -> FloatArray:
    """Departure, direction back and turning (3, n) of whole paths, from those of their last straight parts.

    `row` (k,) are the vertices with a path, and `root` (n,) the vertices at which the last parts begin, or n and more
    for source points. `departure` and `back` (n,) are polar angles of the last parts at the root and at the vertex;
    `scale` (n,) is the ratio of polar angles to the angles in which turning is measured.
    """
    n = len(scale)
    bends = row[root[row] < n]
    bends = bends[np.isin(root[bends], row)]
    # Pointer jumping to the vertex at which the first part of the path ends: each step doubles the number of bends.
    top, turning, bend = np.arange(n), np.zeros(n), root[bends]
    top[bends] = bend
    turning[bends] = (departure[bends] - back[bend]) / scale[bend] - np.pi
    while not ((further := top[top]) == top).all():
        turning += turning[top]
        top = further
    found = np.full((3, n), np.nan)
    found[0, row], found[1, row] = in_circle(departure[top[row]]), in_circle(back[row])
    found[2, row] = turning[row] - _WHOLE * np.rint(turning[row] / _WHOLE)
    return found


@dataclass(frozen=True, eq=False)
class Directions:
    """Distance, and the directions of the shortest paths, in the frames of `tangent_frames`.

    Attributes
    ----------
    distance : (n,) float64
        Length of the path from the nearest source; ``inf`` where no source is reached.
    labels : (n,) int64
        The nearest source, counted as by `HeatMethodSolver.voronoi`; -1 where none is reached.
    departure : (n,) float64
        Polar angle in [0, 2 pi) at which the path leaves a source vertex, as taken by `exp_map`: scaled, see
        `tangent_frames`. For a source inside a face, the angle from the side of corners 0 and 1 of the face, towards
        corner 2.
    arrival : (n,) float64
        Angle in [0, 2 pi), in the frame of the vertex, of the direction of the path on arrival, away from the source:
        ``frames.to_world(frames.from_angles(arrival))`` is `gradient`.
    turning : (n,) float64
        Sum in [-pi, pi] of the counterclockwise turning angles at the vertices where the path bends. A vector of angle
        ``a`` at a source that is not on the boundary, transported along the path, has the angle ``a + arrival -
        departure - turning``.
    gradient : (n, 3) float64
        Unit vectors in space, tangent at the vertices: the gradient of the distance.
    start : SurfacePoints
        The n points at which the paths start: the source, or the nearest point of a curve. `departure` is measured in
        the face of this point, or around the vertex if the point is a corner. Arbitrary where no source is reached.

    Notes
    -----
    Departure, arrival, turning and gradient are 0 at sources and where no source is reached. A path that bends at
    a vertex of negative curvature, or on the boundary, has the departure of its part before the first bend.

    Examples
    --------
    >>> import heat_igl
    >>> solver = heat_igl.GeodesicSolver(heat_igl.shapes.strip(4, 3))
    >>> found = solver.directions(0)
    >>> found.gradient[19, :2].round(6).tolist(), round(float(found.distance[19]), 6)  # the corner at (4, 3)
    ([0.8, 0.6], 5.0)
    """

    distance: FloatArray
    labels: IntArray
    departure: FloatArray
    arrival: FloatArray
    turning: FloatArray
    gradient: FloatArray
    start: SurfacePoints

    def of(self, vertices: IntArray) -> Directions:
        """The directions at some vertices (k,)."""
        start = unchecked_points(self.start.faces[vertices], self.start.barycentric[vertices])
        rest = {field.name: getattr(self, field.name)[vertices] for field in fields(self)[:-1]}
        return replace(self, start=start, **rest)

    def __repr__(self) -> str:
        return f"Directions({len(self.distance)} vertices)"


def directions(
    distance: FloatArray, labels: IntArray, angles: PathAngles, start: SurfacePoints, frames: TangentFrames
) -> Directions:
    """The `Directions` of paths with known angles."""
    has_path = ~np.isnan(angles.back)
    departure, turning = (np.where(has_path, angle, 0.0) for angle in (angles.departure, angles.turning))
    arrival = np.where(has_path, _arrival(angles.back, frames.angles), 0.0)
    along, across = (np.where(has_path, part, 0.0)[:, None] for part in (np.cos(arrival), np.sin(arrival)))
    gradient = along * frames.x + across * frames.y
    return Directions(distance, labels, departure, arrival, turning, gradient, start)


def carried(angles: PathAngles, labels: IntArray, sources: IntArray, polar: PolarAngles) -> AnyArray:
    """Parallel transport from the source to each vertex as unit complex factors (n,); 1 at sources, 0 without a path.

    All paths start at vertices: `sources` (k,) are the vertices of the labels.
    """
    start = sources[np.maximum(labels, 0)]
    departure = polar.from_polar(start, angles.departure)
    turn = _arrival(angles.back, polar) - departure - angles.turning
    return np.where(labels < 0, 0.0, np.exp(1j * np.where(np.isnan(turn), 0.0, turn)))


def _arrival(back: FloatArray, polar: PolarAngles) -> FloatArray:
    """The angle (n,), in the frame of each vertex, of the direction opposite to the polar angle `back` (n,)."""
    return in_circle(polar.from_polar(np.arange(len(back)), back) + np.pi)


def directions_from_one_side(found: Directions, frames: TangentFrames, n: int, m: int) -> Directions:
    """Directions on n vertices and m faces, from those of paths from the first side of a cover, see `two_sided_cover`.

    Of the two copies of a vertex, the nearer one counts; arrivals on the second side are converted to the first.
    """
    is_other = found.distance[n : 2 * n] < found.distance[:n]
    seen = found.of(np.arange(n) + n * is_other)
    mirrored = in_circle(np.angle(axis_of_second_side(frames, n)) - seen.arrival)
    start = unchecked_points(*on_one_side(seen.start.faces, seen.start.barycentric, m))
    return replace(seen, arrival=np.where(is_other, mirrored, seen.arrival), start=start)


def axis_of_second_side(frames: TangentFrames, n: int) -> AnyArray:
    """The x axis (n,) of the second side, as complex numbers in the frame of the first."""
    x = frames.x[n : 2 * n]
    return np.asarray(np.einsum("nx,nx->n", x, frames.x[:n]) + 1j * np.einsum("nx,nx->n", x, frames.y[:n]))


class _Spokes(NamedTuple):
    """The k edges at a vertex: their other ends, lengths and angles, and the corners between each and the next edge."""

    end: IntArray
    length: FloatArray
    angle: FloatArray
    corner: IntArray


def vectors_from(mesh: Mesh, source: int) -> FloatArray | None:
    """The log map at a vertex: vectors (n, 2) of the exact distance, in the direction in which paths leave the source.

    They are in the frame of the source, and 0 at the source and at unreachable vertices. Polar angles of other vertices
    and a history of flips are not needed. None if the faces are no oriented manifold, if fewer than two edges of the
    mesh at the source are left in the Delaunay triangulation, or if the distance violates its invariants.
    """
    given = _given_spokes(mesh, source)
    if given is None:
        return None
    spokes, scale, on_boundary = given
    tables = from_mesh(mesh, source)
    if (tables.edges.twin == -2).any() or not tables.edges.aligned.all():
        return None
    around = _around(tables, source)
    first = _first_angle(spokes, around, scale)
    if first is None:
        return None
    chosen = source_set(source, mesh.n_vertices, mesh.F)
    done = search(tables, chosen, directed=True)
    leaving = done.leaving
    if leaving is None or (tables.kind == SEVERAL_FANS).any():
        return None
    begin = np.zeros(len(tables.edges.vertex))
    begin[around.corner] = first + scale * around.angle
    # Straight paths from the source, at angles from the first side of the corner through which they leave.
    root, start = done.found.root.astype(np.int64), int(tables.number[source])
    straight = np.flatnonzero((root == start) & (np.arange(len(root)) != start))
    x, y = leaving.direction[straight].T
    angle = begin[leaving.corner[straight]] + scale * np.arctan2(y, x)
    if on_boundary:
        angle = np.clip(angle, 0.0, np.pi)
    unit = np.zeros((len(root), 2))
    unit[straight, 0], unit[straight, 1] = np.cos(angle), np.sin(angle)
    distance = tables.unscaled(done.found.distance)[tables.number]
    if Invariants(mesh.F, mesh.components, mesh.V).contradiction(distance, chosen) is not None:
        return None
    return np.asarray(np.where(np.isfinite(distance), distance, 0.0)[:, None] * unit[first_parts(root)][tables.number])


def _given_spokes(mesh: Mesh, source: int) -> tuple[_Spokes, float, bool] | None:
    """The edges of the mesh at a vertex with polar angles, the scale of the angles, and whether it is on the boundary.

    None if the faces there are not one oriented fan, or are degenerate to a point.
    """
    F = mesh.F[np.unique(np.flatnonzero(mesh.F.ravel() == source) // 3)]
    if not len(F):
        return None
    used, numbers = np.unique(F, return_inverse=True)
    centre = int(np.searchsorted(used, source))
    try:
        star = intrinsic_triangulation(Mesh(mesh.V[used], numbers.reshape(-1, 3)))
        polar = polar_angles(star)
    except MeshError:
        return None
    leaves = np.flatnonzero(star.tail(np.arange(F.size)) == centre)
    spokes = _Spokes(used[star.head(leaves)], star.l.ravel()[leaves], polar.outgoing[leaves], next_half_edge(leaves))
    return spokes, float(polar.scale[centre]), bool(polar.on_boundary[centre])


def _around(tables: Tables, source: int) -> _Spokes:
    """The edges at a vertex of the tables in counterclockwise order, with cumulative angles of the faces."""
    t = tables.edges
    start = int(tables.corner_of_vertex[tables.number[source]])
    clockwise, is_closed = _fan(t.twin, start, 2)
    found = np.array(_fan(t.twin, start if is_closed else clockwise[-1], 1)[0])
    angles = corner_angles(t.length.reshape(-1, 3)[found // 3])[np.arange(len(found)), found % 3]
    end = tables.old_vertex[t.vertex[next_half_edge(found)]]
    return _Spokes(end, tables.unscaled(t.length[previous_half_edge(found)]), np.cumsum(angles) - angles, found)


def _fan(twin: AnyArray, start: int, step: int) -> tuple[list[int], bool]:
    """The corners around a vertex, counterclockwise for step 1 and clockwise for 2; whether the fan is closed."""
    corners = [start]
    while True:
        corner = corners[-1]
        side = int(twin[corner - corner % 3 + (corner + step) % 3])
        corner = side - side % 3 + (side + step) % 3
        if side < 0 or corner == start:
            return corners, side >= 0
        corners.append(corner)


def _first_angle(given: _Spokes, around: _Spokes, scale: float) -> float | None:
    """The polar angle of the first edge of the tables, from mesh edges that the flips have left in place."""
    i, j = np.nonzero(
        (given.end[:, None] == around.end)
        & (np.abs(given.length[:, None] - around.length) <= _SAME_LENGTH * around.length)
    )
    if len(i) < _FEWEST_EDGES:
        return None
    ahead = given.angle[i] - scale * around.angle[j]
    off = ahead - ahead[0]
    return None if np.abs(off - 2 * np.pi * np.rint(off / (2 * np.pi))).max() > _SAME_ANGLE else float(ahead[0])
