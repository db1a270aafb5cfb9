"""Farthest-point sampling."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from heat_igl.errors import names_guessed, shown
from heat_igl.geodesic import GeodesicSolver, Solver
from heat_igl.mesh import MeshLike
from heat_igl.runtime import TimeLeft
from heat_igl.sampling.queries import as_solver
from heat_igl.sampling.voronoi import VoronoiCells, claim_nearer
from heat_igl.sources import vertex_sources
from heat_igl.typing import ArrayLike, IntArray


@names_guessed
def farthest_points(solver: Solver | MeshLike, k: int, *, start: ArrayLike = 0) -> IntArray:
    """`k` vertices, each as far as possible from those before (Gonzalez 1985; Moenning and Dodgson 2003).

    Parameters
    ----------
    solver : GeodesicSolver, HeatMethodSolver or mesh
        Of any domain, or whatever `as_mesh` takes, for a near-exact solver; asked k times.
    k : int
        Number of vertices.
    start : int, sequence of int, or (n,) mask of bool
        The first vertex; several are all taken first, in ascending order.

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
def farthest_cells(solver: Solver | MeshLike, k: int, *, start: ArrayLike = 0) -> VoronoiCells:
    """The Voronoi cells of `farthest_points`, for the same queries; arguments and errors as there.

    Examples
    --------
    >>> import heat_igl
    >>> cells = heat_igl.farthest_cells(heat_igl.shapes.grid(10), 4)  # of the corners of the unit square
    >>> round(float(cells.distance.max()), 6)  # the middle, sqrt(1/2) from each
    0.707107
    """
    solver = as_solver(solver)
    first = vertex_sources(cast(Any, start), solver.n_vertices, "start")
    referenced = solver.referenced
    used = referenced.copy()
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
