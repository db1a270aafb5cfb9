"""What a source is, the right-hand side it gives, and the exact distance near it."""

from heat_igl.sources.assembly import NEAR_RADIUS, SourceAssembler, take_shorter
from heat_igl.sources.near_field import NearField, Seeds, SightLines
from heat_igl.sources.ordered import ordered_vertices
from heat_igl.sources.oriented import Oriented, OrientedPoints, OrientedSet, oriented_set
from heat_igl.sources.source_sets import SourcePoints, SourceSegments, SourceSet, nearest_first
from heat_igl.sources.source_terms import SourceTerm, right_hand_side
from heat_igl.sources.specification import (
    OffsetSources,
    Sources,
    named_vertices,
    require_resolved,
    source_set,
    vertex_sources,
)

__all__ = [
    "NEAR_RADIUS",
    "NearField",
    "OffsetSources",
    "Oriented",
    "OrientedPoints",
    "OrientedSet",
    "Seeds",
    "SightLines",
    "SourceAssembler",
    "SourcePoints",
    "SourceSegments",
    "SourceSet",
    "SourceTerm",
    "Sources",
    "named_vertices",
    "nearest_first",
    "ordered_vertices",
    "oriented_set",
    "require_resolved",
    "right_hand_side",
    "source_set",
    "take_shorter",
    "vertex_sources",
]
