"""The logarithmic map: the vector from a point of the surface to every vertex, along the shortest path."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from heat_igl.errors import SourceError, names_guessed, require_choice
from heat_igl.geodesic import GeodesicSolver
from heat_igl.heat import VectorHeatSolver
from heat_igl.intrinsic import TangentFrames
from heat_igl.mesh import MeshLike, PointCloud, SurfacePoints, as_mesh, as_simplices
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import FloatArray
from heat_igl.windows import vectors_from

LogMapMethod = Literal["exact", "vector-heat"]


@names_guessed
def log_map(
    mesh: MeshLike | GeodesicSolver | VectorHeatSolver, source: Sources, *, method: LogMapMethod = "exact"
) -> FloatArray:
    """The logarithmic map of a vertex or a point: polar coordinates around it, as vectors.

    Parameters
    ----------
    mesh : mesh, GeodesicSolver or VectorHeatSolver
        Whatever `as_mesh` takes, with triangles that are a manifold and oriented alike, which those of a `PointCloud`
        need not be; or a solver on such a mesh. A solver keeps the tables that a mesh needs for
        each source.
    source : int or SurfacePoints
        A vertex, or one point in a face.
    method : {"exact", "vector-heat"}
        "exact" follows exact shortest paths, "vector-heat" is `VectorHeatSolver.log_map`, from vertices only. A solver
        has a method of its own, and this is not read.

    Returns
    -------
    (n, 2) float64
        Vectors as long as the distance, in the direction in which the shortest path departs: in the frame of
        `tangent_frames` at a vertex (also if it is given as a point), and with the first axis along the side of
        corners 0 and 1 in a face, as `exp_map` takes them. 0 at the source and where it does not reach.

    Raises
    ------
    MeshError
        If the mesh cannot be used or has no tangent frames, see `tangent_frames`.
    SourceError
        If `source` is not one vertex or one point of the mesh.
    ValueError
        If there is no such `method`, or if the engine of a `GeodesicSolver` finds no paths.

    Notes
    -----
    If the shortest path to a vertex is straight, `exp_map` of the vector leads back to the vertex, to 1e-14 of the
    largest distance. It may not if the path passes another vertex as closely as numbers are rounded, since those on its
    two sides differ in direction by its curvature: from a point at the distance d from that vertex, in edge lengths,
    these are paths within 1e-14 / d of a radian of it. Where a path bends, at a vertex of negative curvature or on the
    boundary, the vector has the whole length, and the direction in which the path leaves the source: no straightest
    geodesic from the source need lead there. At the cut locus there are several shortest paths, and the vector is that
    of one of them.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.strip(4, 3)
    >>> vectors = heat_igl.log_map(mesh, 0)
    >>> np.linalg.norm(vectors, axis=1)[[4, 15, 19]].round(6).tolist()
    [4.0, 3.0, 5.0]
    """
    if not isinstance(mesh, GeodesicSolver | VectorHeatSolver):
        require_choice("method", method, get_args(LogMapMethod))
        given = as_mesh(mesh)
        triangles, is_cloud = as_simplices(given), isinstance(given, PointCloud)
        vertex = _vertex(source, triangles.n_vertices)
        if method == "exact" and vertex is not None and not (is_cloud or triangles.is_tetrahedral):
            vectors = vectors_from(triangles, int(triangles.originals[vertex]))
            if vectors is not None:
                return vectors[triangles.originals]
        if method == "vector-heat":
            mesh = VectorHeatSolver(given)
        else:
            mesh = GeodesicSolver(given, method="exact") if is_cloud else GeodesicSolver(triangles)
    vertex = _vertex(source, mesh.n_vertices)
    if isinstance(mesh, GeodesicSolver):
        found = mesh.directions(source)
        return TangentFrames.from_angles(found.departure, np.where(np.isfinite(found.distance), found.distance, 0.0))
    if vertex is None:
        raise SourceError("the vector heat method starts at vertices: take another method for a point in a face")
    return mesh.log_map(vertex)


def _vertex(source: Sources, n: int) -> int | None:
    """The vertex that is the one source, None for a point in a face."""
    is_point = isinstance(source, SurfacePoints)
    places = source.faces if isinstance(source, SurfacePoints) else named_vertices(source, n, "source")
    if len(places) != 1:
        raise SourceError(f"source must be one vertex or point, not {len(places)}")
    return None if is_point else int(places[0])
