"""The directions in which shortest paths leave their sources and arrive, in the tangent planes of the vertices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import PolarAngles, carried_angles, lay_out, polar_angles
from heat_igl.intrinsic.triangulation import previous_half_edge
from heat_igl.kernels import departures
from heat_igl.mesh import SurfacePoints
from heat_igl.operators import Surface
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.exact import ExactSolution
from heat_igl.unfolding.numbered import WalkStarts
from heat_igl.unfolding.refinement import Refinement
from heat_igl.unfolding.walks import INSIDE, unknown

__all__ = ["PathAngles", "PathDirections", "in_circle"]

_WHOLE = 2 * np.pi
# How far a second point in a face is from the first, in lengths of the shortest side.
_ASIDE = 1e-3


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


class PathDirections:
    """Angles in the fans of a triangulation as polar angles of the mesh.

    Parameters
    ----------
    surface : Surface
        An oriented manifold of triangles whose faces are known.
    refinement : Refinement
        Its tables.

    Raises
    ------
    MeshError
        If the surface has no polar angles, see `polar_angles`.
    """

    def __init__(self, surface: Surface, refinement: Refinement) -> None:
        if surface.faces is None:
            raise MeshError("directions need the faces of the mesh, which this domain does not know")
        #: Around the vertices of the triangulation.
        self.angles: PolarAngles = carried_angles(polar_angles(surface.faces), surface.unfolding)
        self._refinement = refinement
        self._faces, self._triangulation = surface.faces, surface.unfolding
        t, n = refinement.tables, len(refinement.number)
        old_face = np.empty(len(refinement.face), np.int64)
        old_face[refinement.face] = np.arange(len(refinement.face))
        used = np.flatnonzero(np.diff(t.first))
        corner = t.turn["corner"][t.first[used]].astype(np.int64)
        first = previous_half_edge(3 * old_face[corner // 3] + corner % 3)
        # Of each row, the polar angle of its first spoke, from which angles in its fan count.
        self._begin, self._scale, self._on_boundary = np.zeros(n), np.ones(n), np.zeros(n, bool)
        self._begin[used] = self.angles.leaving[first]
        self._scale[refinement.number] = self.angles.scale
        self._on_boundary[refinement.number] = self.angles.on_boundary

    def of_walks(self, walk: AnyArray, points: SurfacePoints | None = None) -> PathAngles:
        """The angles of walks (n + p,), with p sources at `points` in faces."""
        n = len(self._begin)
        row = np.flatnonzero(np.isfinite(walk["distance"][:n]) & (walk["fan"][:n] >= 0))
        root = walk["root"].astype(np.int64)
        bends = row[(root[row] < n) & (walk["fan"][root[row]] >= 0)]
        top, turning = self._handed_on(walk, root, bends)
        # Where the part of the path that leaves the source ends.
        first = top[row]
        departure, source = walk["departure"][first], root[first]
        at_vertex = source < n
        departure[at_vertex] = self._polar(source[at_vertex], departure[at_vertex])
        if points is not None:
            departure[~at_vertex] += self._turns(points)[source[~at_vertex] - n]
        found = np.full((3, n), np.nan)
        found[0, row], found[1, row] = in_circle(departure), in_circle(self._polar(row, walk["angle"][row]))
        found[2, row] = turning[row] - _WHOLE * np.rint(turning[row] / _WHOLE)
        return PathAngles(*found[:, self._refinement.number])

    def of_windows(self, found: ExactSolution, starts: WalkStarts, points: SurfacePoints | None = None) -> PathAngles:
        """The angles of exact paths from sources that begin at `starts`, p of them at `points` in faces."""
        refinement, n, origin = self._refinement, len(self._begin), found.origin
        number = refinement.number
        walk = unknown(n + starts.n_points)
        walk["root"] = -1
        walk["distance"][number] = found.distance
        walk["distance"][n:] = starts.offset[len(starts.offset) - starts.n_points :]
        # Vertices first, then points.
        rows = np.concatenate([number, n + np.arange(starts.n_points)])
        has_root = origin.root >= 0
        walk["root"][number[has_root]] = rows[origin.root[has_root]]
        walk["root"][walk["root"] == np.arange(len(walk))] = -1
        follows = np.flatnonzero(walk["root"] >= 0)
        walk["reach"][follows] = walk["distance"][follows] - walk["distance"][walk["root"][follows]]
        entered, crossing = np.full(n, -1, np.int32), np.zeros(n)
        half_edge = origin.entered
        entered[number] = np.where(half_edge >= 0, 3 * refinement.face[half_edge // 3] + half_edge % 3, -1)
        crossing[number] = origin.crossing
        first, inside = (np.empty(0, np.int32), np.empty(0, INSIDE)) if starts.points is None else starts.points
        departures.depart(refinement.tables, walk, first, inside, entered, crossing)
        # Paths inside the face of a source point.
        seen = np.flatnonzero(starts.walk["fan"] >= 0)
        seen = seen[walk["root"][starts.row[seen]] == starts.walk["root"][seen]]
        for name in ("fan", "angle", "total", "departure"):
            walk[name][starts.row[seen]] = starts.walk[name][seen]
        return self.of_walks(walk, points)

    def _polar(self, rows: IntArray, angles: FloatArray) -> FloatArray:
        """Polar angles (k,) of angles in the fans of vertices; at the boundary no further than the faces."""
        found = self._begin[rows] + self._scale[rows] * angles
        return np.where(self._on_boundary[rows], np.clip(found, 0.0, np.pi), found)

    def _turns(self, points: SurfacePoints) -> FloatArray:
        """The angle (p,) of corners 0 and 1 of the triangles that hold points, in the given faces.

        Flips have turned the triangles. A second point nearby, in the given face and in the triangle, shows how far.
        """
        given, triangulation = self._faces, self._triangulation
        place, l = lay_out(given.l[points.faces]), given.l[points.faces]  # noqa: E741
        home, inside = triangulation.locate(points.faces, points.barycentric)
        at = np.einsum("pc,pcx->px", inside, lay_out(triangulation.l[home]))
        best, turn = np.full(len(points), -np.inf), np.zeros(len(points))
        for angle in np.arange(8) * (_WHOLE / 8) + 0.1:
            step = _ASIDE * l.min(axis=1)[:, None] * [np.cos(angle), np.sin(angle)]
            weights = points.barycentric + _barycentric_step(place, step)
            faces, there = triangulation.locate(points.faces, np.maximum(weights, 0.0))
            # By how much both points are inside.
            margin = np.where(faces == home, np.minimum(weights.min(axis=1), there.min(axis=1)), -np.inf)
            dx, dy = (np.einsum("pc,pcx->px", there, lay_out(triangulation.l[home])) - at).T
            better = margin > best
            best[better] = margin[better]
            turn[better] = (angle - np.arctan2(dy, dx))[better]
        return turn

    def _handed_on(self, walk: AnyArray, root: IntArray, bends: IntArray) -> tuple[IntArray, FloatArray]:
        """The vertex on each path that its first bend leads to, and the sum of the turns at the bends.

        `bends` are the rows whose paths come straight from a bend. Each step doubles the number that is skipped.
        """
        top, turning = np.arange(len(walk)), np.zeros(len(walk))
        bend = root[bends]
        top[bends] = bend
        scale = np.where(self._on_boundary[bend], 1.0, self._scale[bend])
        turning[bends] = scale * (walk["departure"][bends] - walk["angle"][bend]) - np.pi
        while True:
            further = top[top]
            if (further == top).all():
                return top, turning
            turning += turning[top]
            top = further


def _barycentric_step(corners: FloatArray, step: FloatArray) -> FloatArray:
    """How barycentric coordinates (k, 3) change over a step (k, 2) in triangles (k, 3, 2)."""
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    b = (step[:, 0] * ac[:, 1] - step[:, 1] * ac[:, 0]) / area
    c = (ab[:, 0] * step[:, 1] - ab[:, 1] * step[:, 0]) / area
    return np.stack([-b - c, b, c], axis=1)
