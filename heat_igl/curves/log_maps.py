"""The logarithmic map: vectors from a point to all vertices, or around many vertices up to a radius."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import SourceError, names_guessed, positive, require_choice
from heat_igl.geodesic import GeodesicSolver
from heat_igl.heat import VectorHeatSolver
from heat_igl.intrinsic import TangentFrames
from heat_igl.mesh import MeshLike, PointCloud, SurfacePoints, as_mesh, as_simplices, as_triangles, one_sided
from heat_igl.operators import unfolding_surface
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import FloatArray, IntArray
from heat_igl.windows import Origin, PathDirections, contradicted, in_circle, vectors_from
from heat_igl.windows.local import search_each
from heat_igl.windows.tables import MARGIN, Tables, from_triangulation

LogMapMethod = Literal["exact", "vector-heat"]


@names_guessed
def log_map(
    mesh: MeshLike | GeodesicSolver | VectorHeatSolver, source: Sources, *, method: LogMapMethod = "exact"
) -> FloatArray:
    """The logarithmic map of a vertex or a point: polar coordinates around it, as vectors.

    Parameters
    ----------
    mesh : mesh, GeodesicSolver or VectorHeatSolver
        Whatever `as_mesh` takes, with triangles that are a consistently oriented manifold, or a `PointCloud`; or a
        solver on such a mesh, which keeps tables that are otherwise made for each call.
    source : int or SurfacePoints
        A vertex, or one point in a face.
    method : {"exact", "vector-heat"}
        "exact" follows exact shortest paths, "vector-heat" is `VectorHeatSolver.log_map`, from vertices only. Ignored
        for a solver, which has its own method.

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
    If the shortest path to a vertex is straight, `exp_map` of the vector returns the vertex, to 1e-14 of the largest
    distance. The exception are paths that pass another vertex within rounding, since directions on its two sides differ
    by its curvature: from a source at the distance d from that vertex, in edge lengths, these are the paths within
    1e-14 / d radians of it. If a path bends, at a vertex of negative curvature or on the boundary, the vector has the
    length of the whole path and the direction in which it leaves the source; a straightest geodesic in this direction
    need not lead to the vertex. At the cut locus there are several shortest paths, and the vector is that of one of
    them.

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
    places = source.faces if isinstance(source, SurfacePoints) else named_vertices(source, n, "source")
    if len(places) != 1:
        raise SourceError(f"source must be one vertex or point, not {len(places)}")
    return None if isinstance(source, SurfacePoints) else int(places[0])


@dataclass(frozen=True, eq=False)
class LogMapsWithin:
    """The shortest paths from k vertices to all vertices up to a radius, made by `log_maps_within`.

    Attributes
    ----------
    distance : (k, n) scipy.sparse.csr_array
        What is stored is a distance, the 0 of a vertex from itself too; what is not stored is farther than the radius.
        The other arrays have the same pattern, and share its ``indices`` and ``indptr``.
    departure : (k, n) scipy.sparse.csr_array
        Polar angle in [0, 2 pi) at which the path leaves the source, in the frame of `tangent_frames` there. The log
        map is ``frames.from_angles(departure.data, distance.data)``.
    arrival : (k, n) scipy.sparse.csr_array
        Angle in [0, 2 pi) in the frame of the vertex in which the path arrives, away from the source.
    rotation : (k, n) scipy.sparse.csr_array
        Angle in [-pi, pi] by which parallel transport along the path turns components: a vector with the angle a in the
        frame of the source has the angle a + rotation in that of the vertex. Departure and arrival are 0 at the
        source, where rotation is 0 too.

    Notes
    -----
    Angles are those of `GeodesicSolver.directions`. As coordinates for torch or JAX, without a copy of the values:
    ``torch.sparse_csr_tensor(d.indptr, d.indices, d.data)``, or `rows` and ``d.indices``.
    """

    distance: sp.csr_array
    departure: sp.csr_array
    arrival: sp.csr_array
    rotation: sp.csr_array

    def __repr__(self) -> str:
        k, n = self.distance.shape
        return f"LogMapsWithin({k} sources, {n} vertices, {self.distance.nnz} paths)"

    @property
    def rows(self) -> IntArray:
        """The row of each stored entry."""
        return np.repeat(np.arange(self.distance.shape[0]), np.diff(self.distance.indptr))


def log_maps_within(mesh: MeshLike, radius: float, sources: Sources | None = None) -> LogMapsWithin:
    """Log maps of some vertices up to a radius: distance, directions and parallel transport, all exact.

    Parameters
    ----------
    mesh : mesh
        Triangles on n vertices, oriented alike, at most two at an edge: whatever `as_mesh` takes.
    radius : float
        In the mesh's unit, positive; ``inf`` for all that can be reached.
    sources : int, sequence of int, or (n,) mask of bool, optional
        The k vertices that are asked, each for itself; all n if not given.

    Returns
    -------
    LogMapsWithin
        Four sparse arrays of one pattern, that of `distances_within`.

    Raises
    ------
    MeshError
        If the mesh cannot be used, holds tetrahedra, or has no tangent frames.
    ValueError
        If `radius` is not a positive number.
    SourceError
        If `sources` does not name vertices.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.grid(4)
    >>> maps = heat_igl.log_maps_within(mesh, 0.3, sources=[12])  # the middle
    >>> maps.distance.indices.tolist(), maps.distance.data.tolist()
    ([7, 11, 12, 13, 17], [0.25, 0.25, 0.0, 0.25, 0.25])
    >>> frames = heat_igl.tangent_frames(mesh)
    >>> vectors = frames.from_angles(maps.departure.data, maps.distance.data)
    >>> bool(np.allclose(frames.to_world(vectors[-1:], [12]), mesh.V[17] - mesh.V[12]))
    True
    """
    limit = positive("radius", radius, infinite=True)
    triangles = as_triangles(one_sided(mesh, "parallel transport along paths needs"), "log maps need")
    n = triangles.n_vertices
    chosen = triangles.originals[np.arange(n) if sources is None else named_vertices(sources, n)]
    surface = unfolding_surface(triangles, MARGIN)
    directions, tables = PathDirections(surface), from_triangulation(surface.unfolding)
    vertex, ways, distance = _paths(tables, triangles.V, chosen, limit)
    angles, polar = directions.of_ways(vertex, ways), directions.angles
    back = polar.from_polar(vertex, angles.back)
    departure = polar.from_polar(chosen[ways.label], angles.departure)
    turn = back + np.pi - departure - angles.turning
    rotation = turn - 2 * np.pi * np.rint(turn / (2 * np.pi))
    values = [np.nan_to_num(value) for value in (angles.departure, in_circle(back + np.pi), rotation)]
    indptr, shape = np.append(0, np.cumsum(np.bincount(ways.label, minlength=len(chosen)))), (len(chosen), n)
    found = (sp.csr_array((data, vertex, indptr), shape=shape) for data in (distance, *values))
    return LogMapsWithin(*(array[:, triangles.originals] if triangles.has_copies else array for array in found))


def _paths(tables: Tables, V: FloatArray, chosen: IntArray, radius: float) -> tuple[IntArray, Origin, FloatArray]:
    """Paths from vertices (k,), source after source: vertices that they lead to, how they run, and their lengths."""
    limit = float(tables.scaled(radius))
    order, near = search_each(tables, chosen, V, lambda work, numbers, _: work.within(numbers, limit), directed=True)
    counts, vertex, distance, way, line, is_wrong = near
    if is_wrong.any():
        raise contradicted(f"from vertex {chosen[order[np.argmax(is_wrong)]]}")
    # In the order of the sources, and of each in the order of the vertices.
    source = np.repeat(order, counts)
    key = source * tables.n + vertex
    sort = np.argsort(key, kind="stable")
    source, key, way, line = source[sort], key[sort], way[sort], line[sort]
    ways = Origin(
        source,
        # Roots are nearer than the vertices, so they are there too.
        np.searchsorted(key, source * tables.n + tables.old_vertex[way[:, 0]]),
        tables.old_half_edge(way[:, 2]),
        tables.unscaled(line[:, 2]),
        tables.old_half_edge(way[:, 1]),
        line[:, :2],
    )
    return vertex[sort].astype(np.int64), ways, distance[sort]
