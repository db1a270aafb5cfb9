"""Factor a symmetric positive definite matrix once, solve with it many times; knows matrices, never meshes."""

from heat_igl.linear.backends import Backend, analyse, factorize
from heat_igl.linear.protocols import Analysis, Factorization

__all__ = [
    "Analysis",
    "Backend",
    "Factorization",
    "analyse",
    "factorize",
]
