"""Sources of a search by windows, by the numbers of the tables."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.mesh import SurfacePoints
from heat_igl.sources import SourceSegments
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows.half_edges import NO_POINTS, NO_SEGMENTS, HalfEdges, Located

__all__ = ["NO_STARTS", "Starts", "starts_at"]


class Starts(NamedTuple):
    """k vertices, p points and q segments that distance starts from.

    Attributes
    ----------
    vertices, offset : (k,)
        Vertices, and when each starts.
    points, point_offset : (p,)
        Points inside faces; ends of segments are among them.
    segments, segment_offset : (q,)
        Segments inside faces.
    place : (p + q + 1,) int64
        The number of each point and segment, counted as the caller does: points, then segments; then -1 for nothing.
    label : (k + p + q + 1,) int64
        The same after those of the vertices.
    """

    vertices: AnyArray
    offset: FloatArray
    points: Located
    point_offset: FloatArray
    segments: Located
    segment_offset: FloatArray
    place: IntArray
    label: IntArray


#: No sources.
NO_STARTS = Starts(
    np.empty(0, np.int32), np.zeros(0), NO_POINTS, np.zeros(0), NO_SEGMENTS, np.zeros(0), *np.full((2, 1), -1)
)


def starts_at(
    edges: HalfEdges,
    sources: IntArray,
    offsets: FloatArray | None,
    points: SurfacePoints | None,
    point_offsets: FloatArray | None,
    segments: SourceSegments | None,
) -> Starts:
    """Sources for the kernel, as `ExactSurface.solve` takes them; points at corners become vertices."""
    k, p = len(sources), 0 if points is None else len(points)
    begin = np.zeros(k) if offsets is None else edges.scaled(np.asarray(offsets, np.float64))
    if points is None and segments is None:
        label = np.append(np.arange(k), -1)
        return NO_STARTS._replace(vertices=edges.number[sources], offset=begin, place=label[k:], label=label)
    late = np.zeros(p) if point_offsets is None else edges.scaled(np.asarray(point_offsets, np.float64))
    counted = np.arange(p)
    if segments is not None:
        ends, number = segments.ends(), p + np.arange(len(segments.faces))
        all_faces = np.concatenate([np.empty(0, np.int64) if points is None else points.faces, ends.faces])
        all_places = np.concatenate([np.empty((0, 3)) if points is None else points.barycentric, ends.barycentric])
        points = SurfacePoints(all_faces, all_places)
        late, counted = np.concatenate([late, edges.scaled(ends.offset)]), np.concatenate([counted, number, number])
    place, lines = edges.located(points), edges.located_segments(segments)
    late, counted = late[place.point], counted[place.point]
    is_corner = (place.barycentric == 0).sum(axis=1) == 2
    corner = 3 * place.faces[is_corner] + place.barycentric[is_corner].argmax(axis=1)
    numbers = np.concatenate([counted[~is_corner], p + lines.point, [-1]])
    return Starts(
        np.concatenate([edges.number[sources], edges.tables.vertex[corner]]),
        np.concatenate([begin, late[is_corner]]),
        Located(*(column[~is_corner] for column in place)),
        late[~is_corner],
        lines,
        np.zeros(0) if segments is None else edges.scaled(segments.offset)[lines.point],
        numbers,
        np.concatenate([np.arange(k), k + counted[is_corner], np.where(numbers < 0, -1, k + numbers)]),
    )
