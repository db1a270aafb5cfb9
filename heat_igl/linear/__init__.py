"""Factor a symmetric positive definite matrix once, solve with it many times; knows matrices, never meshes."""

from heat_igl.linear.backends import Analysis, Backend, Factorization, analyse, factorize

__all__ = [
    "Analysis",
    "Backend",
    "Factorization",
    "analyse",
    "factorize",
]
