"""Near-exact distance by planar unfolding, in an order of the vertices that heat or Dijkstra's algorithm gives."""

from heat_igl.unfolding.curved_fronts import CurvedFronts, Front
from heat_igl.unfolding.directions import PathAngles, PathDirections, WindowWays, in_circle
from heat_igl.unfolding.distance import (
    directed_from_scratch,
    distance_from_scratch,
    distance_to_targets,
    unfolded_distance,
)
from heat_igl.unfolding.exact import ExactSolution, ExactSurface, Origin, exact_distance
from heat_igl.unfolding.exact_paths import ExactPaths, exact_paths
from heat_igl.unfolding.from_vertex import vectors_from
from heat_igl.unfolding.fronts import FrontSolver
from heat_igl.unfolding.local import blocks_within, distances_within, nearest_vertices, pair_distances
from heat_igl.unfolding.ordered import OrderedSolver
from heat_igl.unfolding.path_derivatives import Change
from heat_igl.unfolding.path_lengths import PathLengths, SideChange, from_lines
from heat_igl.unfolding.refinement import Known, Refine, Refinement
from heat_igl.unfolding.solver import UnfoldingSolver
from heat_igl.unfolding.within_store import read_distances_within, write_distances_within

__all__ = [
    "CurvedFronts",
    "ExactPaths",
    "Change",
    "ExactSolution",
    "ExactSurface",
    "Front",
    "FrontSolver",
    "Known",
    "OrderedSolver",
    "Origin",
    "PathAngles",
    "PathDirections",
    "PathLengths",
    "Refine",
    "Refinement",
    "SideChange",
    "UnfoldingSolver",
    "WindowWays",
    "blocks_within",
    "directed_from_scratch",
    "distance_from_scratch",
    "distance_to_targets",
    "distances_within",
    "exact_distance",
    "exact_paths",
    "from_lines",
    "in_circle",
    "nearest_vertices",
    "pair_distances",
    "read_distances_within",
    "unfolded_distance",
    "vectors_from",
    "write_distances_within",
]
