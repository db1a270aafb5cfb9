"""Paths between vertices, and straightest geodesics."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from heat_igl.curves import exp_map, geodesic_path, shortest_path, straighten, trace_geodesic
from heat_igl.intrinsic import tangent_frames
from heat_igl.mesh import Mesh, SurfaceCurve, SurfacePoints
from heat_igl.typing import ArrayLike, FloatArray


class _OnTriangles:
    """What solvers of paths share; `t_coef` is not read."""

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0) -> None:
        self._mesh = Mesh(V, F)


class EdgeFlipGeodesicSolver(_OnTriangles):
    """Paths between vertices, and paths and loops in the class of others: `shortest_path` and `straighten`.

    A path between two vertices is the exact shortest one, of whatever class. The last two arguments of the methods
    limit the work of potpourri3d, and are not read.
    """

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


class GeodesicTracer(_OnTriangles):
    """Straightest geodesics from vertices and faces: `trace_geodesic`.

    `max_iterations` limits the number of faces that a geodesic crosses.
    """

    def trace_geodesic_from_vertex(
        self, start_vert: int, direction_xyz: ArrayLike, max_iterations: int | None = None
    ) -> FloatArray:
        """Corners (k, 3) of a geodesic as long as the tangent part of its direction (3,)."""
        return self._traced(start_vert, self._vertex_normals[start_vert], direction_xyz, max_iterations)

    def trace_geodesic_from_face(
        self, start_face: int, bary_coords: ArrayLike, direction_xyz: ArrayLike, max_iterations: int | None = None
    ) -> FloatArray:
        """The same from the point of a face with these barycentric coordinates (3,)."""
        start = SurfacePoints(np.array([start_face]), np.array([bary_coords], np.float64))
        a, b, c = self._mesh.V[self._mesh.F[start_face]]
        return self._traced(start, np.cross(b - a, c - a), direction_xyz, max_iterations)

    @cached_property
    def _vertex_normals(self) -> FloatArray:
        return tangent_frames(self._mesh).normal

    def _traced(
        self, start: int | SurfacePoints, normal: FloatArray, direction: ArrayLike, most: int | None
    ) -> FloatArray:
        """Trace as far as the part of `direction` in the plane across `normal` is long."""
        given = np.asarray(direction, np.float64)
        normal = normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny)
        length = float(np.linalg.norm(given - normal * (normal @ given)))
        if length == 0:
            return exp_map(self._mesh, start, [[0.0, 0.0]]).positions(self._mesh)
        corners = trace_geodesic(self._mesh, start, given, length).positions(self._mesh)
        return corners if most is None else corners[: most + 1]
