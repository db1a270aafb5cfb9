"""potpourri3d's paths, straightest geodesics and isolines, computed by this package."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import igl
import numpy as np

from heat_igl.compat.triangles import proper
from heat_igl.curves import geodesic_path, isolines, shortest_path, straighten, trace_geodesic
from heat_igl.mesh import Mesh, SurfaceCurve, SurfacePoints
from heat_igl.typing import ArrayLike, FloatArray

__all__ = ["EdgeFlipGeodesicSolver", "GeodesicTracer", "MeshMarchingTrianglesSolver", "marching_triangles"]

# Curves, each a list of points: a face, and the barycentric coordinates in it.
Curves = list[list[tuple[int, list[float]]]]


class EdgeFlipGeodesicSolver:
    """Paths between vertices, and paths and loops in the class of others: `shortest_path` and `straighten`.

    A path between two vertices is the exact shortest one, of whatever class. The last two arguments of the methods
    limit the work of potpourri3d, and are not read.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0) -> None:
        self._mesh = Mesh(V, F)

    def find_geodesic_path(
        self,
        v_start: int,
        v_end: int,
        max_iterations: int | None = None,
        max_relative_length_decrease: float | None = None,
    ) -> FloatArray:
        """Corners (k, 3) of the path from one vertex to another."""
        if v_start == v_end:
            raise ValueError(f"v_start and v_end are the same vertex, {v_start}")
        return shortest_path(self._mesh, v_start, v_end).positions(self._mesh)

    def find_geodesic_path_poly(
        self,
        v_list: Sequence[int],
        max_iterations: int | None = None,
        max_relative_length_decrease: float | None = None,
    ) -> FloatArray:
        """Corners (k, 3) of the geodesic in the class of the shortest paths from vertex to vertex."""
        return straighten(self._mesh, geodesic_path(self._mesh, v_list)).positions(self._mesh)

    def find_geodesic_loop(
        self,
        v_list: Sequence[int],
        max_iterations: int | None = None,
        max_relative_length_decrease: float | None = None,
    ) -> FloatArray:
        """Corners (k, 3) of the closed geodesic in the class of a loop, the last as the first; it may be a point."""
        around = geodesic_path(self._mesh, [*v_list, v_list[0]])
        loop = SurfaceCurve(around.faces, around.start, around.end, is_closed=True)
        return straighten(self._mesh, loop).positions(self._mesh)


class GeodesicTracer:
    """Straightest geodesics from vertices and faces: `trace_geodesic`.

    `max_iterations` limits the number of faces that a geodesic crosses.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0) -> None:
        self._mesh = Mesh(V, F)

    def trace_geodesic_from_vertex(
        self, start_vert: int, direction_xyz: ArrayLike, max_iterations: int | None = None
    ) -> FloatArray:
        """Corners (k, 3) of a geodesic as long as the tangent part of its direction (3,)."""
        normal = self._vertex_normals[start_vert]
        return self._traced(start_vert, self._mesh.V[start_vert], normal, direction_xyz, max_iterations)

    def trace_geodesic_from_face(
        self, start_face: int, bary_coords: ArrayLike, direction_xyz: ArrayLike, max_iterations: int | None = None
    ) -> FloatArray:
        """The same from the point of a face with these barycentric coordinates (3,)."""
        start = SurfacePoints(np.array([start_face]), np.array([bary_coords], np.float64))
        a, b, c = self._mesh.V[self._mesh.F[start_face]]
        position = start.positions(self._mesh)[0]
        return self._traced(start, position, np.cross(b - a, c - a), direction_xyz, max_iterations)

    @cached_property
    def _vertex_normals(self) -> FloatArray:
        """Normals (n, 3), weighted by angles as those of `tangent_frames`."""
        weighting = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE
        return np.asarray(igl.per_vertex_normals(self._mesh.V, self._mesh.F, weighting))

    def _traced(
        self,
        start: int | SurfacePoints,
        position: FloatArray,
        normal: FloatArray,
        direction: ArrayLike,
        most: int | None,
    ) -> FloatArray:
        """Trace as far as the part of `direction` in the plane across `normal` is long."""
        given = np.asarray(direction, np.float64)
        normal = normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny)
        length = float(np.linalg.norm(given - normal * (normal @ given)))
        if length == 0:
            return position[None]
        corners = trace_geodesic(self._mesh, start, given, length).positions(self._mesh)
        return corners if most is None else corners[: most + 1]


class MeshMarchingTrianglesSolver:
    """Isolines of values at vertices: `isolines`."""

    def __init__(self, V: ArrayLike, F: ArrayLike) -> None:
        self._mesh = proper(V, F)

    def marching_triangles(self, u: ArrayLike, isoval: float = 0.0) -> Curves:
        """The curves on which the values u (n,) are `isoval`; every point is one of a face."""
        curves: Curves = []
        for curve in isolines(self._mesh, u, float(isoval))[0]:
            faces = [int(curve.faces[0]), *curve.faces.tolist()]
            points = [curve.start[0].tolist(), *curve.end.tolist()]
            curves.append(list(zip(faces, points, strict=True)))
        return curves


def marching_triangles(V: ArrayLike, F: ArrayLike, u: ArrayLike, isoval: float = 0.0) -> Curves:
    """The curves on which the values u (n,) are `isoval`, in one call."""
    return MeshMarchingTrianglesSolver(V, F).marching_triangles(u, isoval)
