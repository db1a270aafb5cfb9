"""libigl's functions for geodesic distance, with libigl's names and arguments, computed by this package.

After ``from heat_igl.compat import igl`` in place of ``import igl``, `heat_geodesics_precompute`,
`heat_geodesics_solve` and `exact_geodesic` are those of this module, with the signatures of libigl 2.6, and so is
`heat_geodesic` of libigl 2.5 and before. Every other name is libigl's own.
"""

from __future__ import annotations

from typing import Any

import igl
import numpy as np

from heat_igl.geodesic import geodesic_distance
from heat_igl.heat import HeatMethodSolver
from heat_igl.intrinsic import checked_indices
from heat_igl.mesh import Mesh
from heat_igl.typing import ArrayLike, FloatArray, IntArray

__all__ = ["HeatGeodesicsData", "exact_geodesic", "heat_geodesic", "heat_geodesics_precompute", "heat_geodesics_solve"]


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(igl, name)


def __dir__() -> list[str]:
    return sorted({*__all__, *dir(igl)})


class HeatGeodesicsData:
    """What `heat_geodesics_precompute` fills in and `heat_geodesics_solve` reads.

    Attributes
    ----------
    use_intrinsic_delaunay : bool
        Kept for libigl's sake and not read: the heat method always runs on an intrinsic Delaunay triangulation.
    """

    def __init__(self) -> None:
        self.use_intrinsic_delaunay = False
        self.solver: HeatMethodSolver | None = None


def heat_geodesics_precompute(
    V: ArrayLike, F: ArrayLike, t: float | HeatGeodesicsData | None = None, data: HeatGeodesicsData | None = None
) -> None:
    """Factor the matrices of the heat method: `HeatMethodSolver`.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3), and triangles (m, 3) or tetrahedra (m, 4).
    t : float, optional
        Time step, a squared length; without it the default of `HeatMethodSolver`. As in libigl, `data` may stand in
        this place.
    data : HeatGeodesicsData
        Filled in.

    Raises
    ------
    TypeError
        If there is no `data`.
    MeshError, ValueError
        As for `HeatMethodSolver`.
    """
    if isinstance(t, HeatGeodesicsData):
        t, data = None, t
    if data is None:
        raise TypeError("data is missing: pass a HeatGeodesicsData, which is filled in")
    data.solver = HeatMethodSolver(Mesh(V, F), t=t)


def heat_geodesics_solve(data: HeatGeodesicsData, gamma: ArrayLike) -> FloatArray:
    """Distance (n,) from the nearest of the vertices `gamma` by the heat method.

    Raises
    ------
    ValueError
        If `data` has not been through `heat_geodesics_precompute`.
    SourceError
        If `gamma` are not vertices of the mesh.
    """
    if data.solver is None:
        raise ValueError("data is empty: pass it to heat_geodesics_precompute first")
    return data.solver.distance(np.asarray(gamma))


def heat_geodesic(v: ArrayLike, f: ArrayLike, t: float, gamma: ArrayLike) -> FloatArray:
    """Both steps of the heat method in one call, as libigl had it up to 2.5; arguments as above."""
    data = HeatGeodesicsData()
    heat_geodesics_precompute(v, f, t, data)
    return heat_geodesics_solve(data, gamma)


def exact_geodesic(
    V: ArrayLike, F: ArrayLike, VS: ArrayLike = (), FS: ArrayLike = (), VT: ArrayLike = (), FT: ArrayLike = ()
) -> FloatArray:
    """Exact polyhedral distance of targets from the nearest source.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3).
    VS, VT : (k,) array_like of int
        Vertices that are sources, and targets.
    FS, FT : (k,) array_like of int
        Triangles whose centroids are sources, and targets. Without any targets, as in the older form
        ``exact_geodesic(v, f, vs, vt)`` of libigl, `FS` are vertices and the targets.

    Returns
    -------
    (len(VT) + len(FT),) float64
        Distances of the vertices, then of the centroids; ``inf`` where no source is on the same component.

    Raises
    ------
    MeshError
        If V and F are no triangle mesh, or an index is out of range.
    SourceError
        If there are targets and no source.

    Notes
    -----
    A centroid becomes a vertex: its triangle is divided into three, which lie in its plane, so no distance changes.
    """
    mesh = Mesh(V, F)
    if not np.size(VT) + np.size(FT):
        # The older form; the present igl makes face sources of it, and returns no distances.
        FS, VT = (), FS
    n, m = mesh.n_vertices, mesh.n_faces
    vertex_sources, vertex_targets = checked_indices("VS", VS, n), checked_indices("VT", VT, n)
    face_sources, face_targets = checked_indices("FS", FS, m), checked_indices("FT", FT, m)
    if not len(vertex_targets) + len(face_targets):
        return np.empty(0)
    divided, place = np.unique(np.concatenate([face_sources, face_targets]), return_inverse=True)
    centroids = n + place
    sources = np.concatenate([vertex_sources, centroids[: len(face_sources)]])
    targets = np.concatenate([vertex_targets, centroids[len(face_sources) :]])
    return np.asarray(geodesic_distance(_with_centroids(mesh, divided), sources, method="exact")[targets])


def _with_centroids(mesh: Mesh, faces: IntArray) -> Mesh:
    """The mesh with the centroids of `faces` (k,) as vertices n, n + 1, ...; each of these faces becomes three."""
    corners = mesh.F[faces]
    center = np.broadcast_to(mesh.n_vertices + np.arange(len(faces))[:, None], corners.shape)
    parts = np.stack([corners, np.roll(corners, -1, axis=1), center], axis=2).reshape(-1, 3)
    V = np.concatenate([mesh.V, mesh.V[corners].mean(axis=1)])
    return Mesh(V, np.concatenate([np.delete(mesh.F, faces, axis=0), parts]))
