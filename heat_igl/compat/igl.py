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
from heat_igl.mesh import Mesh, SurfacePoints
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
    """
    mesh = Mesh(V, F)
    if not np.size(VT) + np.size(FT):
        # The older form; the present igl makes face sources of it, and returns no distances.
        FS, VT = (), FS
    sources, targets = _places(mesh, "S", VS, FS), _places(mesh, "T", VT, FT)
    given: Any = sources[0] if len(sources) == 1 else sources
    parts = [geodesic_distance(mesh, given, method="exact", targets=part) for part in targets]
    return np.concatenate([np.empty(0), *parts])


def _places(mesh: Mesh, kind: str, vertices: ArrayLike, faces: ArrayLike) -> list[IntArray | SurfacePoints]:
    """Vertices, and the centroids of faces, if there are any of each."""
    chosen = checked_indices(f"V{kind}", vertices, mesh.n_vertices)
    of_faces = checked_indices(f"F{kind}", faces, mesh.n_faces)
    centroids = [SurfacePoints(of_faces, np.full((len(of_faces), 3), 1 / 3))] if len(of_faces) else []
    return [chosen, *centroids] if len(chosen) else [*centroids]
