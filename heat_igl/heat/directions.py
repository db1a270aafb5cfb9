"""Directions of shortest paths in the frames of the vertices: where they leave their source and how they arrive."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from heat_igl.intrinsic import PolarAngles, TangentFrames
from heat_igl.mesh import SurfacePoints
from heat_igl.mesh.cloud_orientation import on_one_side
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows import PathAngles, in_circle


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
        Polar angle in [0, 2 pi) at which the path leaves a source vertex, as `exp_map` takes it: scaled, see
        `tangent_frames`. From a source inside a face, the angle from the side of corners 0 and 1 of that face, to the
        side of corner 2.
    arrival : (n,) float64
        Angle in [0, 2 pi) in the frame of the vertex of the direction in which the path arrives there, away from the
        source: ``frames.to_world(frames.from_angles(arrival))`` is `gradient`.
    turning : (n,) float64
        Angle in [-pi, pi] by which the path turns at the vertices where it bends, counterclockwise, summed up. A vector
        of angle ``a`` at a source inside the boundary, transported along the path, has the angle ``a + arrival -
        departure - turning``.
    gradient : (n, 3) float64
        Unit vectors in space, tangent at the vertices: the gradient of the distance.
    start : SurfacePoints
        The n places at which the paths start: the source, or the place on a curve, in the face in which `departure`
        counts; at a corner of this face `departure` counts around the vertex. Any place where no source is reached.

    Notes
    -----
    Departure, arrival, turning and gradient are 0 at sources and where no source is reached. A path that bends at
    a vertex of negative curvature, or on the boundary, has the departure of the path to the bend.

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
    """The result for paths whose angles are known."""
    has_path = ~np.isnan(angles.back)
    departure, turning = (np.where(has_path, angle, 0.0) for angle in (angles.departure, angles.turning))
    arrival = np.where(has_path, _arrival(angles.back, frames.angles), 0.0)
    along, across = (np.where(has_path, part, 0.0)[:, None] for part in (np.cos(arrival), np.sin(arrival)))
    gradient = along * frames.x + across * frames.y
    return Directions(distance, labels, departure, arrival, turning, gradient, start)


def carried(angles: PathAngles, labels: IntArray, sources: IntArray, polar: PolarAngles) -> AnyArray:
    """Unit numbers (n,) that components are multiplied by on the way from the source; 1 at sources, 0 without a path.

    Paths start at vertices: `sources` (k,) has the one of each label.
    """
    start = sources[np.maximum(labels, 0)]
    departure = polar.from_polar(start, angles.departure)
    turn = _arrival(angles.back, polar) - departure - angles.turning
    return np.where(labels < 0, 0.0, np.exp(1j * np.where(np.isnan(turn), 0.0, turn)))


def _arrival(back: FloatArray, polar: PolarAngles) -> FloatArray:
    """The angle (n,) in the frame opposite the polar angle `back` (n,)."""
    return in_circle(polar.from_polar(np.arange(len(back)), back) + np.pi)


def directions_from_one_side(found: Directions, frames: TangentFrames, n: int, m: int) -> Directions:
    """The directions of paths from the first side of a cover, see `two_sided_cover`, on the n vertices and m faces.

    Of the two copies of a vertex that which is nearer; arrivals on the second side are seen from the first.
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
