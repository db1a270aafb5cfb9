"""What the distance of one query starts from: a set of sources, as walks and windows take it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from heat_igl.errors import is_number, shown
from heat_igl.mesh import SurfacePoints
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.sources import NearField, SourcePoints, SourceSegments, SourceSet
from heat_igl.typing import FloatArray, IntArray
from heat_igl.unfolding.exact import ExactSolution
from heat_igl.unfolding.refinement import Known

__all__ = [
    "Asked",
    "asked_of",
    "from_earliest",
    "known_of",
    "labels_of",
    "require_share",
    "starting_points",
    "with_samples",
]


class Asked(NamedTuple):
    """The sources of one query with their offsets; `labels` and `angles` are filled if given.

    Without `segments`, points stand for curves, and `groups` says of each source which curve it is a point of.
    """

    vertices: IntArray
    offsets: FloatArray | None
    points: SurfacePoints | None
    point_offsets: FloatArray | None
    segments: SourceSegments | None
    labels: IntArray | None
    angles: FloatArray | None
    tolerance: float | None
    groups: IntArray | None

    @property
    def starts(
        self,
    ) -> tuple[IntArray, FloatArray | None, SurfacePoints | None, FloatArray | None, SourceSegments | None]:
        """What distance starts from, as `ExactSurface.solve` takes it."""
        return self.vertices, self.offsets, self.points, self.point_offsets, self.segments


def require_share(tolerance: float | None) -> None:
    """Refuse a tolerance that is not a number from 0 to 1."""
    if tolerance is not None and not (is_number(tolerance) and 0 <= tolerance <= 1):
        raise ValueError(f"tolerance must lie between 0 and 1, not {shown(tolerance)}")


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
        _groups_of(sources, points),
    )


def _groups_of(sources: SourceSet, points: SourcePoints) -> IntArray | None:
    """For each source, which curve it is a point of, or itself; None if there are no curves."""
    if not len(sources.segments.faces):
        return None
    k = len(sources.vertices)
    groups = np.arange(k + len(points.label))
    of_curve = np.isin(points.label, sources.segments.label)
    groups[k:][of_curve] = len(groups) + points.label[of_curve]
    return groups


def with_samples(sources: SourceSet, near_field: NearField, spacing: float) -> SourcePoints:
    """The points of a set, and points on its curves that are at most `spacing` apart."""
    samples, _ = near_field.samples(sources.segments, spacing)
    return sources.points.joined(samples).joined(sources.segments.ends())


def starting_points(corner: IntArray, points: SourcePoints, origin: IntArray) -> SurfacePoints:
    """The places (n,) at which paths start.

    Parameters
    ----------
    corner : (k,) int64
        A corner ``3 f + c`` of a face at each source vertex.
    points : SourcePoints
        p further sources.
    origin : (n,) int64
        The source of each path: a vertex below k, a point below k + p; a corner of face 0 stands for -1, no path.
    """
    # After vertices and points comes nothing, at which the index -1 looks.
    corner, nothing = corner.astype(np.int64), np.zeros(1, np.int64)
    faces = np.concatenate([corner // 3, points.faces, nothing])
    barycentric = np.concatenate([np.eye(3)[corner % 3], points.barycentric, np.eye(3)[:1]])
    return unchecked_points(faces[origin], barycentric[origin])


def from_earliest(sources: SourceSet, components: IntArray, F: IntArray) -> tuple[FloatArray, SourceSet]:
    """When distance begins on each component (n_components,), and the sources with their offsets from there.

    On components without sources it never does, and any value will do.
    """
    if sources.on_vertices_alone and not sources.vertex_offset.any():
        return np.zeros(int(components.max()) + 1), sources
    points, segments = sources.points, sources.segments
    places = [components[at] for at in (sources.vertices, F[points.faces, 0], F[segments.faces, 0])]
    offsets = [sources.vertex_offset, points.offset, segments.offset]
    earliest = np.full(int(components.max()) + 1, np.inf)
    np.minimum.at(earliest, np.concatenate(places), np.concatenate(offsets))
    late = [offset - earliest[place] for offset, place in zip(offsets, places, strict=True)]
    return earliest, replace(
        sources,
        vertex_offset=late[0],
        points=replace(points, offset=late[1]),
        segments=replace(segments, offset=late[2]),
    )


def known_of(asked: Asked, near: ExactSolution) -> Known:
    """Vertices that a sweep begins with, from the exact distance near the sources."""
    is_found = np.isfinite(near.distance)
    is_found[asked.vertices] = False
    vertex = np.flatnonzero(is_found)
    return Known(vertex, near.distance[vertex], near.origin.label[vertex])
