"""A set of sources after it was checked: vertices, points in faces and segments of curves, and the values there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from heat_igl.mesh import MeshPart
from heat_igl.typing import FloatArray, IntArray

__all__ = ["NO_POINTS", "NO_SEGMENTS", "SourcePoints", "SourceSegments", "SourceSet", "nearest_first"]


@dataclass(frozen=True, eq=False)
class SourcePoints:
    """Points (k,) in faces, the label of the source that each belongs to, and the value at which distance begins."""

    faces: IntArray
    barycentric: FloatArray
    label: IntArray
    offset: FloatArray

    def joined(self, other: SourcePoints) -> SourcePoints:
        """These points and others."""
        return SourcePoints(
            np.concatenate([self.faces, other.faces]),
            np.concatenate([self.barycentric, other.barycentric]),
            np.concatenate([self.label, other.label]),
            np.concatenate([self.offset, other.offset]),
        )


@dataclass(frozen=True, eq=False)
class SourceSegments:
    """Segments (s,) of curves, as `SourcePoints`."""

    faces: IntArray
    start: FloatArray
    end: FloatArray
    label: IntArray
    offset: FloatArray

    def ends(self) -> SourcePoints:
        """Starts and ends of segments."""
        return SourcePoints(
            np.tile(self.faces, 2),
            np.concatenate([self.start, self.end]),
            np.tile(self.label, 2),
            np.tile(self.offset, 2),
        )


_NOWHERE = np.empty(0, np.int64)
NO_POINTS = SourcePoints(_NOWHERE, np.empty((0, 3)), _NOWHERE, np.empty(0))
NO_SEGMENTS = SourceSegments(_NOWHERE, np.empty((0, 3)), np.empty((0, 3)), _NOWHERE, np.empty(0))


@dataclass(frozen=True, eq=False)
class SourceSet:
    """One set of sources, checked.

    Attributes
    ----------
    vertices : (k,) int64
        Source vertices, ascending, each once.
    vertex_label, vertex_offset : (k,) int64, (k,) float64
        Which source a vertex is, and the value at which distance begins there.
    points, segments
        Points and curves in faces. The ends of segments are not among the points.
    n_labels : int
        How many sources there are, as the user counts them.
    is_first : bool
        Whether a solver that compares first answers has not had sources of this kind before.
    """

    vertices: IntArray
    vertex_label: IntArray
    vertex_offset: FloatArray
    points: SourcePoints
    segments: SourceSegments
    n_labels: int
    is_first: bool = False

    @property
    def on_vertices_alone(self) -> bool:
        """Whether all sources are vertices."""
        return not len(self.points.faces) and not len(self.segments.faces)

    @property
    def offsets(self) -> FloatArray:
        """The offset of every vertex, point and segment."""
        if self.on_vertices_alone:
            return self.vertex_offset
        return np.concatenate([self.vertex_offset, self.points.offset, self.segments.offset])

    def within(self, part: MeshPart) -> SourceSet:
        """The same sources, by the faces of a part of the mesh; a `SourceError` names the first that is outside."""
        part.require_vertices(self.vertices, position=self.vertex_label)
        points = replace(self.points, faces=part.numbers_of(self.points.faces, position=self.points.label))
        segments = replace(self.segments, faces=part.numbers_of(self.segments.faces, position=self.segments.label))
        return replace(self, points=points, segments=segments)

    def with_vertices_moved(self, to: IntArray) -> SourceSet:
        """The same sources with vertex v at the vertex ``to[v]``; where several meet, the earliest stays."""
        vertices = to[self.vertices]
        order = np.lexsort((self.vertex_label, self.vertex_offset, vertices))
        chosen = order[np.diff(vertices[order], prepend=-1) != 0]
        label, offset = self.vertex_label[chosen], self.vertex_offset[chosen]
        return replace(self, vertices=vertices[chosen], vertex_label=label, vertex_offset=offset)


def nearest_first(vertex: IntArray, value: FloatArray, label: IntArray) -> IntArray:
    """Where the smallest of the values at each vertex is, of equal ones that of the first label; vertices ascending."""
    if len(vertex) < 2:
        return np.arange(len(vertex))
    order = np.lexsort((label, value, vertex))
    ordered = vertex[order]
    first = np.ones(len(order), bool)
    first[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(order[first])
