"""Distance along simplices: windows, exact or to a tolerance, and sweeps and fronts in an order of their own."""

from heat_igl.unfolding.directions import PathAngles, PathDirections, WindowWays, in_circle
from heat_igl.unfolding.engine import Engine, MeshTriangles, OperatorTriangles, Triangles
from heat_igl.unfolding.exact import ExactSolution, ExactSurface, Origin, exact_distance
from heat_igl.unfolding.exact_paths import ExactPaths, exact_paths
from heat_igl.unfolding.from_vertex import vectors_from
from heat_igl.unfolding.fronts import FrontSolver
from heat_igl.unfolding.guarded import GuardedEngine, contradicted, guarded_windows
from heat_igl.unfolding.invariants import Invariants
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
    "FrontSolver",
    "GuardedEngine",
    "Invariants",
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
