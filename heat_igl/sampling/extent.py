"""Diameter and distance matrix."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import names_guessed
from heat_igl.geodesic import Solver
from heat_igl.mesh import MeshLike
from heat_igl.runtime import TimeLeft
from heat_igl.sampling.queries import as_solver, checked_vertices, distance_rows
from heat_igl.typing import ArrayLike, FloatArray


@names_guessed
def diameter(solver: Solver | MeshLike, *, start: int = 0, rounds: int = 10) -> tuple[float, int, int]:
    """Two vertices that are far apart, found by repeatedly moving to the farthest vertex.

    Parameters
    ----------
    solver : GeodesicSolver, HeatMethodSolver or mesh
        Of any domain, or whatever `as_mesh` takes, for a near-exact solver.
    start : int
        Vertex whose component is measured.
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
    here = int(checked_vertices("start", start, solver.n_vertices)[0])
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
        Of any domain, or whatever `as_mesh` takes, for a near-exact solver with n vertices; asked k times.
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
        np.arange(solver.n_vertices) if indices is None else checked_vertices("indices", indices, solver.n_vertices)
    )
    matrix = np.empty((len(chosen), len(chosen)))
    for i, row in enumerate(distance_rows(solver, chosen)):
        matrix[i] = row[chosen]
    return np.asarray((matrix + matrix.T) / 2)
