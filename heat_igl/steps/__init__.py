"""The three steps of the heat method, each to be tried alone: diffuse, normalize, integrate."""

from heat_igl.steps.fitted import fitted_laplacian
from heat_igl.steps.three_steps import (
    Boundary,
    Descent,
    HeatFlow,
    PoissonProblem,
    analysis,
    damping,
    diffuse,
    integrate,
    normalize,
)

__all__ = [
    "Boundary",
    "Descent",
    "HeatFlow",
    "PoissonProblem",
    "analysis",
    "damping",
    "diffuse",
    "fitted_laplacian",
    "integrate",
    "normalize",
]
