"""`geodesic_distance`: one question about one mesh, answered near-exactly unless asked otherwise."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from heat_igl.errors import MeshError, require_choice
from heat_igl.heat_method.batches import checked_cutoff, cut_off
from heat_igl.heat_method.options import SolverOptions
from heat_igl.heat_method.solver import HeatMethodSolver
from heat_igl.mesh import MeshLike, PointCloud, as_mesh, as_simplices, nearest_copies
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray
from heat_igl.unfolding import distance_from_scratch, distance_to_targets

__all__ = ["DistanceMethod", "geodesic_distance"]

DistanceMethod = Literal["unfold", "sweep", "heat", "exact"]


def geodesic_distance(
    mesh: MeshLike,
    sources: Sources,
    *,
    method: DistanceMethod = "unfold",
    cutoff: float | None = None,
    targets: Sources | None = None,
) -> FloatArray:
    """Geodesic distance from the nearest source, from scratch.

    For one or two questions about a mesh. From the third on, keep a `HeatMethodSolver`: with ``refine="unfold"`` it
    gives the same accuracy, and it is asked many times.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes: `Mesh`, `PolygonMesh`, `PointCloud`, a pair (V, F), a path, or a mesh or point cloud
        of trimesh, pyvista, open3d, meshio and others.
    sources : sources
        A vertex, a sequence of vertices, a mask (n,) of bool, `SurfacePoints`, a `SurfaceCurve`, `OffsetSources` if
        distance begins at other values than 0, or a list of such. Faces of points on polygons are counted as those of
        ``PolygonMesh.triangles``.
    method : {"unfold", "sweep", "heat", "exact"}
        "unfold" follows straight lines through strips of triangles: near-exact, and exact from vertices on meshes of up
        to 50 000 vertices, see `unfolded_distance`. "sweep" unfolds two triangles at a time. Both go through the
        vertices in the order of Dijkstra's algorithm; polygons are cut into triangles. "heat" is the heat method as
        `HeatMethodSolver` has it by default, and on a `PointCloud`, whose solver sweeps by default, with
        ``magnitude="damped"``; polygons get a vertex inside. "exact" is the polyhedral distance by windows. In
        tetrahedra, all but "exact", which is refused, follow straight lines that bend at edges of the boundary.
    cutoff : float, optional
        Distances beyond this are ``inf``. With "unfold" and "exact", the others are exact, and the search ends there.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints, optional
        The vertices or points whose distance is asked for: only theirs is returned. With "unfold" and "exact" alone,
        where distances are then exact, and the search ends once they are known.

    Returns
    -------
    (n,) or (t,) float64
        In the mesh's unit: 0 at source vertices (the offset of those that have one, unless another source is nearer),
        ``inf`` at vertices that no source reaches, never negative or NaN.

    Raises
    ------
    MeshError
        If the mesh cannot be used or is not understood, or if it holds tetrahedra and the method is "exact" or
        there are targets.
    SourceError
        If `sources` does not describe places on the mesh.
    ValueError
        If there is no such `method`, `cutoff` is not positive, or there are targets and `method` is "heat" or "sweep".

    Warns
    -----
    AccuracyWarning
        As for `HeatMethodSolver`, with ``method="heat"``.

    Examples
    --------
    >>> from heat_igl import geodesic_distance
    >>> V = [[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]]
    >>> F = [[0, 1, 3], [1, 2, 3]]
    >>> geodesic_distance((V, F), 0).tolist()
    [0.0, 3.0, 5.0, 4.0]
    """
    require_choice("method", method, get_args(DistanceMethod))
    beyond = checked_cutoff(cutoff)
    if targets is not None and method in ("heat", "sweep"):
        raise ValueError(f"targets need method='unfold' or 'exact', whose search can end at them, not {method!r}")
    given = as_mesh(mesh)
    if method == "heat":
        return HeatMethodSolver.from_options(given, SolverOptions().by_heat_on(given)).distance(sources, beyond)
    triangles = as_simplices(given)
    if triangles.is_tetrahedral:
        if method == "exact" or targets is not None:
            asked = "targets need" if method != "exact" else "method='exact' needs"
            raise MeshError(
                f"{asked} triangles, but the mesh holds tetrahedra: leave it away, and straight lines are followed "
                "through them, to all vertices"
            )
        return HeatMethodSolver(triangles, refine="sweep").distance(sources, beyond)
    if targets is not None:
        return np.asarray(cut_off(distance_to_targets(triangles, sources, targets), beyond))
    farthest = np.inf if beyond is None else beyond
    # Points near the cutoff, whose straight lines are known, may lie beyond it.
    distance = distance_from_scratch(triangles, sources, method, cutoff=farthest)
    if isinstance(given, PointCloud):
        distance = distance[nearest_copies(distance, given.originals)]
    return np.asarray(cut_off(distance, beyond))
