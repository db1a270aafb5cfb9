"""Derivatives of exact distance by the positions of the vertices, by edge lengths, by the sources and by a metric.

All of them use the chain rule through the lengths of the sides of the faces. Paths on the faces give the derivatives
of distance by these lengths (`heat_igl.kernels.windows.paths`), and edges give those of the lengths by the positions.
docs/derivatives_theory.md derives each step.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import Merged
from heat_igl.kernels.windows import paths as kernels
from heat_igl.mesh import Mesh, MeshPart, PointCloud
from heat_igl.operators import MetricSides, Operators, SideLengths, Surface
from heat_igl.sources import SourceSet
from heat_igl.sweep.simplex_derivative import gradient_rows, velocities
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.windows import ExactSurface
from heat_igl.windows.exact import search

# A distance that differs from the length of the path by more than this fraction is not the length of that path.
# Rounding is below 1e-14; in flat parts other paths are longer by 1e-13 to 1e-9, with derivatives that differ by 1e-3.
_SAME = 1e-12


class DistanceDerivative:
    """The derivative of one distance: called with a gradient by the distances, it returns that by the positions.

    Where the shortest path is not unique (at the cut locus, and between two sources) the path that was found decides,
    and the derivative is one of several one-sided ones. So it is at a vertex next to a source vertex, whose distance
    has no gradient in the source.

    Attributes
    ----------
    distance : (n,) float64
        The answer.
    unreachable : (k,) int64
        Vertices at distance ``inf``. Their derivative is 0.
    """

    def __init__(
        self,
        distance: FloatArray,
        sources: SourceSet,
        surface: Surface,
        sides: SideLengths | None,
        windows: ExactSurface,
        part: MeshPart | None = None,
    ) -> None:
        self.distance, self._sources, self._sides, self._part = distance, sources, sides, part
        self._faces, self._F, self._tables = surface.faces, surface.given_faces, windows.tables
        self.unreachable: IntArray = np.flatnonzero(np.isinf(distance))
        # A path is known by the last vertex or source point before each vertex, from which a straight line leads to it;
        # up to there it is the path of that vertex.
        done = search(windows.tables, sources)
        self._places = done.starts.points
        self._paths = windows.tables, done.found, done.starts, np.argsort(done.found.distance, kind="stable")

    def __call__(self, g: ArrayLike) -> FloatArray:
        """The gradient by the positions of the vertices.

        Parameters
        ----------
        g : (n,) or (k, n) array_like
            Derivative of a function by each distance; entries at unreachable vertices do not count. Rows are functions.
            The rows of the identity give the Jacobian of a small mesh.

        Returns
        -------
        (n, 3) or (k, n, 3) float64
            Its derivative by the positions.

        Raises
        ------
        ValueError
            If g has another shape, or is not finite at a reachable vertex.
        MeshError
            If the solver has no vertices to move: it was made from edge lengths or operators.
        """
        sides = self._positions()
        result = [sides.by_positions(self._by_sides(row)[0]) for row in gradient_rows(g, self.distance)]
        return np.stack(result) if np.ndim(g) == 2 else result[0]

    def by_lengths(self, g: ArrayLike) -> FloatArray:
        """The gradient (m, 3) or (k, m, 3) by the lengths of the sides opposite each corner, for `g` as for a call.

        An edge is a side of each of its faces: its derivative is the sum of theirs. Rows are the faces of the mesh. Of
        two faces with the same vertices, one has the derivative of both, and the other 0. Outside a region it is 0.
        """
        result = np.stack([self._by_sides(row)[0] for row in gradient_rows(g, self.distance)])
        if self._part is not None:
            of_part, result = result, np.zeros((len(result), len(self._part.whole), 3))
            result[:, self._part.faces] = of_part
        return result if np.ndim(g) == 2 else np.asarray(result[0])

    def by_points(self, g: ArrayLike) -> FloatArray:
        """The gradient by the positions of the sources that are points in faces.

        Parameters
        ----------
        g : (n,) array_like
            As for a call.

        Returns
        -------
        (p, 3) float64
            For each point a vector in the plane of its face. The gradient of one distance has length 1 and leads away
            from the path. Of a point on a side of its face, to paths that leave by this side, the component along the
            side alone. Source vertices have their gradient among the positions.

        Raises
        ------
        ValueError
            If g has another shape or is not finite.
        MeshError
            If the solver has no positions.
        """
        slopes = self._place_slopes
        _, by_place = self._by_sides(*gradient_rows(g, self.distance, 1))
        return np.asarray(np.einsum("pc,pcx->px", by_place, slopes))

    def by_offsets(self, g: ArrayLike) -> FloatArray:
        """The gradient (s,) by the offset of each source, as they were listed; `g` (n,) as for a call."""
        (row,), sources, (tables, found, starts, _) = gradient_rows(g, self.distance, 1), self._sources, self._paths
        reached = np.isfinite(self.distance)
        source = starts.label[found.label[tables.number[reached]]]
        return np.asarray(np.bincount(sources.labels[source], row[reached], sources.n_labels), np.float64)

    def by_metric(self, g: ArrayLike) -> FloatArray:
        """The gradient by the metric, (m, 3, 3) or (m, 2, 2) as it was given to `metric_operators`; `g` (n,).

        Symmetric on each face. Raises a ValueError without a metric, and if g has another shape or is not finite.
        """
        metric = self._metric("metric_operators(mesh, metric), with a metric on each face for windows")
        return metric.by_metric(self._by_sides(*gradient_rows(g, self.distance, 1))[0])

    def by_speed(self, g: ArrayLike) -> FloatArray:
        """The gradient (m,) by the speeds that were given to `speed_operators`; `g` (n,), errors as for `by_metric`."""
        metric = self._metric("speed_operators(mesh, speed)")
        return metric.by_speed(self._by_sides(*gradient_rows(g, self.distance, 1))[0])

    def _metric(self, function: str) -> MetricSides:
        if not isinstance(self._sides, MetricSides):
            raise ValueError(f"the solver knows no metric to change: make it on {function}")
        return self._sides

    def push_forward(self, dV: ArrayLike, points: ArrayLike | None = None) -> FloatArray:
        """The directional derivative of all distances: how they change when the vertices and the source points move.

        Parameters
        ----------
        dV : (n, 3) array_like
            Velocity of each vertex.
        points : (p, 3) array_like, optional
            Velocity of each source that is a point in a face, in the plane of the face and relative to it. Points
            keep their barycentric coordinates if it is not given.

        Returns
        -------
        (n,) float64
            Rate of change of each distance; 0 at unreachable vertices.

        Raises
        ------
        ValueError
            If dV or points have another shape or are not finite.
        MeshError
            If the solver has no vertices to move.
        """
        sides, places = self._positions(), self._sources.points
        moved = velocities("dV", dV, sides.mesh.V.shape, "vertex")
        by_side = sides.push_positions(moved)
        by_place = np.zeros((len(places.faces), 3))
        if points is not None and len(places.faces):
            velocity = velocities("points", points, by_place.shape, "source point")
            by_place = np.einsum("pcx,px->pc", self._place_slopes, velocity)
        moves = np.zeros((len(self._places.faces), 3))
        for c, (known, point, corner) in enumerate(self._own_corners()):
            moves[known, c] = by_place[point, corner]
        result = self._summed(by_side.ravel()[self._sides_of_tables], moves, np.zeros(self._tables.n + len(moves)))
        result[self.unreachable] = 0.0
        return result

    @property
    def _place_slopes(self) -> FloatArray:
        """The slopes (p, 3, 3) of the coordinates of each source point in the plane of its face, in space."""
        mesh, points = self._positions().mesh, self._sources.points
        corners = mesh.V[mesh.F[points.faces]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        per_area = 1 / np.einsum("px,px->p", normal, normal)
        opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
        # A coordinate rises by the height of its corner.
        return np.asarray(np.cross(normal[:, None], opposite) * per_area[:, None, None])

    @cached_property
    def inexact(self) -> IntArray:
        """Vertices whose distance is not the length of the path that is differentiated."""
        tables, found, starts, _ = self._paths
        # A line is homogeneous in the sides (Euler); to it comes the distance at which the source starts.
        begin = np.where(found.root == np.arange(tables.n), found.distance, 0.0)
        moves, change = np.zeros((len(self._places.faces), 3)), np.concatenate([begin, starts.point_offset])
        length = self._summed(self._faces.l[tables.face], moves, change)
        reached = np.flatnonzero(np.isfinite(self.distance))
        distance = self.distance[reached]
        return np.asarray(reached[np.abs(length[reached] - distance) > _SAME * distance])

    def _positions(self) -> SideLengths:
        if self._sides is None:
            raise MeshError(
                "lengths do not follow from positions here, so there are no vertices to move: use by_lengths for the "
                "derivative by edge lengths"
            )
        return self._sides

    def _by_sides(self, row: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The derivatives (m, 3) by the sides, and (p, 3) by the points, of the faces that the user gave.

        An edge of two faces changes both of its sides; of faces that are there twice, all but one have 0. By the
        coordinates of a point, a row is known up to a constant.
        """
        tables, e = self._tables, len(self._places.faces)
        weight, by_table, by_place = np.zeros(tables.n + e), np.zeros(len(tables.edges.length)), np.zeros((e, 3))
        weight[tables.number] = row
        kernels.pull_back(*self._paths, weight, by_table, by_place)
        by_side, by_point = np.zeros(self._F.shape), np.zeros((len(self._sources.points.faces), 3))
        by_side.ravel()[self._sides_of_tables] = by_table.reshape(-1, 3)
        by_place = tables.unscaled(by_place)
        # Of a point on a side, the triangle on the other side has a copy: it knows the derivative along the side alone.
        for c, (known, point, corner) in enumerate(self._own_corners()):
            np.add.at(by_point, (point, corner), by_place[known, c])
        return by_side, by_point

    @cached_property
    def _sides_of_tables(self) -> IntArray:
        """The place of each side (t, 3) of the tables' triangles among those (m, 3) of the faces that the user gave."""
        face, history = self._tables.face, self._faces.history
        sides = 3 * face[:, None] + np.arange(3)
        if history and isinstance(history[0], Merged):  # faces that were there twice
            which = np.unique(history[0].face, return_index=True)[1][face, None]
            np.put_along_axis(sides, history[0].corner[which[:, 0]], 3 * which + np.arange(3), axis=1)
        return sides

    def _own_corners(self) -> list[tuple[BoolArray, IntArray, IntArray]]:
        """For each corner of the places' triangles: whether the point's own face has it, the point, the corner."""
        places = self._places
        F = self._faces.F[self._tables.face[places.faces]]
        own = self._F[self._sources.points.faces[places.point]]
        same = [own == F[:, [c]] for c in range(3)]
        known = [at.any(axis=1) for at in same]
        return [(k, places.point[k], at.argmax(axis=1)[k]) for at, k in zip(same, known, strict=True)]

    def _summed(self, by_side: FloatArray, moves: FloatArray, change: FloatArray) -> FloatArray:
        """Changes (n,) of distances when sides and places change, and offsets of sources, in the unit of the tables."""
        tables = self._tables
        kernels.push_forward(*self._paths, tables.scaled(by_side).ravel(), moves, change)
        return tables.unscaled(change[tables.number])


def require_differentiable(domain: Mesh | PointCloud | Operators, sources: SourceSet) -> None:
    """A ValueError if the domain is a point cloud or has merged vertices, or if a curve is among the sources."""
    if isinstance(domain, PointCloud):
        raise ValueError("derivatives need a surface of triangles, and the domain is a point cloud: take its triangles")
    if domain.has_copies:
        raise ValueError(
            "derivatives need vertices none of which is a copy of another, and seams of this mesh were merged"
        )
    if len(sources.segments.faces):
        raise ValueError(
            "derivatives are there for vertices and points, and a curve is among the sources: place points on it"
        )
