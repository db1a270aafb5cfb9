"""Triangulations known by edge lengths: flips and their history, mollification, the tufted cover, fans of angles."""

from heat_igl.intrinsic.adjacency import Adjacency
from heat_igl.intrinsic.delaunay import intrinsic_delaunay
from heat_igl.intrinsic.double_cover import double_cover
from heat_igl.intrinsic.frame_axes import tangent_frames
from heat_igl.intrinsic.gluing import from_edge_lengths, from_gluing, intrinsic_triangulation, oriented
from heat_igl.intrinsic.gradient import intrinsic_gradient
from heat_igl.intrinsic.history import Covered, Flipped, Merged, Refined, Turned
from heat_igl.intrinsic.layout import apex, corner_angles, lay_out
from heat_igl.intrinsic.mollification import mollify
from heat_igl.intrinsic.polar_angles import PolarAngles, carried_angles, polar_angles, transport_angles
from heat_igl.intrinsic.refinement import delaunay_refinement
from heat_igl.intrinsic.tangent_frames import TangentFrames, checked_vectors
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.intrinsic.tufted import closed_cover, has_nonmanifold_edges, tufted_cover

__all__ = [
    "Adjacency",
    "Covered",
    "Flipped",
    "IntrinsicTriangulation",
    "Merged",
    "Refined",
    "Turned",
    "apex",
    "closed_cover",
    "PolarAngles",
    "TangentFrames",
    "carried_angles",
    "checked_vectors",
    "corner_angles",
    "delaunay_refinement",
    "double_cover",
    "from_edge_lengths",
    "from_gluing",
    "has_nonmanifold_edges",
    "intrinsic_delaunay",
    "intrinsic_gradient",
    "intrinsic_triangulation",
    "lay_out",
    "mollify",
    "oriented",
    "polar_angles",
    "tangent_frames",
    "transport_angles",
    "tufted_cover",
]
