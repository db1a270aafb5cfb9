"""The three steps of the heat method, each to be tried alone: diffuse, normalize, integrate.

Algorithm 1 of the paper, on any domain that has `Operators`. The two steps that solve a system also exist as a class
that factors once, `HeatFlow` and `PoissonProblem`. Fields are arrays (n,) over vertices, or (n, k) for k right-hand
sides at once; vector fields are stacked by coordinate like the rows of G: (d m,) or (d m, k).
"""

from heat_igl.steps.diffusion import Boundary, HeatFlow, check_boundary, diffuse, mass_unit
from heat_igl.steps.fitted import fitted_laplacian
from heat_igl.steps.flow_derivative import FlowDerivative, MatrixSlopes
from heat_igl.steps.integration import PoissonProblem, integrate
from heat_igl.steps.normalization import NormalizedDivergence, damping, normalize
from heat_igl.steps.pattern import analysis
from heat_igl.steps.smallest_time_step import smallest_time_step, smallest_time_steps
from heat_igl.steps.vector_diffusion import VectorHeatFlow

__all__ = [
    "Boundary",
    "FlowDerivative",
    "HeatFlow",
    "MatrixSlopes",
    "NormalizedDivergence",
    "PoissonProblem",
    "VectorHeatFlow",
    "analysis",
    "check_boundary",
    "damping",
    "diffuse",
    "fitted_laplacian",
    "integrate",
    "mass_unit",
    "normalize",
    "smallest_time_step",
    "smallest_time_steps",
]
