"""The heat methods: distance and tangent vectors on triangles, polygons and points."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
import scipy.sparse as sp

from heat_igl.compat.potpourri3d.curves import TIME_STEP, from_vertices, t_coef_here
from heat_igl.compat.potpourri3d.meshes import proper
from heat_igl.errors import require_choice
from heat_igl.heat import HeatMethodSolver, VectorHeatSolver
from heat_igl.mesh import Mesh, PointCloud, PolygonMesh
from heat_igl.operators import connection_laplacian
from heat_igl.typing import ArrayLike, FloatArray, IntArray

_LogMapStrategy = Literal["VectorHeat", "AffineLocal", "AffineAdaptive"]


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
        self._solver = HeatMethodSolver(proper(V, F), t_coef=t_coef_here(t_coef, TIME_STEP), laplacian=laplacian)

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
        self._vectors = VectorHeatSolver(self._mesh, t_coef=t_coef_here(t_coef, TIME_STEP))

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
        require_choice("strategy", strategy, get_args(_LogMapStrategy))
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
        self._given, self._t_coef = t_coef, t_coef_here(t_coef, TIME_STEP)

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
        return from_vertices(
            PointCloud(self._cloud.P, cloud_normals).triangles, curves, level_set_constraint, t_coef_here(self._given)
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
        return VectorHeatSolver(self._mesh, t_coef=t_coef_here(self._t_coef, TIME_STEP))

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
        return from_vertices(self._mesh.triangles, curves, level_set_constraint, t_coef_here(self._t_coef))
