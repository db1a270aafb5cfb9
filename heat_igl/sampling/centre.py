"""The geodesic centre of weighted vertices."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from heat_igl.errors import MeshError, SourceError, real_numbers
from heat_igl.geodesic import Solver
from heat_igl.mesh import MeshLike, SurfacePoints, as_simplices
from heat_igl.sampling.queries import as_solver, checked_vertices, distance_rows
from heat_igl.typing import ArrayLike, FloatArray

__all__ = ["geodesic_centre"]


def geodesic_centre(
    mesh: MeshLike,
    solver: Solver | MeshLike,
    points: ArrayLike,
    weights: ArrayLike | None = None,
) -> SurfacePoints:
    """The point with the least sum of squared distances to `points`: their Frechet mean (a Karcher mean).

    Parameters
    ----------
    mesh : mesh
        Triangles.
    solver : GeodesicSolver, HeatMethodSolver or mesh
        Of the same mesh, or that mesh, for a near-exact solver.
    points : (k,) array_like of int, or (n,) mask of bool
        Vertices; one that comes twice counts twice.
    weights : (k,) array_like, optional
        Positive weight of each; 1 if not given. For the centre of a whole surface, take points spread over the surface
        and the areas of their Voronoi cells.

    Returns
    -------
    SurfacePoints
        One point, in a face; of several equally good points, the one in the first face.

    Raises
    ------
    SourceError
        If `points` does not name vertices, or lie in different components.
    MeshError
        If the mesh is tetrahedral, or the solver belongs to another mesh.
    ValueError
        If `weights` are not positive numbers, one for each point.

    Notes
    -----
    In the plane, the sum f of w |x - p|^2 has the Hessian 2 W, with W the sum of the weights. So on each face, f is the
    linear interpolation of the values at the corners, minus W times the sum of x_i x_j l_ij^2 over the edges (Stewart's
    theorem, x barycentric). The minimum of this is found on every face in closed form. The result is exact on flat
    surfaces; on others, curvature inside one face is neglected.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> centre = heat_igl.sampling.geodesic_centre(mesh, mesh, [0, 8, 72, 80])  # of the corners of the unit square
    >>> centre.positions(mesh).round(6).tolist()
    [[0.5, 0.5, 0.0]]
    """
    solver = as_solver(solver)
    mesh = as_simplices(mesh)
    if mesh.is_tetrahedral:
        raise MeshError("a point in a face needs triangles, but F has 4 columns")
    if mesh.n_vertices != solver.n_vertices:
        raise MeshError(f"the mesh has {mesh.n_vertices} vertices and the solver's {solver.n_vertices}: pass its own")
    chosen = checked_vertices("points", points, solver.n_vertices, distinct=False)
    weight = _weights(weights, len(chosen))
    squares = np.zeros(mesh.n_vertices)
    for w, row in zip(weight, distance_rows(solver, chosen), strict=True):
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
    array = real_numbers("weights", weights)
    if array.shape != (k,) or not (np.isfinite(array) & (array > 0)).all():
        raise ValueError(f"weights must be {k} positive numbers, one for each point")
    return array


def _least_in_faces(corner: FloatArray, value: FloatArray, weight: float) -> tuple[FloatArray, FloatArray]:
    """Minimum of f on each triangle: barycentric coordinates (m, 3) and value (m,); see `geodesic_centre`.

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
    """Barycentric coordinates (m, 3) of the minimum on each of the three edges, corners included."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        # Along the edge, f is a parabola with the second derivative 2 W l^2.
        with np.errstate(divide="ignore", invalid="ignore"):
            s = 0.5 + (value[:, j] - value[:, k]) / (2 * weight * squared[:, i])
        x = np.zeros_like(value)
        x[:, k] = np.clip(np.nan_to_num(s, nan=0.0), 0, 1)
        x[:, j] = 1 - x[:, k]
        yield x


def _least_inside(corner: FloatArray, value: FloatArray, weight: float) -> FloatArray:
    """The minimum in the plane of each triangle, barycentric (m, 3); the first corner if it lies outside."""
    e, g = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    ee, eg, gg = (e * e).sum(axis=1), (e * g).sum(axis=1), (g * g).sum(axis=1)
    # grad f = 0 at corner 0 plus s e + r g, with f = f0 + b . (s, r) + W |s e + r g|^2.
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
