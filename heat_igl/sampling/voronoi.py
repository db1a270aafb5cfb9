"""Geodesic Voronoi cells of given vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.heat_method import HeatMethodSolver
from heat_igl.sampling.queries import checked_vertices, distance_rows
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

__all__ = ["VoronoiCells", "claim_nearer", "voronoi_cells"]


@dataclass(frozen=True, eq=False)
class VoronoiCells:
    """The geodesic Voronoi diagram of some vertices, the sites: every vertex belongs to the nearest site.

    Attributes
    ----------
    sites : (k,) int64
        The site of each cell.
    labels : (n,) int64
        Position in `sites` of the nearest site, the earlier of two equally near ones; -1 at vertices that no site
        reaches.
    distance : (n,) float64
        Distance from the nearest site, ``inf`` at vertices that no site reaches.
    """

    sites: IntArray
    labels: IntArray
    distance: FloatArray


def voronoi_cells(solver: HeatMethodSolver, sites: ArrayLike) -> VoronoiCells:
    """The geodesic Voronoi diagram of given vertices, by one query for each site.

    Parameters
    ----------
    solver : HeatMethodSolver
        Of any domain.
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
    """
    chosen = checked_vertices("sites", sites, solver.n_vertices)
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
