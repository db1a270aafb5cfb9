"""`HeatMethodSolver`: the steps put together, factored once, asked many times."""

from heat_igl.heat_method.solution import Diagnostics, HeatSolution, LabelledDistance
from heat_igl.heat_method.solver import HeatMethodSolver, Magnitude, heat_method_distance, smallest_time_step

__all__ = [
    "Diagnostics",
    "HeatMethodSolver",
    "HeatSolution",
    "LabelledDistance",
    "Magnitude",
    "heat_method_distance",
    "smallest_time_step",
]
