"""Points spread over a domain, the cells around them, and what distances between them say.

Everything here asks a solver for distances from single vertices, so it works on every domain that has `Operators`, and
is as accurate as the solver.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from heat_igl.errors import MeshError, SourceError
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import Mesh, SurfacePoints, connectivity
from heat_igl.sources import vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

__all__ = [
    "VoronoiCells",
    "diameter",
    "distance_matrix",
    "dual_triangulation",
    "farthest_cells",
    "farthest_points",
    "geodesic_centre",
    "voronoi_cells",
]

# Rows of distances held at a time where only a part of each is kept.
_BLOCK = 8


@dataclass(frozen=True, eq=False)
class VoronoiCells:
    """The geodesic Voronoi diagram of some vertices: every vertex belongs to the nearest of them.

    Attributes
    ----------
    sites : (k,) int64
        The vertices that the cells belong to.
    labels : (n,) int64
        Position in `sites` of the nearest one, the earlier one of two that are equally near; -1 where none is reached.
    distance : (n,) float64
        Distance from the nearest site, ``inf`` where none is reached.
    """

    sites: IntArray
    labels: IntArray
    distance: FloatArray


def farthest_points(solver: HeatMethodSolver, k: int, *, start: ArrayLike = 0) -> IntArray:
    """`k` vertices, each as far as possible from those before it (Gonzalez 1985; Moenning and Dodgson 2003).

    Parameters
    ----------
    solver : HeatMethodSolver
        Of any domain; asked k - 1 times.
    k : int
        Number of vertices.
    start : int, sequence of int, or (n,) mask of bool
        The first vertex. Several come first all together, in ascending order.

    Returns
    -------
    (k,) int64
        Distinct vertices, of which the first j are the answer for j. Every component of the domain gets one before any
        gets a second. No vertex is farther from the points than the last point was from the others.

    Raises
    ------
    SourceError
        If `start` does not name vertices.
    ValueError
        If `k` is no integer, fewer than the starting vertices, or more than the vertices that a face uses.
    """
    return farthest_cells(solver, k, start=start).sites


def farthest_cells(solver: HeatMethodSolver, k: int, *, start: ArrayLike = 0) -> VoronoiCells:
    """The Voronoi cells of `farthest_points`, which cost one query more; arguments and errors as there."""
    first = vertex_sources(np.asarray(start), solver.n_vertices)
    referenced = solver.operators.referenced
    used = referenced.copy()
    used[first] = True
    _check_count(k, len(first), int(used.sum()))
    sites = np.empty(k, np.int64)
    labels = np.full(solver.n_vertices, -1)
    distance = np.full(solver.n_vertices, np.inf)
    # Free vertices that no face uses are at infinity from everything, but no place to sample.
    open_to_choice = np.where(used, np.inf, -np.inf)
    for i in range(k):
        sites[i] = first[i] if i < len(first) else np.argmax(np.minimum(distance, open_to_choice))
        open_to_choice[sites[i]] = -np.inf
        _update(distance, labels, i, solver.distance(int(sites[i])))
    return VoronoiCells(sites, labels, distance)


def _check_count(k: int, least: int, most: int) -> None:
    if not isinstance(k, int | np.integer) or isinstance(k, bool) or not least <= k <= most:
        raise ValueError(
            f"k must be an integer from {least}, the vertices to start from, to {most}, all there are, not {k!r}"
        )


def _update(distance: FloatArray, labels: IntArray, label: int, candidate: AnyArray) -> None:
    """Give the vertices that are nearer by `candidate` than by `distance` to `label`."""
    nearer = candidate < distance
    labels[nearer] = label
    np.minimum(distance, candidate, out=distance)


def voronoi_cells(solver: HeatMethodSolver, sites: ArrayLike) -> VoronoiCells:
    """The geodesic Voronoi diagram of given vertices, by one query for each.

    Parameters
    ----------
    solver : HeatMethodSolver
        Of any domain.
    sites : (k,) array_like of int
        Distinct vertices.

    Returns
    -------
    VoronoiCells
        With the sites in the given order. A site always belongs to its own cell.

    Raises
    ------
    SourceError
        If an entry of `sites` is no vertex, or is there twice.
    """
    chosen = _vertices("sites", sites, solver.n_vertices)
    labels = np.full(solver.n_vertices, -1)
    distance = np.full(solver.n_vertices, np.inf)
    for i, row in enumerate(_rows(solver, chosen)):
        _update(distance, labels, i, row)
    return VoronoiCells(chosen, labels, distance)


def _vertices(name: str, vertices: ArrayLike, n: int, distinct: bool = True) -> IntArray:
    """`vertices` in the given order, checked like sources."""
    array: AnyArray = np.atleast_1d(np.asarray(vertices))
    if array.dtype.kind == "b":
        return vertex_sources(array, n)
    try:
        sorted_once = vertex_sources(array, n)
    except SourceError as error:
        raise SourceError(f"{name}: {error}") from None
    if distinct and len(sorted_once) < len(array):
        values, counts = np.unique(array, return_counts=True)
        raise SourceError(f"{name} must be distinct, but vertex {values[counts > 1][0]} is there twice")
    return array.astype(np.int64)


def _rows(solver: HeatMethodSolver, vertices: IntArray) -> Iterator[AnyArray]:
    """Distances (n,) from each of `vertices`, solved in blocks."""
    for start in range(0, len(vertices), _BLOCK):
        yield from solver.distances([[int(v)] for v in vertices[start : start + _BLOCK]])


def dual_triangulation(mesh: Mesh, cells: VoronoiCells) -> Mesh:
    """The triangulation dual to Voronoi cells: a vertex for each cell, a triangle where three cells meet.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    cells : VoronoiCells
        Of the same mesh.

    Returns
    -------
    Mesh
        With the positions of ``cells.sites``, in that order. It is manifold, and oriented like `mesh`. Where the cells
        are disks that meet two along one line and three in one point, it has the Euler characteristic of `mesh`; holes
        and handles inside one cell are lost.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral or `cells` belong to another one, or if the triangles do not form a manifold with a
        vertex for each cell: the sites are too few.

    Notes
    -----
    Sending each vertex to its site maps the faces of the mesh to triangles, edges and vertices; this returns the
    triangles that are covered an odd number of times. So a cell border that runs zigzag, or an island in a cell,
    changes nothing, and the boundary of the mesh is mapped to the boundary of the result.
    """
    if mesh.is_tetrahedral:
        raise MeshError("a dual triangulation needs triangles, but F has 4 columns")
    if len(cells.labels) != mesh.n_vertices:
        raise MeshError(f"the cells have {len(cells.labels)} vertices and the mesh {mesh.n_vertices}: pass its own")
    k = len(cells.sites)
    met = cells.labels[mesh.F]
    a, b, c = met.T
    met = met[(a != b) & (b != c) & (c != a) & (met >= 0).all(axis=1)]
    # The smallest label to the front keeps the orientation; then there are two orders left.
    met = np.take_along_axis(met, (met.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    turned = met[:, 1] > met[:, 2]
    first, of_face, covered = connectivity.unique_rows(np.sort(met, axis=1), k)
    balance = np.bincount(of_face, weights=np.where(turned, -1, 1), minlength=len(first))
    F = np.sort(met, axis=1)[first]
    F[balance < 0] = F[balance < 0][:, [0, 2, 1]]
    F = F[covered % 2 == 1]
    _check_dual(F, k)
    return Mesh(mesh.V[cells.sites], F)


def _check_dual(F: IntArray, k: int) -> None:
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


def geodesic_centre(
    mesh: Mesh, solver: HeatMethodSolver, points: ArrayLike, weights: ArrayLike | None = None
) -> SurfacePoints:
    """The point with the least sum of squared distances to `points`: their Frechet mean (a Karcher mean).

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    solver : HeatMethodSolver
        Of the same mesh.
    points : (k,) array_like of int, or (n,) mask of bool
        Vertices; one that is there twice counts twice.
    weights : (k,) array_like, optional
        Positive weight of each; 1 when not given. For the centre of a whole surface, take points spread over it and the
        areas of their cells.

    Returns
    -------
    SurfacePoints
        One point, in a face. Where several are equally good, the first face's.

    Raises
    ------
    SourceError
        If `points` does not name vertices, or no place on the mesh is reached from all of them.
    MeshError
        If the mesh is tetrahedral or not the solver's.
    ValueError
        If `weights` are not positive numbers, one for each point.

    Notes
    -----
    In the plane the sum f of w |x - p|^2 has the Hessian 2 W, W the sum of the weights. So on each face it is the
    linear interpolation of its values at the corners less W times the sum of x_i x_j l_ij^2 over the face's edges
    (Stewart's theorem, x barycentric). The least value of that is found on every face in closed form: exact on flat
    surfaces; elsewhere only the curvature inside one face is neglected.
    """
    if mesh.is_tetrahedral:
        raise MeshError("a point in a face needs triangles, but F has 4 columns")
    if mesh.n_vertices != solver.n_vertices:
        raise MeshError(f"the mesh has {mesh.n_vertices} vertices and the solver's {solver.n_vertices}: pass its own")
    chosen = _vertices("points", points, solver.n_vertices, distinct=False)
    weight = _weights(weights, len(chosen))
    squares = np.zeros(mesh.n_vertices)
    for w, row in zip(weight, _rows(solver, chosen), strict=True):
        squares += w * row**2
    corners = squares[mesh.F]
    reached = np.isfinite(corners).all(axis=1)
    if not reached.any():
        raise SourceError("points lie in different components: no place is reached from all of them")
    x, value = _least_in_faces(mesh.V[mesh.F[reached]], corners[reached], float(weight.sum()))
    best = int(np.argmin(value))
    return SurfacePoints(np.flatnonzero(reached)[[best]], x[[best]])


def _weights(weights: ArrayLike | None, k: int) -> FloatArray:
    if weights is None:
        return np.ones(k)
    array = np.asarray(weights, dtype=np.float64)
    if array.shape != (k,) or not (np.isfinite(array) & (array > 0)).all():
        raise ValueError(f"weights must be {k} positive numbers, one for each point")
    return array


def _least_in_faces(corner: FloatArray, value: FloatArray, weight: float) -> tuple[FloatArray, FloatArray]:
    """Where f is least on each triangle, barycentric (m, 3), and f there, (m,); see `geodesic_centre`.

    Parameters
    ----------
    corner : (m, 3, 3) float64
        Positions of the corners.
    value : (m, 3) float64
        f at the corners.
    weight : float
        W.
    """
    squared = np.stack(
        [((corner[:, (i + 1) % 3] - corner[:, (i + 2) % 3]) ** 2).sum(axis=1) for i in range(3)], axis=1
    )  # opposite each corner

    def f(x: FloatArray) -> FloatArray:
        products = np.stack([x[:, (i + 1) % 3] * x[:, (i + 2) % 3] for i in range(3)], axis=1)
        return np.asarray((x * value).sum(axis=1) - weight * (products * squared).sum(axis=1))

    candidates = [*_least_on_edges(value, squared, weight), _least_inside(corner, value, weight)]
    values = np.stack([f(x) for x in candidates])
    best = values.argmin(axis=0)
    each = np.arange(len(best))
    return np.stack(candidates)[best, each], values[best, each]


def _least_on_edges(value: FloatArray, squared: FloatArray, weight: float) -> Iterator[FloatArray]:
    """The least value on each of the three edges, corners included."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        # Along the edge f is a parabola with the second derivative 2 W l^2.
        with np.errstate(divide="ignore", invalid="ignore"):
            s = 0.5 + (value[:, j] - value[:, k]) / (2 * weight * squared[:, i])
        x = np.zeros_like(value)
        x[:, k] = np.clip(np.nan_to_num(s, nan=0.0), 0, 1)
        x[:, j] = 1 - x[:, k]
        yield x


def _least_inside(corner: FloatArray, value: FloatArray, weight: float) -> FloatArray:
    """The least value in the plane of each triangle where that lies inside, and the first corner where not."""
    e, g = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    ee, eg, gg = (e * e).sum(axis=1), (e * g).sum(axis=1), (g * g).sum(axis=1)
    # grad f = 0 at corner 0 plus s e + r g, where f = f0 + b . (s, r) + W |s e + r g|^2.
    b1 = (value[:, 1] - value[:, 0]) / weight - ee
    b2 = (value[:, 2] - value[:, 0]) / weight - gg
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = ee * gg - eg * eg
        s = (eg * b2 - gg * b1) / (2 * determinant)
        r = (eg * b1 - ee * b2) / (2 * determinant)
    x = np.stack([1 - s - r, s, r], axis=1)
    inside = np.isfinite(x).all(axis=1) & (x >= 0).all(axis=1)
    x[~inside] = [1.0, 0.0, 0.0]
    return x


def diameter(solver: HeatMethodSolver, *, start: int = 0, rounds: int = 10) -> tuple[float, int, int]:
    """Two vertices that lie far apart, by going to the farthest vertex again and again.

    Parameters
    ----------
    solver : HeatMethodSolver
        Of any domain.
    start : int
        Vertex whose component is measured.
    rounds : int
        Queries at most; mostly three or four find nothing farther any more.

    Returns
    -------
    distance : float
        Their distance. Never more than the diameter over all vertices as the solver measures it, and never less than
        half of that; mostly within some percent.
    first, second : int
        The two vertices.

    Raises
    ------
    SourceError
        If `start` is no vertex.
    ValueError
        If `rounds` is not a positive integer.
    """
    if not isinstance(rounds, int | np.integer) or rounds < 1:
        raise ValueError(f"rounds must be a positive integer, not {rounds!r}")
    here = int(_vertices("start", start, solver.n_vertices)[0])
    best = (-1.0, here, here)
    for _ in range(rounds):
        distance = solver.distance(here)
        there = int(np.argmax(np.where(np.isfinite(distance), distance, -1.0)))
        if distance[there] <= best[0]:
            break
        best = (float(distance[there]), here, there)
        here = there
    return best


def distance_matrix(solver: HeatMethodSolver, indices: ArrayLike | None = None) -> FloatArray:
    """Distances between all pairs of vertices, or of some.

    Parameters
    ----------
    solver : HeatMethodSolver
        Of any domain with n vertices; asked k times.
    indices : (k,) array_like of int, or (n,) mask of bool, optional
        Distinct vertices; all n of them when not given, which takes 8 n^2 bytes.

    Returns
    -------
    (k, k) float64
        Symmetric: the mean of both directions, which differ by the solver's error. 0 on the diagonal, ``inf`` between
        components.

    Raises
    ------
    SourceError
        If an entry of `indices` is no vertex, or is there twice.
    """
    chosen = np.arange(solver.n_vertices) if indices is None else _vertices("indices", indices, solver.n_vertices)
    matrix = np.empty((len(chosen), len(chosen)))
    for i, row in enumerate(_rows(solver, chosen)):
        matrix[i] = row[chosen]
    return np.asarray((matrix + matrix.T) / 2)
