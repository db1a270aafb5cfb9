"""Geodesic Voronoi cells of given vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.geodesic import GeodesicSolver, Solver
from heat_igl.mesh import MeshLike
from heat_igl.sampling.queries import as_solver, checked_vertices, distance_rows
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray


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
    """The geodesic Voronoi diagram of given vertices: of a `GeodesicSolver` in one query, of others one for each site.

    Parameters
    ----------
    solver : GeodesicSolver, HeatMethodSolver or mesh
        Of any domain, or whatever `as_mesh` takes, for a near-exact solver.
    sites : (k,) array_like of int
        Distinct vertices.

    Returns
    -------
    VoronoiCells
        With the sites in the given order. A site always belongs to the cell of the site itself.

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
    chosen = checked_vertices("sites", sites, solver.n_vertices)
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
