"""Sampling: farthest points, geodesic Voronoi cells and their dual, the diameter and distance matrices.

All functions ask a solver for distances from single vertices, so they work on every domain that has `Operators`, and
are as accurate as the solver.

Examples
--------
>>> import heat_igl
>>> heat_igl.sampling.farthest_points(heat_igl.shapes.strip(6, 1), 2).tolist()
[0, 13]
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from heat_igl.errors import MeshError, names_guessed, shown
from heat_igl.geodesic import GeodesicSolver, Solver
from heat_igl.mesh import Mesh, MeshLike, as_simplices, as_triangles, connectivity
from heat_igl.runtime import TimeLeft
from heat_igl.sources import distinct_vertices, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

__all__ = [
    "VoronoiCells",
    "as_solver",
    "diameter",
    "distance_matrix",
    "dual_triangulation",
    "farthest_cells",
    "farthest_points",
    "voronoi_cells",
]


def as_solver(solver: Solver | MeshLike) -> Solver:
    """The solver itself, or an object with the same methods; on a mesh a `GeodesicSolver`."""
    if hasattr(solver, "distance") and hasattr(solver, "n_vertices"):
        return cast(GeodesicSolver, solver)
    return GeodesicSolver(as_simplices(cast(MeshLike, solver)))


def distance_rows(solver: Solver, vertices: IntArray) -> Iterator[AnyArray]:
    """Distances (n,) from each of `vertices`, solved in blocks."""
    left = TimeLeft("queries are done", len(vertices))
    for row in solver.iter_distances([[int(v)] for v in vertices]):
        left()
        yield row


@dataclass(frozen=True, eq=False, repr=False)
class VoronoiCells:
    """The geodesic Voronoi diagram of some vertices, the sites: every vertex belongs to the nearest site.

    Attributes
    ----------
    sites : (k,) int64
        The site of each cell.
    labels : (n,) int64
        Position in `sites` of the nearest site, either of two equally near ones; -1 at vertices that no site
        reaches.
    distance : (n,) float64
        Distance from the nearest site, ``inf`` at vertices that no site reaches.

    Examples
    --------
    >>> import heat_igl
    >>> cells = heat_igl.farthest_cells(heat_igl.shapes.strip(6, 1), 2)
    >>> cells.sites.tolist(), cells.labels[:7].tolist()
    ([0, 13], [0, 0, 0, 0, 1, 1, 1])
    """

    sites: IntArray
    labels: IntArray
    distance: FloatArray

    def __repr__(self) -> str:
        lost = int((self.labels < 0).sum())
        return (
            f"VoronoiCells({len(self.sites)} cells, {len(self.labels)} vertices{f', {lost} unreached' if lost else ''})"
        )


def voronoi_cells(solver: Solver | MeshLike, sites: ArrayLike) -> VoronoiCells:
    """The geodesic Voronoi diagram of given vertices; a `GeodesicSolver` takes one query, other solvers one per site.

    Parameters
    ----------
    solver : GeodesicSolver, HeatMethodSolver or mesh
        A solver on any domain, or whatever `as_mesh` takes, for a new `GeodesicSolver`.
    sites : (k,) array_like of int
        Distinct vertices.

    Returns
    -------
    VoronoiCells
        With the sites in the given order. Each site belongs to its own cell, even if another one is at distance 0.

    Raises
    ------
    SourceError
        If an entry of `sites` is no vertex, or comes twice.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(5, 1)
    >>> heat_igl.voronoi_cells(mesh, [0, 5]).labels.tolist()
    [0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1]
    """
    solver = as_solver(solver)
    chosen = distinct_vertices(sites, solver.n_vertices, "sites")
    if isinstance(solver, GeodesicSolver):
        found = solver.voronoi(chosen)
        return VoronoiCells(chosen, found.labels, found.distance)
    labels = np.full(solver.n_vertices, -1)
    distance = np.full(solver.n_vertices, np.inf)
    for i, row in enumerate(distance_rows(solver, chosen)):
        claim_nearer(distance, labels, i, row)
    return VoronoiCells(chosen, labels, distance)


def claim_nearer(distance: FloatArray, labels: IntArray, label: int, candidate: AnyArray) -> None:
    """Set `labels` to `label`, and `distance` to `candidate`, at the vertices with a smaller `candidate` (n,)."""
    nearer = candidate < distance
    labels[nearer] = label
    np.minimum(distance, candidate, out=distance)


@names_guessed
def farthest_points(solver: Solver | MeshLike, k: int, *, start: ArrayLike | None = None) -> IntArray:
    """`k` vertices, each as far as possible from those before (Gonzalez 1985; Moenning and Dodgson 2003).

    Parameters
    ----------
    solver : GeodesicSolver, HeatMethodSolver or mesh
        Of any domain, or whatever `as_mesh` takes, for its `GeodesicSolver`; asked k times.
    k : int
        Number of vertices.
    start : int, sequence of int, or (n,) mask of bool, optional
        The first vertex: the first that a face uses, if not given. Several are all taken first, in ascending order.

    Returns
    -------
    (k,) int64
        Distinct vertices; the first j of them are the result for j. Every component of the domain gets one before any
        gets a second. No vertex is farther from the points than the last point is from the others.

    Raises
    ------
    SourceError
        If `start` does not name vertices.
    ValueError
        If `k` is no integer, fewer than the starting vertices, or more than the vertices that a face uses.

    Examples
    --------
    >>> import heat_igl
    >>> heat_igl.farthest_points(heat_igl.shapes.grid(10), 4).tolist()  # the corners of the square
    [0, 120, 10, 110]
    """
    return farthest_cells(solver, k, start=start).sites


@names_guessed
def farthest_cells(solver: Solver | MeshLike, k: int, *, start: ArrayLike | None = None) -> VoronoiCells:
    """The Voronoi cells of `farthest_points`, for the same queries; arguments and errors as there.

    Examples
    --------
    >>> import heat_igl
    >>> cells = heat_igl.farthest_cells(heat_igl.shapes.grid(10), 4)  # of the corners of the unit square
    >>> round(float(cells.distance.max()), 6)  # the middle, sqrt(1/2) from each
    0.707107
    """
    solver = as_solver(solver)
    used = solver.referenced.copy()
    start = int(used.argmax()) if start is None else start
    first = vertex_sources(cast(Any, start), solver.n_vertices, "start")
    used[first] = True
    least, most = len(first), int(used.sum())
    if not isinstance(k, int | np.integer) or isinstance(k, bool) or not least <= k <= most:
        raise ValueError(
            f"k must be an integer from {least}, the vertices to start from, to {most}, all there are, not {shown(k)}"
        )
    sites = np.empty(k, np.int64)
    labels = np.full(solver.n_vertices, -1)
    distance = np.full(solver.n_vertices, np.inf)
    # Vertices that no face uses are infinitely far from all others, but are not to be sampled.
    open_to_choice = np.where(used, np.inf, -np.inf)
    left = TimeLeft("points are found", k)
    for i in range(k):
        sites[i] = first[i] if i < len(first) else np.argmax(np.minimum(distance, open_to_choice))
        open_to_choice[sites[i]] = -np.inf
        # No vertex is farther from the sites so far than the one chosen, so no vertex beyond that is nearer to it.
        reach = np.inf if i < len(first) else distance[sites[i]]
        if reach > 0:
            site = int(sites[i])
            if isinstance(solver, GeodesicSolver):
                found = solver._nearer(site, distance)
            else:
                found = solver.distance(site, cutoff=float(reach))
            claim_nearer(distance, labels, i, found)
        else:
            labels[sites[i]] = i
        left()
    return VoronoiCells(sites, labels, distance)


@names_guessed
def diameter(solver: Solver | MeshLike, *, start: int | None = None, rounds: int = 10) -> tuple[float, int, int]:
    """Two vertices that are far apart, found by repeatedly moving to the farthest vertex.

    Parameters
    ----------
    solver : GeodesicSolver, HeatMethodSolver or mesh
        Of any domain, or whatever `as_mesh` takes, for its `GeodesicSolver`.
    start : int, optional
        Vertex whose component is measured: the first that a face uses, if not given.
    rounds : int
        Largest number of queries; three or four mostly suffice.

    Returns
    -------
    distance : float
        Their distance: at most the diameter over all vertices as the solver measures it, at least half of it, and
        mostly within a few percent of it.
    first, second : int
        The two vertices.

    Raises
    ------
    SourceError
        If `start` is no vertex.
    ValueError
        If `rounds` is not a positive integer.

    Examples
    --------
    >>> import heat_igl
    >>> distance, first, second = heat_igl.diameter(heat_igl.shapes.strip(12, 5))
    >>> round(distance, 6)  # the diagonal
    13.0
    """
    solver = as_solver(solver)
    if not isinstance(rounds, int | np.integer) or rounds < 1:
        raise ValueError(f"rounds must be a positive integer, not {rounds!r}")
    start = int(solver.referenced.argmax()) if start is None else start
    here = int(distinct_vertices(start, solver.n_vertices, "start")[0])
    best = (-1.0, here, here)
    left = TimeLeft("queries at most are done", rounds)
    for _ in range(rounds):
        distance = solver.distance(here)
        left()
        there = int(np.argmax(np.where(np.isfinite(distance), distance, -1.0)))
        if distance[there] <= best[0]:
            break
        best = (float(distance[there]), here, there)
        here = there
    return best


def distance_matrix(solver: Solver | MeshLike, indices: ArrayLike | None = None) -> FloatArray:
    """Distances between all pairs of vertices, or of some.

    Parameters
    ----------
    solver : GeodesicSolver, HeatMethodSolver or mesh
        Of any domain, or whatever `as_mesh` takes, for its `GeodesicSolver` with n vertices; asked k times.
    indices : (k,) array_like of int, or (n,) mask of bool, optional
        Distinct vertices; all n if not given, which takes 8 n^2 bytes.

    Returns
    -------
    (k, k) float64
        Symmetric: the mean of both directions, which differ by the solver's error. 0 on the diagonal, ``inf`` between
        components.

    Raises
    ------
    SourceError
        If an entry of `indices` is no vertex, or comes twice.

    Examples
    --------
    >>> import heat_igl
    >>> heat_igl.distance_matrix(heat_igl.shapes.strip(4, 3), [0, 4, 19]).round(6).tolist()  # corners, 3 by 4
    [[0.0, 4.0, 5.0], [4.0, 0.0, 3.0], [5.0, 3.0, 0.0]]
    """
    solver = as_solver(solver)
    chosen = (
        np.arange(solver.n_vertices) if indices is None else distinct_vertices(indices, solver.n_vertices, "indices")
    )
    matrix = np.empty((len(chosen), len(chosen)))
    for i, row in enumerate(distance_rows(solver, chosen)):
        matrix[i] = row[chosen]
    return np.asarray((matrix + matrix.T) / 2)


def dual_triangulation(mesh: MeshLike, cells: VoronoiCells) -> Mesh:
    """The triangulation dual to Voronoi cells: a vertex for each cell, a triangle for each point of three cells.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    cells : VoronoiCells
        Voronoi cells of the same mesh.

    Returns
    -------
    Mesh
        A manifold mesh oriented like `mesh`, with the positions of ``cells.sites`` in that order. The Euler
        characteristic is that of `mesh` if every cell is a disk, any two cells meet along at most one line, and any
        three in at most one point; holes and handles inside one cell are lost.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral or `cells` belong to another mesh. If the triangles do not form a manifold with a
        vertex for each cell: there are too few sites.

    Notes
    -----
    Replacing each vertex by the site of the cell maps every face of the mesh to a triangle, an edge or a vertex. The
    result has the triangles that an odd number of faces are mapped to. So a zigzag border between cells, or an island
    in a cell, changes nothing, and the boundary of the mesh is mapped to the boundary of the result.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.torus(48, 32)
    >>> coarse = heat_igl.sampling.dual_triangulation(mesh, heat_igl.farthest_cells(mesh, 60))
    >>> coarse.n_vertices, coarse.report().euler_characteristic
    (60, 0)
    """
    mesh = as_triangles(mesh, "a dual triangulation needs")
    if not isinstance(cells, VoronoiCells):
        raise MeshError(f"cells must be VoronoiCells, as farthest_cells returns them, not {shown(cells)}")
    if len(cells.labels) != mesh.n_vertices:
        raise MeshError(f"the cells have {len(cells.labels)} vertices and the mesh {mesh.n_vertices}: pass its own")
    k = len(cells.sites)
    met = cells.labels[mesh.F]
    a, b, c = met.T
    met = met[(a != b) & (b != c) & (c != a) & (met >= 0).all(axis=1)]
    # Rotating the smallest label to the front keeps the orientation; the other two labels then have two orders.
    met = np.take_along_axis(met, (met.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    turned = met[:, 1] > met[:, 2]
    first, of_face, covered = connectivity.unique_rows(np.sort(met, axis=1), k)
    balance = np.bincount(of_face, weights=np.where(turned, -1, 1), minlength=len(first))
    F = np.sort(met, axis=1)[first]
    F[balance < 0] = F[balance < 0][:, [0, 2, 1]]
    F = F[covered % 2 == 1]
    remedy = f"the cells of {k} sites do not meet like the triangles of a surface; sample more densely"
    if not len(F):
        raise MeshError(f"no three cells meet in a point: {remedy}")
    lonely = np.setdiff1d(np.arange(k), F)
    if len(lonely):
        raise MeshError(f"cell {lonely[0]} has no triangle ({len(lonely)} of {k} cells have none): {remedy}")
    found = connectivity.facets(F, k)
    crowded = found.vertices[found.n_faces > 2]
    if len(crowded):
        raise MeshError(
            f"the edge between cells {crowded[0][0]} and {crowded[0][1]} has more than two triangles "
            f"({len(crowded)} edges have): {remedy}"
        )
    pinched = connectivity.nonmanifold_vertices(F, found, k)
    if len(pinched):
        raise MeshError(f"the triangles at cell {pinched[0]} are not one fan ({len(pinched)} cells' are not): {remedy}")
    return Mesh(mesh.V[cells.sites], F)
