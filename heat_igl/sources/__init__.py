"""What a source is, once for all engines."""

from heat_igl.sources.ordered import ordered_vertices
from heat_igl.sources.oriented import Oriented, OrientedPoints, OrientedSet, oriented_set
from heat_igl.sources.samples import samples
from heat_igl.sources.source_sets import SourcePoints, SourceSegments, SourceSet, nearest_first
from heat_igl.sources.specification import (
    OffsetSources,
    Sources,
    named_vertices,
    require_resolved,
    source_set,
    vertex_sources,
)

__all__ = [
    "OffsetSources",
    "Oriented",
    "OrientedPoints",
    "OrientedSet",
    "SourcePoints",
    "SourceSegments",
    "SourceSet",
    "Sources",
    "named_vertices",
    "nearest_first",
    "ordered_vertices",
    "oriented_set",
    "require_resolved",
    "samples",
    "source_set",
    "vertex_sources",
]
