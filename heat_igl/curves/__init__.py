"""Curves from a distance: isolines and the areas that they enclose, shortest paths."""

from heat_igl.curves.bezier import geodesic_bezier
from heat_igl.curves.cut_mesh import CutMesh, MeshPiece
from heat_igl.curves.cutting import cut
from heat_igl.curves.drawn_curves import curve_through, signed_distance
from heat_igl.curves.geodesics import GeodesicPathSolver, geodesic_path, straighten
from heat_igl.curves.handles import handle_loops
from heat_igl.curves.level_sets import enclosed_areas, isolines, offset_curves, sublevel_areas
from heat_igl.curves.local_log_maps import LogMapsWithin, log_maps_within
from heat_igl.curves.log_map import log_map
from heat_igl.curves.means import karcher_mean
from heat_igl.curves.paths import shortest_path, shortest_paths
from heat_igl.curves.relaxation import CentroidalSites, centroidal_voronoi
from heat_igl.curves.straightest import exp_map, trace_geodesic

__all__ = [
    "LogMapsWithin",
    "CentroidalSites",
    "CutMesh",
    "GeodesicPathSolver",
    "MeshPiece",
    "centroidal_voronoi",
    "curve_through",
    "cut",
    "enclosed_areas",
    "exp_map",
    "geodesic_bezier",
    "geodesic_path",
    "handle_loops",
    "isolines",
    "karcher_mean",
    "log_map",
    "log_maps_within",
    "offset_curves",
    "shortest_path",
    "shortest_paths",
    "signed_distance",
    "straighten",
    "sublevel_areas",
    "trace_geodesic",
]
