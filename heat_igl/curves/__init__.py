"""Curves from a distance: isolines and the areas that they enclose, shortest paths."""

from heat_igl.curves.cutting import CutMesh, MeshPiece, cut
from heat_igl.curves.level_sets import enclosed_areas, isolines, offset_curves, sublevel_areas
from heat_igl.curves.log_map import log_map
from heat_igl.curves.paths import shortest_paths
from heat_igl.curves.straightest import exp_map, trace_geodesic

__all__ = [
    "CutMesh",
    "MeshPiece",
    "cut",
    "enclosed_areas",
    "exp_map",
    "isolines",
    "log_map",
    "offset_curves",
    "shortest_paths",
    "sublevel_areas",
    "trace_geodesic",
]
