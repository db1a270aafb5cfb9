"""Distance without a factorization: unfolding in the order of Dijkstra's algorithm, and exact windows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any, overload

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError, positive
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.mesh import Mesh, MeshLike, SurfacePoints, as_simplices, connectivity
from heat_igl.operators import Surface, unfolding_surface
from heat_igl.runtime import n_threads
from heat_igl.sources import (
    NearField,
    SourcePoints,
    Sources,
    SourceSet,
    named_vertices,
    source_set,
)
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.unfolding.asked import require_share, with_samples
from heat_igl.unfolding.directions import PathAngles
from heat_igl.unfolding.exact import ExactSurface
from heat_igl.unfolding.half_edges import MARGIN, from_mesh
from heat_igl.unfolding.numbered import TOLERANCE
from heat_igl.unfolding.refinement import Refine
from heat_igl.unfolding.single_query import single_query
from heat_igl.unfolding.solver import UnfoldingSolver

__all__ = ["MeshDomain", "directed_from_scratch", "distance_from_scratch", "distance_to_targets", "unfolded_distance"]

# Up to so many vertices, one exact query from vertices takes half to all of the time of an unfolded one on meshes of
# objects, and 1.5 times on a fine sphere: the tables of the windows are made faster.
_FEW = 50_000
# For the order of the vertices, curves are points at most so many mean edge lengths apart.
_SPACING = 1.0
# With more of the faces within the cutoff, leaving out the others saves nothing.
_MOST_OF_IT = 0.5


@overload
def unfolded_distance(V: MeshLike, F: Sources, /, *, tolerance: float = ..., cutoff: float | None = ...) -> FloatArray:
    """Distance (n,) on a mesh, `V`, from sources, `F`."""


@overload
def unfolded_distance(
    V: MeshLike, F: ArrayLike | None, sources: Sources, *, tolerance: float = ..., cutoff: float | None = ...
) -> FloatArray:
    """Distance (n,) on the triangles `F` between the positions `V`."""


def unfolded_distance(
    V: MeshLike, F: Any = None, sources: Any = None, *, tolerance: float = TOLERANCE, cutoff: float | None = None
) -> FloatArray:
    """Near-exact geodesic distance without a factorization: strip unfolding in the order of Dijkstra's algorithm.

    Called with positions, faces and sources, or with a mesh and sources. For one or two queries on a mesh; from the
    third on, ``HeatMethodSolver(mesh, refine="unfold")`` is faster.

    Parameters
    ----------
    V : mesh or (n, 3) array_like
        Whatever `as_mesh` takes, or vertex positions.
    F : (m, 3) array_like
        Triangles, when `V` holds positions.
    sources : sources
        As for `HeatMethodSolver.distance`.
    tolerance : float, optional
        See `Refinement.unfold`. With the default, sources that are vertices take exact windows on meshes of up to
        50 000 vertices, which is mostly faster for one query.
    cutoff : float, optional
        Distances beyond this are ``inf``, and the others exact: they are found by windows, in a search that ends here
        and looks at no part of the mesh that is farther from the sources.

    Returns
    -------
    (n,) float64
        In the unit of V: 0 at the sources, ``inf`` at vertices that no source reaches. From source vertices, every
        value is the length of a path on the surface. Exact on small and on rough meshes, see `UnfoldingSolver`.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or is tetrahedral.
    SourceError
        If `sources` does not name places on the mesh.
    ValueError
        If `cutoff` is not positive.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(4, 3)
    >>> heat_igl.unfolded_distance(mesh, sources=0)[[4, 15, 19]].round(6).tolist()
    [4.0, 3.0, 5.0]
    """
    if sources is None:
        F, sources = None, F
    require_share(tolerance)
    beyond = np.inf if cutoff is None else positive("cutoff", cutoff, infinite=True)
    return distance_from_scratch(as_simplices(V, F), sources, "unfold", tolerance, beyond)


def distance_from_scratch(
    mesh: Mesh, sources: Sources, refine: Refine, tolerance: float | None = None, cutoff: float = np.inf
) -> FloatArray:
    """Distance (n,) from one set of sources by unfolding triangles in the order of Dijkstra's algorithm, or by windows.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    sources : sources
        As for `HeatMethodSolver.distance`.
    refine : {"sweep", "unfold", "exact"}
        Which update, see `UnfoldingSolver`.
    tolerance : float, optional
        See `Refinement.unfold`.
    cutoff : float
        With "unfold" and "exact", what is farther is ``inf``, and the search, which is then exact, ends there.
    """
    if mesh.is_tetrahedral:
        raise MeshError('unfolding needs triangles, and the mesh holds tetrahedra: take method="heat" or a solver')
    chosen = source_set(sources, mesh.n_vertices, mesh.F)
    by_windows = chosen.on_vertices_alone and tolerance in (None, TOLERANCE) and mesh.n_vertices <= _FEW
    if refine == "unfold" and (cutoff < np.inf or by_windows):
        refine = "exact"
    if refine == "exact" and chosen.on_vertices_alone:
        return _from_vertices(mesh, chosen, cutoff)
    if refine == "unfold" and chosen.on_vertices_alone and not chosen.vertex_offset.any():
        query = single_query(mesh, chosen.vertices)
        if query is not None:
            del mesh  # these may be copies of the arrays that were given, which are not needed any more
            return query.distance(tolerance)
    solver, order = _prepared(mesh, chosen, refine, tolerance, cutoff)
    return np.asarray(solver.distances([chosen], order[:, None])[0])


def directed_from_scratch(
    mesh: Mesh, sources: Sources, refine: Refine, tolerance: float | None = None
) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
    """As `distance_from_scratch`, with labels, directions and starts of the paths: see `UnfoldingSolver.directed`."""
    if mesh.is_tetrahedral:
        raise MeshError("directions need triangles, and the mesh holds tetrahedra")
    chosen = source_set(sources, mesh.n_vertices, mesh.F)
    solver, order = _prepared(mesh, chosen, refine, tolerance, np.inf)
    return solver.directed(chosen, order)


def _prepared(
    mesh: Mesh, chosen: SourceSet, refine: Refine, tolerance: float | None, cutoff: float
) -> tuple[UnfoldingSolver, FloatArray]:
    """A solver for one set of sources, and an order of the vertices."""
    domain = MeshDomain(mesh, unfolding_surface(mesh))
    solver = UnfoldingSolver(domain, refine, tolerance, cutoff)
    return solver, np.zeros(mesh.n_vertices) if solver.is_exact else -_along_edges(domain, chosen)


def distance_to_targets(mesh: Mesh, sources: Sources, targets: Sources) -> FloatArray:
    """Exact distance (t,) of some vertices or points from one set of sources; the search ends when all are known.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    sources : sources
        As for `HeatMethodSolver.distance`.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints
        Vertices, in the order given and with repetitions, or points on faces.
    """
    chosen = source_set(sources, mesh.n_vertices, mesh.F)
    places = targets if isinstance(targets, SurfacePoints) else None
    vertices = np.empty(0, np.int64) if places is not None else named_vertices(targets, mesh.n_vertices, "targets")
    if places is not None:
        places.positions(mesh)  # which checks the faces
    reduced, kept = mesh.without_duplicate_faces()
    if reduced is not mesh and (places is not None or not chosen.on_vertices_alone):
        repeated = np.setdiff1d(np.arange(mesh.n_faces), kept)
        raise MeshError(
            f"face {repeated[0]} is there twice ({len(repeated)} are): with targets, places in faces need each "
            "face once; remove the copies"
        )
    mesh = reduced
    given, segments = intrinsic_triangulation(mesh, MARGIN), chosen.segments if len(chosen.segments.faces) else None
    points = SurfacePoints(chosen.points.faces, chosen.points.barycentric) if len(chosen.points.faces) else None
    found = ExactSurface(intrinsic_delaunay(given) if segments is None else given).solve(
        chosen.vertices,
        chosen.vertex_offset,
        points,
        None if points is None else chosen.points.offset,
        segments,
        targets=places,
        goals=vertices,
    )
    return found.distance[vertices] if places is None else found.target_distance


def _from_vertices(mesh: Mesh, sources: SourceSet, cutoff: float) -> FloatArray:
    """Exact distance (n,) up to the cutoff, on the part of the mesh that lies within it."""
    faces = _within_reach(mesh, sources, cutoff)
    if faces.mean() > _MOST_OF_IT:
        surface = ExactSurface(from_mesh(mesh, int(sources.vertices[0])))
        return surface.distance(sources.vertices, sources.vertex_offset, cutoff, n_threads())
    distance = np.full(mesh.n_vertices, np.inf)
    distance[sources.vertices] = np.where(sources.vertex_offset <= cutoff, sources.vertex_offset, np.inf)
    used, numbers = np.unique(mesh.F[faces], return_inverse=True)
    is_there = np.isin(sources.vertices, used)
    if is_there.any():
        at = np.searchsorted(used, sources.vertices[is_there])
        surface = ExactSurface(from_mesh(Mesh(mesh.V[used], numbers.reshape(-1, 3)), int(at[0])))
        distance[used] = surface.distance(at, sources.vertex_offset[is_there], cutoff)
    return distance


def _within_reach(mesh: Mesh, sources: SourceSet, cutoff: float) -> BoolArray:
    """Mask (m,) with all faces that come nearer to a source than the cutoff, along straight lines in space."""
    if cutoff == np.inf:
        return np.ones(mesh.n_faces, bool)
    starts = mesh.V[sources.vertices]
    if len(starts) == 1:
        apart = np.linalg.norm(mesh.V - starts, axis=1)
    else:
        from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

        apart = cKDTree(starts).query(mesh.V)[0]
    # No point of a triangle is farther from the nearest corner than the longest side over the square root of 3.
    longest = reduce(np.maximum, igl.edge_lengths(mesh.V, mesh.F).T)  # three times as fast as along an axis
    nearest = reduce(np.minimum, (apart[corner] for corner in mesh.F.T))
    # By more than rounding adds up to.
    return np.asarray(nearest - longest / np.sqrt(3) <= (cutoff - sources.vertex_offset.min()) * (1 + 1e-9))


@dataclass(frozen=True, eq=False)
class MeshDomain:
    """A mesh as `UnfoldingSolver` takes it."""

    mesh: Mesh
    surface: Surface

    @property
    def components(self) -> IntArray:
        """Component label (n,) of each vertex."""
        return self.mesh.components

    @cached_property
    def mean_edge_length(self) -> float:
        """Mean length of the edges of the mesh."""
        return float(self.mesh.edge_lengths.mean())

    @cached_property
    def near_field(self) -> NearField:
        """Straight lines on the faces of the mesh."""
        faces = self.surface.unfolding if self.surface.faces is None else self.surface.faces
        return NearField(faces)

    def expand_to_vertices(self, of_component: AnyArray) -> AnyArray:
        """The value (n,) of each vertex's component."""
        return np.asarray(of_component[self.components])


def _along_edges(domain: MeshDomain, sources: SourceSet) -> FloatArray:
    """Length (n,) of the shortest path along edges from the sources, whose points reach the corners of their faces."""
    mesh = domain.mesh
    if sources.on_vertices_alone and not sources.vertex_offset.any():
        return connectivity.edge_distance(mesh.edge_graph, sources.vertices)
    n = mesh.n_vertices
    begin = np.full(n, np.inf)
    np.minimum.at(begin, sources.vertices, sources.vertex_offset)
    points = sources.points
    if len(sources.segments.faces):
        points = with_samples(sources, domain.near_field, _SPACING * domain.mean_edge_length)
    np.minimum.at(begin, mesh.F[points.faces], _to_corners(mesh, points))
    # Dijkstra's algorithm starts at one more vertex, which is as far from the others as distance begins there.
    start = np.flatnonzero(np.isfinite(begin))
    rows, columns = np.concatenate([mesh.edges.T, [np.full(len(start), n), start]], axis=1)
    lengths = np.concatenate([mesh.edge_lengths, begin[start]])
    graph = sp.csr_array((lengths, (rows, columns)), shape=(n + 1, n + 1))
    return connectivity.edge_distance(graph, np.array([n]))[:n]


def _to_corners(mesh: Mesh, points: SourcePoints) -> FloatArray:
    """The value (p, 3) at each corner of the points' faces, by the straight lines inside the faces."""
    corners = mesh.V[mesh.F[points.faces]]
    places = np.einsum("pc,pcx->px", points.barycentric, corners)
    return np.asarray(points.offset[:, None] + np.linalg.norm(corners - places[:, None], axis=2))
