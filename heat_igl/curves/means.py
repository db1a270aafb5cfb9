"""Means and medians of points on a surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import expit

from heat_igl.curves.geodesics import GeodesicPathSolver
from heat_igl.curves.paths import shortest_path, shortest_paths
from heat_igl.curves.places import Waypoints, checked_places
from heat_igl.curves.straightest import Tracer
from heat_igl.errors import (
    AccuracyWarning,
    MeshError,
    SourceError,
    is_number,
    names_guessed,
    raise_at_first,
    real_numbers,
    shown,
)
from heat_igl.geodesic import GeodesicSolver
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, SurfacePoints, as_mesh, as_simplices
from heat_igl.mesh.surface_points import unchecked_curve
from heat_igl.runtime import warn_caller
from heat_igl.typing import ArrayLike, FloatArray, IntArray

# A mean inside a face keeps this barycentric distance from its sides, so that all paths leave through this face. With
# half and twice of it, the sums of 44 means and medians on 11 random meshes are the same to 3e-9, with 1e-5 to 3e-7.
_INSIDE = 1e-7
# Points up to this share of the longest side of the face apart are in one place: a median at a point is moved by up to
# two of those distances. Half and ten times of it find the same medians, a tenth two of 11 beside the points.
_ONE_PLACE = 10 * _INSIDE
# The search ends with a step below this share of the largest distance from the mean: the sum changes by the square of
# it, which is below rounding. With half, twice and 1e-7 those sums are the same to 3e-11, with 1e-6 to 4e-10.
_CONVERGED = 1e-8
# Of 220 descents on 15 meshes with powers from 1 to 16, half took 22 steps and the longest 281.
_MOST_STEPS = 500
# Sums that differ by less than this fraction are equal but for the rounding of paths: from 1e-13 to 1e-9, the search
# goes on from the same places.
_ROUNDING = 1e-12
# The sum has local minima, on rough surfaces within an edge or two of each other, so there are three starts: means of
# five points on two of six rough squares had sums larger by 0.2 and 0.6 % from one vertex than from three.
_STARTS = 3
# Distances in a weight d^(p - 2) are at least this fraction of the largest one, so that a point at the mean has one.
# From 1e-15 to 1e-9 the sums are the same.
_NEAREST = 1e-12
# At this power a distance 10 % below the largest has a weight of 1e-3, so the mean is nearly the centre of the smallest
# disk around the points; 5 of 12 searches for means of three points end without convergence, at 32 none.
_LARGEST_POWER = 64


@names_guessed
def karcher_mean(mesh: MeshLike, points: Waypoints, weights: ArrayLike | None = None, p: float = 2) -> SurfacePoints:
    """The point x with the least sum of w_i d(x, p_i)^p: the mean for p = 2, the geometric median for p = 1.

    Parameters
    ----------
    mesh : mesh
        Triangles, manifold and oriented alike.
    points : sequence of int, SurfacePoints, or a sequence of both
        Vertices or points on faces, k altogether.
    weights : (k,) array_like, optional
        One for each point: not negative, and not all 0; 1 if not given.
    p : float
        1 or more.

    Returns
    -------
    SurfacePoints
        One point.

    Raises
    ------
    MeshError
        If the mesh has no tangent frames, see `tangent_frames`, or the mean lies at a face without area.
    SourceError
        If `points` does not name points of the mesh, or they lie on different components.
    ValueError
        If `weights` or `p` are no such numbers.

    Warns
    -----
    AccuracyWarning
        If the steps are still longer than 1e-8 of the largest distance after 500 of them.

    Notes
    -----
    Two points have their mean on a shortest path between them. For more, the search starts at the three best vertices,
    by a distance query for each point, and may end at a place that is only locally best. Each step goes along the mean
    of the log maps v_i of the points, weighted by w_i d_i^(p - 2): the Karcher iteration for p = 2 (Karcher 1977) and
    Weiszfeld's for p = 1. The step is halved until the sum falls, so the sum falls in every step. A median can be one
    of the points: it is if the unit vectors to the others, weighted, sum to no more than the weight of this point
    (Vardi and Zhang 2000), and no vertex has a smaller sum. Log maps are the first directions and the lengths of exact
    shortest paths, which are straightened from step to step; where others are shorter at the end, the search goes on
    with these.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> mean = heat_igl.karcher_mean(mesh, [0, 8, 72, 80])  # of the corners of the unit square
    >>> mean.positions(mesh).round(6).tolist()
    [[0.5, 0.5, 0.0]]
    """
    mesh = as_mesh(mesh)
    triangles = as_simplices(mesh)
    faces, barycentric = checked_places("points", triangles, points)
    weight = np.ones(len(faces)) if weights is None else real_numbers("weights", weights)
    if weight.shape != (len(faces),):
        raise ValueError(f"weights must be {len(faces)} numbers, one for each point, but the shape is {weight.shape}")
    raise_at_first(~(np.isfinite(weight) & (weight >= 0)), "weights", weight, "must be finite and not negative")
    if not weight.any():
        raise ValueError("weights are all 0: one point at least needs a positive weight")
    if not is_number(p) or not 1 <= p <= _LARGEST_POWER:
        raise ValueError(
            f"p must be a number from 1 to {_LARGEST_POWER}, not {shown(p)}: 2 for the mean, 1 for the median"
        )
    used = weight > 0
    return _Mean(triangles, Tracer(mesh), faces[used], barycentric[used], weight[used], float(p)).found()


class _State(NamedTuple):
    """A place, the paths from there, the log maps (k, 2) of all points, their distances (k,), the sum of the powers."""

    face: int
    barycentric: FloatArray
    paths: list[SurfaceCurve]
    vectors: FloatArray
    distances: FloatArray
    energy: float

    @property
    def points(self) -> SurfacePoints:
        """The place as a point of the surface."""
        return SurfacePoints(np.array([self.face]), self.barycentric[None])


class _Mean:
    """The points, with the weights and the power of their distances."""

    # Distances are raised to the power in this unit, so that they neither overflow nor vanish.
    _unit: float

    def __init__(
        self, mesh: Mesh, tracer: Tracer, faces: IntArray, barycentric: FloatArray, weight: FloatArray, power: float
    ) -> None:
        self._mesh = mesh
        # The first corner at each vertex, if possible of a face with area: others have no axes.
        self._corner = np.zeros(mesh.n_vertices, np.int64)
        for corner in (np.arange(mesh.F.size), np.flatnonzero(np.repeat(mesh.measures > 0, 3))):
            self._corner[mesh.F.ravel()[corner[::-1]]] = corner[::-1]
        at_vertex = barycentric.max(axis=1) == 1
        corner = self._corner[mesh.F[faces, barycentric.argmax(axis=1)]]
        faces = np.where(at_vertex, corner // 3, faces)
        barycentric = np.where(at_vertex[:, None], np.eye(3)[corner % 3], barycentric)
        self._faces, self._barycentric = faces, barycentric
        self._places = [SurfacePoints(np.array([f]), b[None]) for f, b in zip(faces, barycentric, strict=True)]
        self._weight, self._power = weight / weight.sum(), power
        self._solver = GeodesicPathSolver(mesh)
        self._tracer = tracer

    def found(self) -> SurfacePoints:
        """The point with the least sum."""
        if len(self._faces) == 1:
            return SurfacePoints(self._faces, self._barycentric)
        fields = np.asarray(GeodesicSolver(self._mesh).distances(self._places))  # (k, n)
        self._unit = float(fields.max(axis=0).min()) or 1.0
        if self._unit == np.inf:
            raise SourceError("points lie on different components of the mesh, so none is at a distance from all")
        energy = self._energy(fields)
        if self._power == 1:
            at_point = self._median_at_a_point(fields, float(energy.min()))
            if at_point is not None:
                return at_point
        if len(self._faces) == 2:
            return self._between()
        starts = [int(self._corner[vertex]) for vertex in np.argsort(energy)[:_STARTS] if energy[vertex] < np.inf]
        ends = [self._lowest(self._state(corner // 3, np.eye(3)[corner % 3])) for corner in starts]
        return min(ends, key=lambda end: end.energy).points

    def _energy(self, distances: FloatArray) -> FloatArray:
        """The sum of the powers of distances (k,) or (k, n)."""
        with np.errstate(over="ignore"):
            return np.asarray(self._weight @ (distances / self._unit) ** self._power)

    def _between(self) -> SurfacePoints:
        """Of two points and p > 1: the point of a shortest path that divides it in the ratio of the least sum."""
        path = shortest_path(self._mesh, *self._places)
        length = path.lengths(self._mesh)
        share = expit(np.subtract(*np.log(self._weight[::-1])) / (self._power - 1))
        along = share * length.sum() - (np.cumsum(length) - length)
        at = int(np.flatnonzero(along >= 0)[-1])
        part = along[at] / length[at] if length[at] > 0 else 0.0
        return SurfacePoints(path.faces[[at]], (path.start + part * (path.end - path.start))[[at]])

    def _state(self, face: int, barycentric: FloatArray, near: _State | None = None) -> _State:
        """The state at a place, with shortest paths, or those in the classes of the paths from a place nearby."""
        inside = np.maximum(barycentric, _INSIDE)
        inside /= inside.sum()
        here = SurfacePoints(np.array([face]), inside[None])
        if near is None:
            points = SurfacePoints(self._faces, self._barycentric)
            paths = [path.reversed() for path in shortest_paths(self._mesh, points, here)]
        else:
            step = self._solver.path([here, near.points])
            paths = [self._solver.straighten(_joined(step, path)) for path in near.paths]
        vectors = self._log_maps(face, paths)
        distances = np.hypot(*vectors.T)
        return _State(face, inside, paths, vectors, distances, float(self._energy(distances)))

    def _log_maps(self, face: int, paths: list[SurfaceCurve]) -> FloatArray:
        """The log maps (k, 2) of all points at the place inside a face from which paths lead there.

        The first axis runs from corner 0 to corner 1 of the face, the second to the side of corner 2.
        """
        V, F = self._mesh.V, self._mesh.F
        if not self._mesh.measures[face] > 0:
            raise MeshError(f"the mean lies at F[{face}] = {F[face].tolist()}, which has no area: repair this face")
        along, side = V[F[face, 1:]] - V[F[face, 0]]
        along /= np.linalg.norm(along)
        across = side - (side @ along) * along
        axes = np.stack([along, across / np.linalg.norm(across)])
        vectors = np.zeros((len(paths), 2))
        for i, path in enumerate(paths):
            if path.length > 0:
                first = int(np.argmax((path.start != path.end).any(axis=1)))
                direction = axes @ ((path.end[first] - path.start[first]) @ V[F[path.faces[first]]])
                vectors[i] = path.length * direction / np.linalg.norm(direction)
        return vectors

    def _direction(self, at: _State) -> FloatArray:
        """The mean (2,) of the log maps."""
        relative = at.distances / max(float(at.distances.max()), np.finfo(float).tiny)
        share = self._weight * np.maximum(relative, _NEAREST) ** (self._power - 2)
        # The second derivative of d^p along the path is p - 1 times that across it.
        return np.asarray(share @ at.vectors / (share.sum() * max(self._power - 1, 1)))

    def _lowest(self, at: _State) -> _State:
        """Descend in the classes of the shortest paths at a place, until these are the shortest at the end too."""
        while True:
            end = self._descend(at)
            at = self._state(end.face, end.barycentric)
            if not at.energy < end.energy * (1 - _ROUNDING):
                return at

    def _descend(self, at: _State) -> _State:
        """Steps along the mean of the log maps until they are short."""
        part = 1.0
        for _ in range(_MOST_STEPS):
            step = self._direction(at)
            size, shortest = float(np.hypot(*step)), _CONVERGED * float(at.distances.max())
            # As many halvings as the last step, or one less.
            part = min(1.0, 2 * part)
            while part * size > shortest:
                end = self._tracer.exp(at.points, part * step[None])
                face = int(end.faces[0])
                if self._mesh.measures[face] > 0:
                    trial = self._state(face, end.barycentric[0], at)
                    if trial.energy < at.energy:
                        break
                part /= 2
            else:
                return at
            at = trial
        warn_caller(
            f"the mean of {len(self._faces)} points moves by {part * size:.3g} still, after {_MOST_STEPS} steps",
            AccuracyWarning,
        )
        return at

    def _median_at_a_point(self, fields: FloatArray, least: float) -> SurfacePoints | None:
        """The best of the points, if it is their median: no place beside it, and no vertex, has a smaller sum."""
        corners = self._mesh.F[self._faces]
        sums = np.einsum("kc,kc->k", (self._weight @ fields)[corners], self._barycentric)
        best = int(np.argmin(sums))
        at = self._state(int(self._faces[best]), self._barycentric[best])
        # Points in the same place weigh together.
        corner = self._mesh.V[corners[best]]
        same = _ONE_PLACE * float(np.linalg.norm(corner - np.roll(corner, 1, axis=0), axis=1).max())
        here = at.distances <= same
        pull = self._weight[~here] @ (at.vectors[~here] / at.distances[~here, None])
        if np.hypot(*pull) <= self._weight[here].sum() and at.energy <= least + same / self._unit:
            return SurfacePoints(self._faces[[best]], self._barycentric[[best]])
        return None


def _joined(first: SurfaceCurve, second: SurfaceCurve) -> SurfaceCurve:
    """The curve along one and then along another, which starts where the first ends."""
    start, end = np.concatenate([first.start, second.start]), np.concatenate([first.end, second.end])
    return unchecked_curve(np.concatenate([first.faces, second.faces]), start, end, is_closed=False)
