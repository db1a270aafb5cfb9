"""potpourri3d's classes and functions, with its names and arguments, computed by this package.

``import heat_igl.compat.potpourri3d as pp3d`` takes the place of ``import potpourri3d as pp3d``. Arguments, shapes and
meanings are those of potpourri3d 1.4; docs/compat.md lists what differs and what is not here.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl import io
from heat_igl.curves import (
    GeodesicPathSolver,
    exp_map,
    geodesic_path,
    isolines,
    shortest_path,
    straighten,
    trace_geodesic,
)
from heat_igl.curves.geodesics import as_curve
from heat_igl.curves.places import CommonFaces
from heat_igl.geodesic import geodesic_distance
from heat_igl.heat import HeatMethodSolver, SignedHeatSolver, VectorHeatSolver
from heat_igl.mesh import Mesh, PointCloud, PolygonMesh, SurfaceCurve, SurfacePoints
from heat_igl.operators import connection_laplacian
from heat_igl.sources import OffsetSources
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

__all__ = [
    "EdgeFlipGeodesicSolver",
    "GeodesicTracer",
    "MeshFastMarchingDistanceSolver",
    "MeshHeatMethodDistanceSolver",
    "MeshMarchingTrianglesSolver",
    "MeshSignedHeatSolver",
    "MeshVectorHeatSolver",
    "PointCloudHeatSolver",
    "PointCloudLocalTriangulation",
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

_LogMapStrategy = Literal["VectorHeat", "AffineLocal", "AffineAdaptive"]
_LEVELS: dict[str, Literal["zero", "none", "constant"]] = {"zeroset": "zero", "none": "none", "multiple": "constant"}
# This package's own factors for potpourri3d's default of 1: with the fitted heat flow, and of signed distance.
_TIME_STEP, _SIGNED_TIME_STEP = 0.5, 0.25

# Curves, each a list of points: a face, and the barycentric coordinates in it.
_Curves = list[list[tuple[int, list[float]]]]
# A vertex and (), an edge and its share of the way to the second end, or a face and two or three coordinates.
_Node = tuple[int, Sequence[float]]


def _t_coef_here(t_coef: float, own: float = _SIGNED_TIME_STEP) -> float | None:
    """The time step for that of potpourri3d: the default for its default, otherwise in proportion to `own`."""
    return None if t_coef == 1 else own * t_coef


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
        self._solver = HeatMethodSolver(_proper(V, F), t_coef=_t_coef_here(t_coef, _TIME_STEP), laplacian=laplacian)

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


class _OnVertices(_Framed):
    """What solvers on meshes share."""

    def extend_scalar(self, v_inds: Sequence[int], values: ArrayLike) -> FloatArray:
        """Values at vertices, extended to all (n,): each gets about the value of the nearest."""
        return self._vectors.extend(v_inds, values)

    def transport_tangent_vectors(self, v_inds: Sequence[int], vectors: ArrayLike) -> FloatArray:
        """Tangent vectors (k, 2), transported to all vertices, (n, 2)."""
        return self._vectors.transport(v_inds, vectors)


class MeshVectorHeatSolver(_OnVertices):
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
        self._vectors = VectorHeatSolver(self._mesh, t_coef=_t_coef_here(t_coef, _TIME_STEP))

    def transport_tangent_vector(self, v_ind: int, vector: ArrayLike) -> FloatArray:
        """A tangent vector (2,), transported to all vertices, (n, 2)."""
        return self._vectors.transport(v_ind, vector)

    def get_connection_laplacian(self) -> sp.csc_matrix:
        """The connection Laplacian (n, n), complex, Hermitian and, as potpourri3d has it, positive semidefinite."""
        return -connection_laplacian(self._mesh, "intrinsic-delaunay" if self._intrinsic else "cotan")

    def compute_log_map(self, v_ind: int, strategy: _LogMapStrategy = "AffineLocal") -> FloatArray:
        """The logarithmic map (n, 2) at a vertex.

        Parameters
        ----------
        v_ind : int
            The vertex.
        strategy : {"VectorHeat", "AffineLocal", "AffineAdaptive"}
            "VectorHeat" is `VectorHeatSolver.log_map`. The two others follow shortest paths and are exact, as
            `heat_igl.log_map`.
        """
        if strategy not in get_args(_LogMapStrategy):
            names = ", ".join(map(repr, get_args(_LogMapStrategy)))
            raise ValueError(f"strategy must be one of {names}, not {strategy!r}")
        return (self._vectors if strategy == "VectorHeat" else self._paths).log_map(v_ind)

    @cached_property
    def _paths(self) -> VectorHeatSolver:
        return VectorHeatSolver(self._mesh, method="windows")


class PointCloudHeatSolver(_Framed):
    """Distance and tangent vectors on points (n, 3): `HeatMethodSolver` and `VectorHeatSolver` on a `PointCloud`.

    Vectors need points whose triangles (`PointCloud.triangles`) are a manifold that can be oriented.
    """

    def __init__(self, P: ArrayLike, t_coef: float = 1.0) -> None:
        self._cloud = PointCloud(P)
        self._given, self._t_coef = t_coef, _t_coef_here(t_coef, _TIME_STEP)

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
        """The logarithmic map (n, 2) at a point, along the shortest paths on the triangles."""
        return VectorHeatSolver(self._cloud, method="windows").log_map(p_ind)

    def compute_signed_distance(
        self,
        curves: Sequence[Sequence[int]],
        cloud_normals: ArrayLike,
        preserve_source_normals: bool = False,
        level_set_constraint: str = "ZeroSet",
        soft_level_set_weight: float = -1,
    ) -> FloatArray:
        """Distance (n,) from the nearest of the curves from point to point, negative on their left.

        Parameters
        ----------
        curves : list of lists of int
            Points; a curve follows the shortest path from each to the next.
        cloud_normals : (n, 3) array_like
            Normals, which decide what is left.
        preserve_source_normals, soft_level_set_weight
            Not read.
        level_set_constraint : {"ZeroSet", "None", "Multiple"}
            As for `MeshSignedHeatSolver.compute_distance`.
        """
        return _from_vertices(
            PointCloud(self._cloud.P, cloud_normals).triangles, curves, level_set_constraint, _t_coef_here(self._given)
        )


class PointCloudLocalTriangulation:
    """The triangles around each point (n, 3): those of `PointCloud.triangles`, one surface for all points.

    `with_degeneracy_heuristic` is not read.
    """

    def __init__(self, P: ArrayLike, with_degeneracy_heuristic: bool = True) -> None:
        self._cloud = PointCloud(P)

    def get_local_triangulation(self) -> IntArray:
        """Triangles (n, k, 3) that begin with the point, or the first equal one, and rows of -1 up to the largest k."""
        faces = self._cloud.triangles.F
        # Each triangle in three turns, one for each corner.
        turns = np.concatenate([np.roll(faces, -corner, axis=1) for corner in range(3)])
        turns = turns[np.argsort(turns[:, 0], kind="stable")]
        count = np.bincount(turns[:, 0], minlength=self._cloud.n_vertices)
        first = np.cumsum(count) - count
        table = np.full((self._cloud.n_vertices, int(count.max()), 3), -1, np.int64)
        table[turns[:, 0], np.arange(len(turns)) - first[turns[:, 0]]] = turns
        return table[self._cloud.originals]


class PolygonMeshHeatSolver(_OnVertices):
    """Distance, tangent vectors and signed distance on polygons.

    Distance is that of `HeatMethodSolver` on a `PolygonMesh`; everything else is computed on its triangles.
    """

    def __init__(self, V: ArrayLike, F: Any, t_coef: float = 1.0) -> None:
        self._mesh = PolygonMesh(V, F)
        self._t_coef = t_coef

    @cached_property
    def _solver(self) -> HeatMethodSolver:
        return HeatMethodSolver(self._mesh, t_coef=None if self._t_coef == 1 else self._t_coef)

    @cached_property
    def _vectors(self) -> VectorHeatSolver:  # type: ignore[override]
        return VectorHeatSolver(self._mesh, t_coef=_t_coef_here(self._t_coef, _TIME_STEP))

    def compute_distance(self, v_inds: ArrayLike) -> FloatArray:
        """Distance (n,) from the nearest of several vertices."""
        return self._solver.distance(np.asarray(v_inds))

    def compute_signed_distance(
        self, curves: Sequence[Sequence[int]], level_set_constraint: str = "ZeroSet"
    ) -> FloatArray:
        """Distance (n,) from the nearest of the curves from vertex to vertex, negative on their left.

        Parameters
        ----------
        curves : list of lists of int
            Vertices; a curve follows an edge or the shortest path from each to the next.
        level_set_constraint : {"ZeroSet", "None", "Multiple"}
            As for `MeshSignedHeatSolver.compute_distance`.
        """
        return _from_vertices(self._mesh.triangles, curves, level_set_constraint, _t_coef_here(self._t_coef))


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
        """Normals (n, 3), weighted by angles as those of `tangent_frames`."""
        weighting = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE
        return np.asarray(igl.per_vertex_normals(self._mesh.V, self._mesh.F, weighting))

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


class MeshMarchingTrianglesSolver:
    """Isolines of values at vertices: `isolines`."""

    def __init__(self, V: ArrayLike, F: ArrayLike) -> None:
        self._mesh = _proper(V, F)

    def marching_triangles(self, u: ArrayLike, isoval: float = 0.0) -> _Curves:
        """The curves on which the values u (n,) are `isoval`; every point is one of a face."""
        curves: _Curves = []
        for curve in isolines(self._mesh, u, float(isoval))[0]:
            faces = [int(curve.faces[0]), *curve.faces.tolist()]
            points = [curve.start[0].tolist(), *curve.end.tolist()]
            curves.append(list(zip(faces, points, strict=True)))
        return curves


def marching_triangles(V: ArrayLike, F: ArrayLike, u: ArrayLike, isoval: float = 0.0) -> _Curves:
    """The curves on which the values u (n,) are `isoval`, in one call."""
    return MeshMarchingTrianglesSolver(V, F).marching_triangles(u, isoval)


class _CurveReader:
    """Reads the curves of potpourri3d, lists of nodes, as curves and points of this package."""

    def __init__(self, mesh: Mesh) -> None:
        self._mesh, self._faces, self._solver = mesh, CommonFaces(mesh), GeodesicPathSolver(mesh)

    def points(self, name: str, nodes: Sequence[_Node]) -> SurfacePoints:
        """The nodes as points in faces."""
        found = [self._place(f"{name}[{i}]", *node) for i, node in enumerate(nodes)]
        faces, barycentric = zip(*found, strict=True)
        return SurfacePoints(np.array(faces), np.array(barycentric))

    def curve(self, name: str, nodes: Sequence[_Node]) -> SurfaceCurve:
        """The curve from node to node: straight in a face that has both, and along a geodesic otherwise."""
        if len(nodes) < 2:
            raise ValueError(f"{name} has {len(nodes)} points: a curve needs two or more")
        at = self.points(name, nodes)
        return as_curve(self._solver.pieces(at.faces, at.barycentric), is_closed=False)

    def _place(self, name: str, index: int, coordinates: Sequence[float]) -> tuple[int, FloatArray]:
        """The first face that holds a node, and the coordinates (3,) of the node in it."""
        given = np.asarray(coordinates, np.float64).ravel()
        if len(given) > 3:
            raise ValueError(
                f"{name} has {len(given)} coordinates: a face has two or three, an edge one, a vertex none"
            )
        kind = ("vertex", "edge", "face", "face")[len(given)]
        table = {"vertex": np.arange(self._mesh.n_vertices)[:, None], "edge": self._mesh.edges, "face": self._mesh.F}
        elements = table[kind]
        if not 0 <= index < len(elements):
            raise ValueError(f"{name} = {index} is no {kind}: indices run from 0 to {len(elements) - 1}")
        if kind == "edge":
            given = np.array([1 - given[0], given[0]])
        elif len(given) != 3:
            given = np.append(given, 1 - given.sum())
        vertices = elements[index]
        face = self._faces.of(vertices[given != 0])
        if face < 0:
            raise ValueError(f"vertex {vertices[0]} is in no face, so no curve goes through it")
        return face, ((self._mesh.F[face][:, None] == vertices) * given).sum(axis=1)


def _signed_distance(
    solver: SignedHeatSolver,
    curves: Sequence[SurfaceCurve],
    constraint: str,
    unsigned: Sequence[SurfaceCurve | SurfacePoints] = (),
) -> FloatArray:
    """Signed distance (n,) with potpourri3d's word for the level."""
    level = _LEVELS.get(str(constraint).lower())
    if level is None:
        raise ValueError(f"level_set_constraint must be 'ZeroSet', 'None' or 'Multiple', not {constraint!r}")
    return solver.distance(list(curves), unsigned=list(unsigned) or None, level=level)


def _from_vertices(
    mesh: Mesh, curves: Sequence[Sequence[int]], constraint: str, t_coef: float | None = None
) -> FloatArray:
    """Signed distance (n,) from curves through vertices."""
    reader = _CurveReader(mesh)
    parts = [reader.curve(f"curves[{i}]", [(v, ()) for v in vertices]) for i, vertices in enumerate(curves)]
    return _signed_distance(SignedHeatSolver(mesh, t_coef=t_coef), parts, constraint)


class _FromCurves:
    """What solvers of distance from curves share."""

    _mesh: Mesh

    @cached_property
    def _reader(self) -> _CurveReader:
        return _CurveReader(self._mesh)


class MeshSignedHeatSolver(_FromCurves):
    """Distance with a sign from curves: that of `SignedHeatSolver`, with the opposite sign as in potpourri3d.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3), manifold and oriented alike.
    t_coef : float
        Time step relative to the default.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0) -> None:
        self._mesh = Mesh(V, F)
        self._signed = SignedHeatSolver(self._mesh, t_coef=_t_coef_here(t_coef))

    @cached_property
    def _unsigned(self) -> HeatMethodSolver:
        return HeatMethodSolver(self._mesh)

    def compute_distance(
        self,
        curves: Sequence[Sequence[_Node]],
        curve_signs: Sequence[bool] = (),
        points: Sequence[_Node] = (),
        preserve_source_normals: bool = False,
        level_set_constraint: str = "ZeroSet",
        soft_level_set_weight: float = -1,
    ) -> FloatArray:
        """Distance (n,) from the nearest curve or point, positive on the left of the curves.

        The other solvers of potpourri3d, and this package's, are negative there.

        Parameters
        ----------
        curves : list of lists of nodes
            A node is ``(vertex, [])``, ``(edge, [t])`` with an edge of `edges`, or ``(face, [a, b, c])``.
        curve_signs : list of bool
            Whether each curve gives a sign; those that are not named do.
        points : list of nodes
            More sources, without a sign.
        preserve_source_normals, soft_level_set_weight
            Not read.
        level_set_constraint : {"ZeroSet", "None", "Multiple"}
            The `level` "zero", "none" or "constant" of `SignedHeatSolver.distance`.
        """
        signed: list[SurfaceCurve] = []
        rest: list[SurfaceCurve] = []
        for i, nodes in enumerate(curves):
            has_sign = i >= len(curve_signs) or curve_signs[i]
            (signed if has_sign else rest).append(self._reader.curve(f"curves[{i}]", nodes))
        others: list[SurfaceCurve | SurfacePoints] = [*rest]
        if len(points):
            others.append(self._reader.points("points", points))
        if signed:
            # 0 is subtracted from, so that no -0 comes out.
            return 0.0 - _signed_distance(self._signed, signed, level_set_constraint, others)
        return self._unsigned.distance(others)


class MeshFastMarchingDistanceSolver(_FromCurves):
    """Distance from points and curves without a linear system: `geodesic_distance`, or `SignedHeatSolver` with a sign.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3).
    """

    def __init__(self, V: ArrayLike, F: ArrayLike) -> None:
        self._mesh = Mesh(V, F)

    @cached_property
    def _signed(self) -> SignedHeatSolver:
        return SignedHeatSolver(self._mesh)

    def compute_distance(
        self,
        curves: Sequence[Sequence[_Node]],
        distances: Sequence[Sequence[float]] = (),
        sign: bool = False,
    ) -> FloatArray:
        """Distance (n,) from the nodes of all curves; with `sign` from the curves, negative on their left.

        Parameters
        ----------
        curves : list of lists of nodes
            As for `MeshSignedHeatSolver.compute_distance`.
        distances : list of lists of float
            The value at which distance begins at each node; 0 at those that are not named.
        sign : bool
            Whether curves have a left and a right. Then all `distances` must be 0.
        """
        begin = np.zeros(sum(map(len, curves)))
        first = 0
        for nodes, given in zip(curves, distances, strict=False):
            begin[first : first + min(len(given), len(nodes))] = given[: len(nodes)]
            first += len(nodes)
        if sign:
            if begin.any():
                raise ValueError("with sign=True, distances must be 0: a curve with a sign is where distance is 0")
            parts = [self._reader.curve(f"curves[{i}]", nodes) for i, nodes in enumerate(curves)]
            return self._signed.distance(parts)
        nodes = [node for curve in curves for node in curve]
        points = self._reader.points("curves", nodes)
        lowest = float(begin.min())
        return geodesic_distance(self._mesh, OffsetSources(points, begin - lowest)) + lowest


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
    mesh = io.read_mesh(filename)
    return np.array(mesh.V), np.array(mesh.F)


def read_polygon_mesh(filename: str | os.PathLike[str]) -> tuple[FloatArray, list[list[int]]]:
    """Positions (n, 3) and polygons of a file, see `heat_igl.read_polygon_mesh`."""
    mesh = io.read_polygon_mesh(filename)
    return np.array(mesh.V), [polygon.tolist() for polygon in mesh.polygons]


def write_mesh(
    V: ArrayLike,
    F: ArrayLike,
    filename: str | os.PathLike[str],
    UV_coords: ArrayLike | None = None,
    UV_type: str | None = None,
) -> None:
    """Write triangles to a file, see `heat_igl.write_mesh`; texture coordinates go to OBJ alone.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3).
    filename : path-like
        The extension selects the format.
    UV_coords : array_like, optional
        Texture coordinates: (n, 2), (m, 2) or (3 m, 2).
    UV_type : {"per-vertex", "per-face", "per-corner"}, optional
        Which of these they are.

    Raises
    ------
    ValueError
        If there are `UV_coords` and the file is no OBJ, or their shape does not fit `UV_type`.
    """
    mesh = Mesh(V, F)
    if UV_coords is None:
        io.write_mesh(filename, mesh)
        return
    path = Path(filename)
    if path.suffix.lower() != ".obj":
        raise ValueError(f"UV_coords are written to .obj files, not to {path}")
    m = mesh.n_faces
    rows_of_corners: dict[str | None, tuple[int, IntArray]] = {
        "per-vertex": (mesh.n_vertices, mesh.F),
        "per-face": (m, np.repeat(np.arange(m)[:, None], 3, axis=1)),
        "per-corner": (3 * m, np.arange(3 * m).reshape(-1, 3)),
    }
    if UV_type not in rows_of_corners:
        raise ValueError(f"UV_type must be one of {', '.join(map(repr, rows_of_corners))}, not {UV_type!r}")
    k, rows = rows_of_corners[UV_type]
    coordinates = np.asarray(UV_coords, np.float64)
    if coordinates.shape != (k, 2):
        raise ValueError(f"UV_coords must have shape ({k}, 2), {UV_type}, not {coordinates.shape}")
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.V.tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in coordinates.tolist()]
    for corners in (np.stack([mesh.F, rows], axis=2) + 1).tolist():
        lines.append("f " + " ".join(f"{vertex}/{row}" for vertex, row in corners))
    with io.complete_file(path) as temporary:
        temporary.write_text("\n".join([*lines, ""]), encoding="utf8")


def read_point_cloud(filename: str | os.PathLike[str]) -> FloatArray:
    """The points (n, 3) of a file, see `heat_igl.read_point_cloud`."""
    return np.array(io.read_point_cloud(filename).P)


def write_point_cloud(V: ArrayLike, filename: str | os.PathLike[str]) -> None:
    """Write points (n, 3) to a file, see `heat_igl.write_point_cloud`."""
    io.write_point_cloud(filename, PointCloud(V))
