"""What the distance of one query starts from: a set of sources, as walks and windows take it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.mesh import SurfacePoints
from heat_igl.sources import SourcePoints, SourceSegments, SourceSet
from heat_igl.typing import FloatArray, IntArray

__all__ = ["Asked", "asked_of", "groups_of", "labels_of"]


class Asked(NamedTuple):
    """What distance starts from, and when; `labels` and `angles` are filled if given.

    Without `segments`, points stand for curves.
    """

    vertices: IntArray
    offsets: FloatArray | None
    points: SurfacePoints | None
    point_offsets: FloatArray | None
    segments: SourceSegments | None
    labels: IntArray | None
    angles: FloatArray | None
    tolerance: float | None


def labels_of(sources: SourceSet, points: SourcePoints) -> IntArray:
    """The sources, as the user counts them, of vertices, `points` and segments, one after another; -1 for nothing."""
    return np.concatenate([sources.vertex_label, points.label, sources.segments.label, [-1]])


def asked_of(sources: SourceSet, points: SourcePoints, takes_curves: bool = True) -> Asked:
    """Distance from the vertices of a set, from `points`, and from the curves of the set if windows take them."""
    of_vertices, of_points = sources.vertex_offset, points.offset
    differ = bool(of_vertices.any() or of_points.any())
    places = SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None
    return Asked(
        sources.vertices,
        of_vertices if differ else None,
        places,
        of_points if differ and places else None,
        sources.segments if takes_curves and len(sources.segments.faces) else None,
        None,
        None,
        None,
    )


def groups_of(sources: SourceSet, points: SourcePoints) -> IntArray | None:
    """For each source, which curve it is a point of, or itself; None if there are no curves."""
    if not len(sources.segments.faces):
        return None
    k = len(sources.vertices)
    groups = np.arange(k + len(points.label))
    of_curve = np.isin(points.label, sources.segments.label)
    groups[k:][of_curve] = len(groups) + points.label[of_curve]
    return groups
