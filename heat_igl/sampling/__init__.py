"""Sampling: farthest points, geodesic Voronoi cells and their dual, the centre, the diameter and distance matrices.

All functions ask a solver for distances from single vertices, so they work on every domain that has `Operators`, and
are as accurate as the solver.

Examples
--------
>>> import heat_igl
>>> heat_igl.sampling.farthest_points(heat_igl.shapes.strip(6, 1), 2).tolist()
[0, 13]
"""

from heat_igl.sampling.centre import geodesic_centre
from heat_igl.sampling.dual import dual_triangulation
from heat_igl.sampling.extent import diameter, distance_matrix
from heat_igl.sampling.farthest import farthest_cells, farthest_points
from heat_igl.sampling.queries import as_solver
from heat_igl.sampling.voronoi import VoronoiCells, voronoi_cells

__all__ = [
    "VoronoiCells",
    "as_solver",
    "diameter",
    "distance_matrix",
    "dual_triangulation",
    "farthest_cells",
    "farthest_points",
    "geodesic_centre",
    "voronoi_cells",
]
