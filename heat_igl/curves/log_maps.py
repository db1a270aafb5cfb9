"""The logarithmic map: the vector from a point of the surface to every vertex, along the shortest path."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from heat_igl.errors import SourceError, names_guessed, require_choice
from heat_igl.geodesic import GeodesicSolver
from heat_igl.heat import VectorHeatSolver
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
    if isinstance(mesh, VectorHeatSolver):
        return mesh.log_map(_one_vertex(source, mesh.n_vertices))
    if isinstance(mesh, GeodesicSolver):
        _require_one(source, mesh.n_vertices)
        found = mesh.directions(source)
        return _vectors(found.distance, found.departure)
    require_choice("method", method, get_args(LogMapMethod))
    mesh = as_mesh(mesh)
    triangles = as_simplices(mesh)
    if method == "vector-heat":
        return VectorHeatSolver(mesh).log_map(_one_vertex(source, triangles.n_vertices))
    _require_one(source, triangles.n_vertices)
    if isinstance(mesh, PointCloud):
        found = GeodesicSolver(mesh, method="exact").directions(source)
        return _vectors(found.distance, found.departure)
    if not triangles.is_tetrahedral and not isinstance(source, SurfacePoints):
        vertex = triangles.originals[named_vertices(source, triangles.n_vertices, "source")[0]]
        vectors = vectors_from(triangles, int(vertex))
        if vectors is not None:
            return vectors[triangles.originals]
    found = GeodesicSolver(triangles).directions(source)
    return _vectors(found.distance, found.departure)


def _vectors(distance: FloatArray, departure: FloatArray) -> FloatArray:
    length = np.where(np.isfinite(distance), distance, 0.0)
    return np.stack([length * np.cos(departure), length * np.sin(departure)], axis=1)


def _one_vertex(source: Sources, n: int) -> int:
    if isinstance(source, SurfacePoints):
        raise SourceError("the vector heat method starts at vertices: take another method for a point in a face")
    _require_one(source, n)
    return int(named_vertices(source, n, "source")[0])


def _require_one(source: Sources, n: int) -> None:
    k = len(source) if isinstance(source, SurfacePoints) else len(named_vertices(source, n, "source"))
    if k != 1:
        raise SourceError(f"source must be one vertex or point, not {k}")
