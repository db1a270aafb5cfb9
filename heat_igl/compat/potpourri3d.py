"""potpourri3d's classes and functions, with its names and arguments, computed by this package.

``import heat_igl.compat.potpourri3d as pp3d`` takes the place of ``import potpourri3d as pp3d``. Arguments, shapes and
meanings are those of potpourri3d 1.4; docs/compat.md lists what differs and what is not here.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Literal, get_args

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.curves import geodesic_path, isolines, shortest_paths, straighten, trace_geodesic
from heat_igl.heat_method import HeatMethodSolver, VectorHeatSolver
from heat_igl.io import read_mesh as _read_mesh
from heat_igl.io import read_point_cloud as _read_point_cloud
from heat_igl.io import read_polygon_mesh as _read_polygon_mesh
from heat_igl.io import write_mesh as _write_mesh
from heat_igl.io import write_point_cloud as _write_point_cloud
from heat_igl.mesh import Mesh, PointCloud, PolygonMesh, SurfaceCurve, SurfacePoints
from heat_igl.operators import connection_laplacian
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

__all__ = [
    "EdgeFlipGeodesicSolver",
    "GeodesicTracer",
    "MeshHeatMethodDistanceSolver",
    "MeshMarchingTrianglesSolver",
    "MeshVectorHeatSolver",
    "PointCloudHeatSolver",
    "PolygonMeshHeatSolver",
    "compute_distance",
    "compute_distance_multisource",
    "cotan_laplacian",
    "edges",
    "face_areas",
    "marching_triangles",
    "read_mesh",
    "read_point_cloud",
    "read_polygon_mesh",
    "vertex_areas",
    "write_mesh",
    "write_point_cloud",
]

# Curves, each a list of points: a face, and the barycentric coordinates in it.
Curves = list[list[tuple[int, list[float]]]]
_LogMapStrategy = Literal["VectorHeat", "AffineLocal", "AffineAdaptive"]
# This package's own factor, with the fitted heat flow, for potpourri3d's default of 1.
_TIME_STEP = 0.5


def _t_coef(t_coef: float) -> float | None:
    """The time step for that of potpourri3d: the default for its default, otherwise in proportion."""
    return None if t_coef == 1 else _TIME_STEP * t_coef


def _proper(V: ArrayLike, F: ArrayLike) -> Mesh:
    """The mesh without the faces that repeat a vertex, which potpourri3d accepts: they have no area."""
    faces: AnyArray = np.asarray(F)
    if faces.ndim == 2 and faces.shape[1] == 3:
        repeats = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
        faces = faces[~repeats] if repeats.any() and not repeats.all() else faces
    return Mesh(V, faces)


class MeshHeatMethodDistanceSolver:
    """Distance by the heat method on triangles: `HeatMethodSolver`.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3). Faces that repeat a vertex are left out.
    t_coef : float
        Time step relative to the default, which is half of the squared mean edge length here.
    use_robust : bool
        Solve on an intrinsic Delaunay triangulation or on the tufted cover; False for the triangles as they are.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0, use_robust: bool = True) -> None:
        laplacian: Literal["auto", "cotan"] = "auto" if use_robust else "cotan"
        self._solver = HeatMethodSolver(_proper(V, F), t_coef=_t_coef(t_coef), laplacian=laplacian)

    def compute_distance(self, v_ind: int) -> FloatArray:
        """Distance (n,) from a vertex."""
        return self._solver.distance(v_ind)

    def compute_distance_multisource(self, v_inds: ArrayLike) -> FloatArray:
        """Distance (n,) from the nearest of several vertices."""
        return self._solver.distance(np.asarray(v_inds))


def compute_distance(V: ArrayLike, F: ArrayLike, v_ind: int) -> FloatArray:
    """Distance (n,) from a vertex by the heat method, in one call."""
    return MeshHeatMethodDistanceSolver(V, F).compute_distance(v_ind)


def compute_distance_multisource(V: ArrayLike, F: ArrayLike, v_inds: ArrayLike) -> FloatArray:
    """Distance (n,) from the nearest of several vertices by the heat method, in one call."""
    return MeshHeatMethodDistanceSolver(V, F).compute_distance_multisource(v_inds)


class _Framed:
    """What solvers for tangent vectors on meshes and on point clouds share."""

    _vectors: VectorHeatSolver

    def get_tangent_frames(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The axes x and y and the normal at each vertex, (n, 3) each."""
        frames = self._vectors.frames
        return frames.x, frames.y, frames.normal


class MeshVectorHeatSolver(_Framed):
    """The vector heat method on triangles: `VectorHeatSolver`.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3), manifold and oriented alike.
    t_coef : float
        As for `MeshHeatMethodDistanceSolver`.
    use_intrinsic_delaunay : bool
        Whether `get_connection_laplacian` is that of the intrinsic Delaunay triangulation, on which heat always flows.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0, use_intrinsic_delaunay: bool = True) -> None:
        self._mesh = Mesh(V, F)
        self._intrinsic = use_intrinsic_delaunay
        self._vectors = VectorHeatSolver(self._mesh, t_coef=_t_coef(t_coef))

    def extend_scalar(self, v_inds: Sequence[int], values: ArrayLike) -> FloatArray:
        """Values at vertices, extended to all (n,): each gets about the value of the nearest."""
        return self._vectors.extend(v_inds, values)

    def transport_tangent_vector(self, v_ind: int, vector: ArrayLike) -> FloatArray:
        """A tangent vector (2,), transported to all vertices, (n, 2)."""
        return self._vectors.transport(v_ind, vector)

    def transport_tangent_vectors(self, v_inds: Sequence[int], vectors: ArrayLike) -> FloatArray:
        """Tangent vectors (k, 2), transported to all vertices, (n, 2)."""
        return self._vectors.transport(v_inds, vectors)

    def get_connection_laplacian(self) -> sp.csc_matrix:
        """The connection Laplacian (n, n), complex, Hermitian and, as potpourri3d has it, positive semidefinite."""
        return -connection_laplacian(self._mesh, "intrinsic-delaunay" if self._intrinsic else "cotan")

    def compute_log_map(self, v_ind: int, strategy: _LogMapStrategy = "AffineLocal") -> FloatArray:
        """The logarithmic map (n, 2) at a vertex: `VectorHeatSolver.log_map` for every `strategy`."""
        if strategy not in get_args(_LogMapStrategy):
            names = ", ".join(map(repr, get_args(_LogMapStrategy)))
            raise ValueError(f"strategy must be one of {names}, not {strategy!r}")
        return self._vectors.log_map(v_ind)


class PointCloudHeatSolver(_Framed):
    """Distance and tangent vectors on points (n, 3): `HeatMethodSolver` and `VectorHeatSolver` on a `PointCloud`.

    Vectors need points whose triangles (`PointCloud.triangles`) are a manifold that can be oriented.
    """

    def __init__(self, P: ArrayLike, t_coef: float = 1.0) -> None:
        self._cloud = PointCloud(P)
        self._t_coef = _t_coef(t_coef)

    @cached_property
    def _solver(self) -> HeatMethodSolver:
        return HeatMethodSolver(self._cloud, t_coef=self._t_coef)

    @cached_property
    def _vectors(self) -> VectorHeatSolver:  # type: ignore[override]
        return VectorHeatSolver(self._cloud, t_coef=self._t_coef)

    def compute_distance(self, p_ind: int) -> FloatArray:
        """Distance (n,) from a point."""
        return self._solver.distance(p_ind)

    def compute_distance_multisource(self, p_inds: ArrayLike) -> FloatArray:
        """Distance (n,) from the nearest of several points."""
        return self._solver.distance(np.asarray(p_inds))

    def extend_scalar(self, p_inds: Sequence[int], values: ArrayLike) -> FloatArray:
        """Values at points, extended to all (n,): each gets about the value of the nearest."""
        return self._vectors.extend(p_inds, values)

    def transport_tangent_vector(self, p_ind: int, vector: ArrayLike) -> FloatArray:
        """A tangent vector (2,), transported to all points, (n, 2)."""
        return self._vectors.transport(p_ind, vector)

    def transport_tangent_vectors(self, p_inds: Sequence[int], vectors: ArrayLike) -> FloatArray:
        """Tangent vectors (k, 2), transported to all points, (n, 2)."""
        return self._vectors.transport(p_inds, vectors)

    def compute_log_map(self, p_ind: int) -> FloatArray:
        """The logarithmic map (n, 2) at a point."""
        return self._vectors.log_map(p_ind)


class PolygonMeshHeatSolver:
    """Distance on polygons by the heat method: `HeatMethodSolver` on a `PolygonMesh`."""

    def __init__(self, V: ArrayLike, F: Any, t_coef: float = 1.0) -> None:
        self._solver = HeatMethodSolver(PolygonMesh(V, F), t_coef=None if t_coef == 1 else t_coef)

    def compute_distance(self, v_inds: ArrayLike) -> FloatArray:
        """Distance (n,) from the nearest of several vertices."""
        return self._solver.distance(np.asarray(v_inds))


class EdgeFlipGeodesicSolver:
    """Paths between vertices, and paths and loops in the class of others: `shortest_paths` and `straighten`.

    A path between two vertices follows near-exact distances, so no path of another class is taken for the shortest. The
    last two arguments of the methods limit the work of potpourri3d, and are not read.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0) -> None:  # noqa: ARG002
        self._mesh = Mesh(V, F)

    @cached_property
    def _solver(self) -> HeatMethodSolver:
        return HeatMethodSolver(self._mesh, refine="unfold")

    def find_geodesic_path(
        self,
        v_start: int,
        v_end: int,
        max_iterations: int | None = None,  # noqa: ARG002
        max_relative_length_decrease: float | None = None,  # noqa: ARG002
    ) -> FloatArray:
        """Corners (k, 3) of the path from one vertex to another."""
        if v_start == v_end:
            raise ValueError(f"v_start and v_end are the same vertex, {v_start}")
        return shortest_paths(self._mesh, self._solver, v_start, v_end)[0].positions(self._mesh)

    def find_geodesic_path_poly(
        self,
        v_list: Sequence[int],
        max_iterations: int | None = None,  # noqa: ARG002
        max_relative_length_decrease: float | None = None,  # noqa: ARG002
    ) -> FloatArray:
        """Corners (k, 3) of the geodesic in the class of the shortest paths from vertex to vertex."""
        return straighten(self._mesh, geodesic_path(self._mesh, v_list)).positions(self._mesh)

    def find_geodesic_loop(
        self,
        v_list: Sequence[int],
        max_iterations: int | None = None,  # noqa: ARG002
        max_relative_length_decrease: float | None = None,  # noqa: ARG002
    ) -> FloatArray:
        """Corners (k, 3) of the closed geodesic in the class of a loop, the last as the first; it may be a point."""
        around = geodesic_path(self._mesh, [*v_list, v_list[0]])
        loop = SurfaceCurve(around.faces, around.start, around.end, is_closed=True)
        return straighten(self._mesh, loop).positions(self._mesh)


class GeodesicTracer:
    """Straightest geodesics from vertices and faces: `trace_geodesic`.

    `max_iterations` limits the number of faces that a geodesic crosses.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0) -> None:  # noqa: ARG002
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
        self._mesh = _proper(V, F)

    def marching_triangles(self, u: ArrayLike, isoval: float = 0.0) -> Curves:
        """The curves on which the values u (n,) are `isoval`; every point is one of a face."""
        curves: Curves = []
        for curve in isolines(self._mesh, u, isoval)[0]:
            faces = [int(curve.faces[0]), *curve.faces.tolist()]
            points = [curve.start[0].tolist(), *curve.end.tolist()]
            curves.append(list(zip(faces, points, strict=True)))
        return curves


def marching_triangles(V: ArrayLike, F: ArrayLike, u: ArrayLike, isoval: float = 0.0) -> Curves:
    """The curves on which the values u (n,) are `isoval`, in one call."""
    return MeshMarchingTrianglesSolver(V, F).marching_triangles(u, isoval)


def cotan_laplacian(V: ArrayLike, F: ArrayLike, denom_eps: float = 0.0) -> sp.csr_matrix:
    """The cotangent Laplacian (n, n), positive semidefinite as potpourri3d has it; `denom_eps` is added to twice the
    areas, by which cotangents are divided.
    """
    mesh = _proper(V, F)
    half_cotangents = igl.cotmatrix_entries(mesh.V, mesh.F)  # opposite corners 0, 1, 2
    if denom_eps:
        double_area = 2 * mesh.measures
        half_cotangents *= (double_area / (double_area + denom_eps))[:, None]
    tail, head = np.roll(mesh.F, -1, axis=1).ravel(), np.roll(mesh.F, -2, axis=1).ravel()
    weights = sp.coo_array((half_cotangents.ravel(), (tail, head)), shape=(mesh.n_vertices, mesh.n_vertices))
    weights = weights + weights.T
    return sp.csr_matrix(sp.diags_array(weights.sum(axis=1)) - weights)


def face_areas(V: ArrayLike, F: ArrayLike) -> FloatArray:
    """The area (m,) of each triangle."""
    return np.asarray(igl.doublearea(np.asarray(V, np.float64), np.asarray(F, np.int64)) / 2)


def vertex_areas(V: ArrayLike, F: ArrayLike) -> FloatArray:
    """A third of the area of the triangles around each vertex, (n,)."""
    corners: IntArray = np.ravel(np.asarray(F, np.int64))
    return np.asarray(np.bincount(corners, np.repeat(face_areas(V, F) / 3, 3), minlength=len(np.asarray(V))))


def edges(V: ArrayLike, F: ArrayLike) -> IntArray:
    """The distinct edges (k, 2), each ascending, in lexicographic order."""
    return np.array(_proper(V, F).edges)


def read_mesh(filename: str | os.PathLike[str]) -> tuple[FloatArray, IntArray]:
    """Positions (n, 3) and triangles (m, 3) of a file, see `heat_igl.read_mesh`."""
    mesh = _read_mesh(filename)
    return np.array(mesh.V), np.array(mesh.F)


def read_polygon_mesh(filename: str | os.PathLike[str]) -> tuple[FloatArray, list[list[int]]]:
    """Positions (n, 3) and polygons of a file, see `heat_igl.read_polygon_mesh`."""
    mesh = _read_polygon_mesh(filename)
    return np.array(mesh.V), [polygon.tolist() for polygon in mesh.polygons]


def write_mesh(V: ArrayLike, F: ArrayLike, filename: str | os.PathLike[str]) -> None:
    """Write triangles to a file, see `heat_igl.write_mesh`; texture coordinates are not written."""
    _write_mesh(filename, Mesh(V, F))


def read_point_cloud(filename: str | os.PathLike[str]) -> FloatArray:
    """The points (n, 3) of a file, see `heat_igl.read_point_cloud`."""
    return np.array(_read_point_cloud(filename).P)


def write_point_cloud(V: ArrayLike, filename: str | os.PathLike[str]) -> None:
    """Write points (n, 3) to a file, see `heat_igl.write_point_cloud`."""
    _write_point_cloud(filename, PointCloud(V))
