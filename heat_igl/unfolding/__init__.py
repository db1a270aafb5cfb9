"""Distance along simplices: windows, sweeps, straight lines in bodies, the Hopf-Lax formula."""

from heat_igl.unfolding.directions import PathAngles, PathDirections, WindowWays, in_circle
from heat_igl.unfolding.engine import Engine, MeshTriangles, OperatorTriangles, Triangles
from heat_igl.unfolding.exact import ExactSolution, ExactSurface, Origin, exact_distance
from heat_igl.unfolding.exact_paths import ExactPaths, exact_paths
from heat_igl.unfolding.from_vertex import vectors_from
from heat_igl.unfolding.guarded import GuardedEngine, contradicted, guarded_windows
from heat_igl.unfolding.hopf_lax import HopfLaxEngine
from heat_igl.unfolding.invariants import Invariants
from heat_igl.unfolding.lines import LineEngine
from heat_igl.unfolding.local import blocks_within, distances_within, nearest_vertices, pair_distances
from heat_igl.unfolding.path_derivatives import Change
from heat_igl.unfolding.path_lengths import PathLengths, SideChange, from_windows
from heat_igl.unfolding.sweep import SweepEngine
from heat_igl.unfolding.window_engine import WindowEngine
from heat_igl.unfolding.within_store import read_distances_within, write_distances_within

__all__ = [
    "Change",
    "Engine",
    "ExactPaths",
    "ExactSolution",
    "ExactSurface",
    "GuardedEngine",
    "HopfLaxEngine",
    "Invariants",
    "LineEngine",
    "MeshTriangles",
    "OperatorTriangles",
    "Origin",
    "PathAngles",
    "PathDirections",
    "PathLengths",
    "SideChange",
    "SweepEngine",
    "Triangles",
    "WindowEngine",
    "WindowWays",
    "blocks_within",
    "contradicted",
    "distances_within",
    "exact_distance",
    "exact_paths",
    "from_windows",
    "guarded_windows",
    "in_circle",
    "nearest_vertices",
    "pair_distances",
    "read_distances_within",
    "vectors_from",
    "write_distances_within",
]
