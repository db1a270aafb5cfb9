"""Triangulations known by edge lengths: flips and their history, mollification, the tufted cover, fans of angles."""

from heat_igl.intrinsic.double_cover import double_cover
from heat_igl.intrinsic.history import Flipped, Merged, Turned, apex
from heat_igl.intrinsic.triangulation import (
    IntrinsicTriangulation,
    from_edge_lengths,
    intrinsic_delaunay,
    intrinsic_gradient,
    intrinsic_triangulation,
    mollify,
    oriented,
)
from heat_igl.intrinsic.tufted import has_nonmanifold_edges, tufted_cover

__all__ = [
    "Flipped",
    "IntrinsicTriangulation",
    "Merged",
    "Turned",
    "apex",
    "double_cover",
    "from_edge_lengths",
    "has_nonmanifold_edges",
    "intrinsic_delaunay",
    "intrinsic_gradient",
    "intrinsic_triangulation",
    "mollify",
    "oriented",
    "tufted_cover",
]
