"""The discrete Laplacian, mass, gradient and divergence of a domain: a function per kind returns `Operators`."""

from heat_igl.operators.polygons import polygon_operators
from heat_igl.operators.speed import speed_operators
from heat_igl.operators.triangles import (
    Laplacian,
    Operators,
    cotan_operators,
    intrinsic_operators,
    operators,
    tufted_operators,
)

__all__ = [
    "Laplacian",
    "Operators",
    "cotan_operators",
    "intrinsic_operators",
    "operators",
    "polygon_operators",
    "speed_operators",
    "tufted_operators",
]
