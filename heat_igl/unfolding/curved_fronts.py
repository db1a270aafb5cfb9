"""Distance from curves: exact near them, and beyond by fronts that know their direction at each vertex."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation, PolarAngles, carried_angles, polar_angles
from heat_igl.kernels.curved_fronts import advance
from heat_igl.mesh import SurfacePoints
from heat_igl.plan import FRONTS_EVERYWHERE_EXACT, ROUGH_FOR_FRONTS
from heat_igl.runtime import both
from heat_igl.sources import SourceSet
from heat_igl.typing import BoolArray, FloatArray
from heat_igl.unfolding.exact import ExactSolution, ExactSurface
from heat_igl.unfolding.halves import first_half
from heat_igl.unfolding.spokes import aligned

__all__ = ["CurvedFronts", "Front"]

_TRIANGLE = np.dtype(
    [(name, "f8", 3) for name in ("side", "leaving", "ending")]
    + [("double_area", "f8"), ("vertex", "i4", 3), ("spare", "i4")]
)
# Distance is exact within so many mean edge lengths. With 6 the error is 0.4 to 1 of that with 3, a query takes a fifth
# more time; with 2 it is 1 to 1.4.
_RADIUS = 3.0


class Front(NamedTuple):
    """What is known of distance at n vertices.

    Attributes
    ----------
    distance : (n,) float64
        ``inf`` where it is not known.
    back : (n,) float64
        Direction in which the source lies: an angle around the vertex, not scaled; nan where it is not known.
    """

    distance: FloatArray
    back: FloatArray

    def before(self, other: Front) -> Front:
        """Of two fronts, the one that is first at each vertex."""
        is_first = self.distance <= other.distance
        return Front(*(np.where(is_first, one, two) for one, two in zip(self, other, strict=True)))


class CurvedFronts:
    """Distance from curves on an oriented manifold, for any number of queries.

    Near the curves it is exact. Beyond, fronts pass from triangle to triangle, as in fast marching (Kimmel and Sethian
    1998), with the direction at each vertex beside the distance, as in jet marching (Potter and Cameron 2020). Along a
    side, distance is a parabola with the slopes that the directions at its ends have, so that errors are of second
    order in the edge length; straight fronts are of first order.

    Parameters
    ----------
    faces : IntrinsicTriangulation
        The triangles that sources refer to.
    triangulation : IntrinsicTriangulation
        The same surface after flips, that fronts pass through.
    h : float
        Mean edge length.

    Raises
    ------
    MeshError
        If the surface is not an oriented manifold.
    """

    def __init__(self, faces: IntrinsicTriangulation, triangulation: IntrinsicTriangulation, h: float) -> None:
        angles = polar_angles(faces)
        self._faces, self._exact = faces, ExactSurface(faces)
        self._leaving_in_faces = _at_corners(faces, angles)
        carried = angles if triangulation is faces else carried_angles(angles, triangulation)
        used, n = triangulation.F.ravel(), triangulation.n
        triangle = aligned(len(triangulation.F), _TRIANGLE)
        triangle["side"], triangle["vertex"] = triangulation.l, triangulation.F
        triangle["leaving"] = _at_corners(triangulation, carried)
        triangle["ending"] = triangle["leaving"] + carried.corners
        triangle["double_area"] = 2 * triangulation.areas
        self._F = np.ascontiguousarray(triangulation.F, np.int32)
        self._tables = (
            triangle,
            np.where(angles.on_boundary, np.inf, angles.sums),
            np.concatenate([[0], np.cumsum(np.bincount(used, minlength=n))]).astype(np.int32),
            np.argsort(used, kind="stable").astype(np.int32),
        )
        curvature = np.abs(2 * np.pi - angles.sums[~angles.on_boundary])
        is_rough = len(curvature) > 0 and curvature.mean() > ROUGH_FOR_FRONTS
        self._radius = np.inf if n <= FRONTS_EVERYWHERE_EXACT or is_rough else _RADIUS * h

    def near(self, sources: SourceSet) -> Front:
        """The exact distance within three mean edge lengths of points and curves, and at the corners of their faces."""
        points, segments = sources.points, sources.segments
        held = np.concatenate([points.faces, segments.faces])
        found = self._exact.solve(
            sources.vertices,
            sources.vertex_offset,
            SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None,
            points.offset if len(points.faces) else None,
            segments if len(segments.faces) else None,
            cutoff=max(self._radius, float(self._faces.l[held].max(initial=0.0))),
        )
        return Front(found.distance, self._back(found))

    def continued(self, front: Front) -> FloatArray:
        """Distance (n,) at all vertices; ``inf`` where the front does not come."""
        distance, back = front.distance.copy(), front.back.copy()
        is_open = np.isinf(distance)
        first = is_open & first_half(self._F, ~is_open)

        def fill(part: BoolArray) -> None:
            advance(*self._tables, part.view(np.uint8), distance, back)

        both(lambda: fill(first), lambda: fill(is_open & ~first))
        return distance

    def _back(self, found: ExactSolution) -> FloatArray:
        """Directions (n,) from the vertices along straight paths; nan if a path stays inside one face."""
        back = np.full(len(found.distance), np.nan)
        at = np.flatnonzero(found.origin.entered >= 0)
        face, corner = np.divmod(found.origin.entered[at], 3)
        base, to_a, to_b = (self._faces.l[face, (corner + k) % 3] for k in (0, 2, 1))
        # In the plane of the face: the side that the path enters by on the first axis, the vertex above it.
        along = ((to_a - to_b) * (to_a + to_b) / base + base) / 2
        height = np.sqrt(np.maximum(to_a**2 - along**2, 0))
        turn = np.arctan2(height * found.origin.crossing[at], to_a**2 - along * found.origin.crossing[at])
        back[at] = self._leaving_in_faces[face, corner] + turn
        return back


def _at_corners(triangulation: IntrinsicTriangulation, angles: PolarAngles) -> FloatArray:
    """At each corner (m, 3), the angle around the vertex, not scaled, of the side to the next corner."""
    tail = triangulation.tail(np.arange(triangulation.F.size))
    leaving = (angles.leaving / angles.scale[tail]).reshape(-1, 3)
    # Half-edge 3 f + c leaves from corner c + 1.
    return np.roll(leaving, 1, axis=1)
