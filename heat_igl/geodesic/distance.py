"""`geodesic_distance`: one question about one mesh."""

from __future__ import annotations

from functools import reduce
from typing import get_args

import igl
import numpy as np

from heat_igl.errors import checked_cutoff, names_guessed, require_choice
from heat_igl.geodesic.solver import GeodesicSolver
from heat_igl.mesh import Mesh, MeshLike, PolygonMesh, as_mesh
from heat_igl.plan import MOST_WITHIN_REACH, DistanceMethod
from heat_igl.sources import OffsetSources, Sources, named_vertices, source_set
from heat_igl.typing import ArrayLike, BoolArray, FloatArray


@names_guessed
def geodesic_distance(
    mesh: MeshLike,
    sources: Sources,
    *,
    method: DistanceMethod = "auto",
    tolerance: float = 1e-5,
    cutoff: float | None = None,
    targets: Sources | None = None,
    region: ArrayLike | None = None,
) -> FloatArray:
    """Geodesic distance from the nearest source, in one call; to ask more than once, keep a `GeodesicSolver`.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes: `Mesh`, `PolygonMesh`, `PointCloud`, a pair (V, F), a path, or a mesh or point cloud
        of trimesh, pyvista, open3d, meshio and others.
    sources : sources
        A vertex, a sequence of vertices, a mask (n,) of bool, `SurfacePoints`, a `SurfaceCurve`, `OffsetSources` if
        distance begins at other values than 0, positions beside the triangles, floats (3,) or (k, 3), or a list of
        such. Faces of points on polygons are counted as those of ``PolygonMesh.triangles``.
    method : {"auto", "windows", "exact", "sweep", "heat"}
        As for `GeodesicSolver`; "heat" is the heat method as `HeatMethodSolver` has it by default.
    tolerance : float
        Largest error over the distance. Windows are exact, which holds every tolerance.
    cutoff : float, optional
        Distances beyond this are ``inf``, and a search by windows looks at no part of the mesh that is farther away.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints, optional
        The vertices or points whose distance is asked for: only theirs is returned, and a search by windows ends once
        they are known.
    region : (n,) or (m,) array_like of bool, optional
        What paths may enter, as for `GeodesicSolver`; elsewhere distance is ``inf``.

    Returns
    -------
    (n,) or (t,) float64
        In the mesh's unit: 0 at source vertices (the offset of those that have one, unless another source is nearer),
        ``inf`` at vertices that no source reaches, never negative or NaN.

    Raises
    ------
    MeshError
        If the mesh cannot be used or is not understood, or not with this method.
    SourceError
        If `sources` does not describe places on the mesh.
    ValueError
        If there is no such `method`, `cutoff` is not positive, or targets are points and the method is not windows.

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
    limit = checked_cutoff(cutoff)
    given = as_mesh(mesh)
    if method == "heat":
        from heat_igl.heat import HeatMethodSolver  # what follows needs none of its modules

        distance = HeatMethodSolver(given, region=region).distance(sources, cutoff=limit)
        return distance if targets is None else distance[named_vertices(targets, len(distance), "targets")]
    if isinstance(given, PolygonMesh):
        given = given.triangles
    is_plain = targets is None and region is None and method != "sweep"
    if limit < np.inf and is_plain and isinstance(given, Mesh) and not given.has_copies:
        near = _within_reach(given, sources, limit)
        if near is not None:
            return _on_part(given, near, sources, tolerance, limit)
    solver = GeodesicSolver(given, method=method, tolerance=tolerance, region=region)
    if targets is None:
        return solver.distance(sources, cutoff=limit)
    found = solver._to_targets(sources, targets)
    found[found > limit] = np.inf
    return found


def _on_part(mesh: Mesh, faces: BoolArray, sources: Sources, tolerance: float, cutoff: float) -> FloatArray:
    """Distance (n,) up to the cutoff from vertices, on the faces (m,) that lie within it."""
    chosen = source_set(sources, mesh.n_vertices, mesh.F, mesh)
    distance = np.full(mesh.n_vertices, np.inf)
    distance[chosen.vertices] = chosen.vertex_offset
    used, numbers = np.unique(mesh.F[faces], return_inverse=True)
    is_there = np.isin(chosen.vertices, used)
    if is_there.any():
        solver = GeodesicSolver(Mesh(mesh.V[used], numbers.reshape(-1, 3)), tolerance=tolerance)
        there = OffsetSources(np.searchsorted(used, chosen.vertices[is_there]), chosen.vertex_offset[is_there])
        distance[used] = solver.distance(there, cutoff=cutoff)
    distance[distance > cutoff] = np.inf
    return distance


def _within_reach(mesh: Mesh, sources: Sources, cutoff: float) -> BoolArray | None:
    """Mask (m,) with all faces that come nearer to a source vertex than the cutoff, along straight lines in space.

    None if most do, or if the sources are not vertices.
    """
    if mesh.is_tetrahedral:
        return None
    chosen = source_set(sources, mesh.n_vertices, mesh.F, mesh)
    if not chosen.on_vertices_alone:
        return None
    starts = mesh.V[chosen.vertices]
    if len(starts) == 1:
        apart = np.linalg.norm(mesh.V - starts, axis=1)
    else:
        from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

        apart = cKDTree(starts).query(mesh.V)[0]
    # No point of a triangle is farther from the nearest corner than the longest side over the square root of 3.
    longest = reduce(np.maximum, igl.edge_lengths(mesh.V, mesh.F).T)  # three times as fast as along an axis
    nearest = reduce(np.minimum, (apart[corner] for corner in mesh.F.T))
    # By more than rounding adds up to.
    near = np.asarray(nearest - longest / np.sqrt(3) <= (cutoff - chosen.vertex_offset.min()) * (1 + 1e-9))
    return near if near.mean() <= MOST_WITHIN_REACH else None
