"""`HeatMethodSolver`: the steps put together, factored once, asked many times."""

from heat_igl.heat_method.checking import AnswerCheck, Comparison
from heat_igl.heat_method.directions import Directions
from heat_igl.heat_method.options import Backend, Boundary, Laplacian, Magnitude, SolverOptions
from heat_igl.heat_method.signed_heat import Level, SignedHeatSolver
from heat_igl.heat_method.signed_volumes import VoxelBox, volume_signed_distance
from heat_igl.heat_method.solution import Diagnostics, HeatSolution, LabelledDistance
from heat_igl.heat_method.solver import HeatMethodSolver
from heat_igl.heat_method.vector_heat import VectorHeatSolver, VectorMethod

__all__ = [
    "AnswerCheck",
    "Comparison",
    "Backend",
    "Boundary",
    "Diagnostics",
    "Directions",
    "HeatMethodSolver",
    "HeatSolution",
    "LabelledDistance",
    "Laplacian",
    "Level",
    "Magnitude",
    "SignedHeatSolver",
    "SolverOptions",
    "VectorHeatSolver",
    "VectorMethod",
    "VoxelBox",
    "volume_signed_distance",
]
