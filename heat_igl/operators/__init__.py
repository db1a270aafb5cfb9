"""The discrete Laplacian, mass, gradient and divergence of a domain: a function per kind returns `Operators`."""

from heat_igl.operators.connection import (
    FaceRotations,
    connection_laplacian,
    edge_rotations,
    face_rotations,
    with_rotations,
)
from heat_igl.operators.element_derivatives import ElementChange, Elements
from heat_igl.operators.elements import EdgeLengths, TriangleElements
from heat_igl.operators.intrinsic import edge_length_operators, intrinsic_operators
from heat_igl.operators.matrices import Laplacian, OnLaplacian, Operators, check_laplacian, divergence_matrix
from heat_igl.operators.metric import fibre_metric, metric_operators
from heat_igl.operators.metric_derivatives import MetricSides
from heat_igl.operators.metric_simplices import MetricSimplices
from heat_igl.operators.point_clouds import point_cloud_operators
from heat_igl.operators.polygons import fan_operators, polygon_operators
from heat_igl.operators.simplices import cotan_operators
from heat_igl.operators.speed import speed_operators
from heat_igl.operators.suitability import is_rough_or_narrow, share_on_large_triangles
from heat_igl.operators.surface import Surface
from heat_igl.operators.triangles import operators, tufted_operators, unfolding_surface

__all__ = [
    "EdgeLengths",
    "ElementChange",
    "Elements",
    "FaceRotations",
    "Laplacian",
    "MetricSides",
    "MetricSimplices",
    "OnLaplacian",
    "Operators",
    "Surface",
    "TriangleElements",
    "check_laplacian",
    "connection_laplacian",
    "cotan_operators",
    "divergence_matrix",
    "edge_length_operators",
    "edge_rotations",
    "face_rotations",
    "fan_operators",
    "fibre_metric",
    "intrinsic_operators",
    "is_rough_or_narrow",
    "metric_operators",
    "operators",
    "point_cloud_operators",
    "polygon_operators",
    "share_on_large_triangles",
    "speed_operators",
    "tufted_operators",
    "unfolding_surface",
    "with_rotations",
]
