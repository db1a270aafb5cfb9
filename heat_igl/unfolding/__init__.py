"""Near-exact distance by planar unfolding, in an order of the vertices that heat or Dijkstra's algorithm gives."""

from heat_igl.unfolding.exact import ExactSolution, ExactSurface, Origin, exact_distance
from heat_igl.unfolding.refinement import Known, Refine, Refinement, unfolded_distance
from heat_igl.unfolding.solver import UnfoldingSolver

__all__ = [
    "ExactSolution",
    "ExactSurface",
    "Known",
    "Origin",
    "Refine",
    "Refinement",
    "UnfoldingSolver",
    "exact_distance",
    "unfolded_distance",
]
