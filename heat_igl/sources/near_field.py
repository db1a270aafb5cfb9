"""Exact distance around sources: the vertices that see a source in a straight line through unfolded triangles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import Adjacency, IntrinsicTriangulation, lay_out
from heat_igl.mesh import grouping
from heat_igl.sources.own_faces import seen_from_points, seen_from_segments
from heat_igl.sources.source_sets import SourcePoints, SourceSegments, nearest_first
from heat_igl.sources.windows import ROUNDING, SeenVertices, cross, joined
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["NearField", "Seeds", "SightLines"]

# Number of triangles that a window may cross, one after another. On ordinary meshes the radius is reached long before.
_MOST_LEVELS = 50
# Windows that are followed for each source. On ordinary meshes there are up to 1000 for a point, on a camel and a cow
# with long triangles 4500, and up to 430 for a segment of a curve. At an edge of k faces each window becomes k - 1, and
# on boundaries of random tetrahedra there were tens of millions: those that come first tell less than the radius then.
_MOST_WINDOWS = 10_000


@dataclass(frozen=True, eq=False)
class Seeds:
    """Exactly known distances: `value` (k,) at distinct vertices `vertex` (k,), from the source `label` (k,)."""

    vertex: IntArray
    value: FloatArray
    label: IntArray

    @classmethod
    def nearest(cls, several: Seeds) -> Seeds:
        """The smallest of several values at each vertex."""
        kept = nearest_first(several.vertex, several.value, several.label)
        return cls(several.vertex[kept], several.value[kept], several.label[kept])

    def at(self, chosen: BoolArray) -> Seeds:
        """Some of the seeds, by a mask (k,)."""
        return Seeds(self.vertex[chosen], self.value[chosen], self.label[chosen])


class SightLines(NamedTuple):
    """The straight lines from n vertices to the sources that they see.

    Attributes
    ----------
    value : (n,) float64
        Distance along the line, with the value at which it begins; ``inf`` without a line.
    reach : (n,) float64
        Length of the line.
    entered, share : (n,) int64, (n,) float64
        As for `SeenVertices`, -1 for lines inside a face.
    """

    value: FloatArray
    reach: FloatArray
    entered: IntArray
    share: FloatArray


class NearField:
    """Exact distance around sources on one triangulated surface.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        Triangles to which the faces of points and curves can be carried (see `IntrinsicTriangulation.locate`).
    """

    def __init__(self, triangulation: IntrinsicTriangulation) -> None:
        self.triangulation = triangulation
        self._adjacency = Adjacency(triangulation)

    def meets_shared_edge(self, vertices: IntArray) -> bool:
        """Whether a face at one of the vertices has an edge of more than two faces."""
        return self._adjacency.meets_shared_edge(vertices)

    def spokes(self, vertices: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Edges from the given vertices, as `Adjacency.spokes` returns them."""
        return self._adjacency.spokes(vertices)

    def seeds(
        self, points: SourcePoints, segments: SourceSegments, radius: float | FloatArray, vertices: Seeds | None = None
    ) -> tuple[Seeds, Seeds]:
        """Distance at the vertices that see a source in a straight line.

        Parameters
        ----------
        points, segments : SourcePoints, SourceSegments
            The sources. The ends of segments are no sources by themselves.
        radius : float or (n,) float64
            Largest distance of interest, one or one for each vertex of the triangulation.
        vertices : Seeds, optional
            Vertices that are sources too.

        Returns
        -------
        near : Seeds
            Vertices within `radius`, ascending, with the length of the straight line. Almost always that is the
            shortest path. Vertices with a shorter path around curvature are left out, as far as a detour along one
            edge reveals them.
        far : Seeds
            Corners of the sources' own faces beyond `radius`, at which another source may be nearer.
        """
        radius = np.broadcast_to(radius, self.triangulation.n)
        found, own, complete = self._found(points, segments, radius, vertices)
        near = self._shortest(found, radius, complete)
        return near, own.at(~np.isin(own.vertex, near.vertex))

    def lines(
        self, points: SourcePoints, segments: SourceSegments, radius: float | FloatArray, vertices: Seeds | None = None
    ) -> SightLines:
        """The straight lines whose lengths `seeds` finds; arguments as for it."""
        found, _, _ = self._found(points, segments, np.broadcast_to(radius, self.triangulation.n), vertices)
        return found.lines()

    def _found(
        self, points: SourcePoints, segments: SourceSegments, radius: FloatArray, vertices: Seeds | None
    ) -> tuple[_Nearest, Seeds, float]:
        """The shortest straight line to each vertex, the corners of the sources' own faces, and a limit.

        All lines within the radius were followed whose values at the end are below the limit.
        """
        points, segments = self._carried(points, segments)
        if vertices is not None:
            points = points.joined(self._as_points(vertices))
        from_points, seen_by_points = seen_from_points(points, self._adjacency)
        from_segments, seen_by_segments = seen_from_segments(segments, self._adjacency)
        found = _Nearest(self.triangulation.n)
        for seen in (*seen_by_points, *seen_by_segments):
            found.add(seen)
        windows = joined([*from_points, *from_segments])
        own = found.seeds()
        base = self.triangulation.l.ravel()
        n_left = _MOST_WINDOWS * (len(points.faces) + len(segments.faces))
        complete = np.inf
        for _ in range(_MOST_LEVELS):
            nearest = windows.nearest()
            ends = self.triangulation.tail(windows.half_edge), self.triangulation.head(windows.half_edge)
            tail, head = (found.at(vertex) for vertex in ends)
            useful = windows.offset + nearest < np.minimum(tail, head) + base[windows.half_edge]
            useful &= windows.are_nearer_than(tail, head, base[windows.half_edge])
            windows = windows.at((nearest < radius[ends[0]]) & useful)
            n_left -= len(windows)
            if n_left < 0:
                complete = float((windows.offset + windows.nearest()).min())
            if n_left < 0 or not len(windows):
                break
            windows, seen = cross(windows, self._adjacency)
            found.add(seen)
        return found, own, complete

    def _shortest(self, found: _Nearest, radius: FloatArray, complete: float) -> Seeds:
        """Seeds within `radius`, without the vertices that another reaches along an edge on a shorter path.

        None of them beyond `complete`, from where on shorter lines may not have been followed.
        """
        seeds = found.seeds(radius)
        seeds = seeds.at(seeds.value <= complete)
        which, ends, lengths = self.spokes(seeds.vertex)
        beaten = found.at(ends) > (seeds.value[which] + lengths) * (1 + ROUNDING)
        return seeds.at(~np.isin(seeds.vertex, ends[beaten]))

    def samples(self, segments: SourceSegments, spacing: float | FloatArray) -> tuple[SourcePoints, FloatArray]:
        """Points along segments, at most `spacing` apart, and the length of the piece around each.

        A point lies in the middle of the piece: there a linear function takes the mean over the piece.
        """
        _, carried = self._carried(segments.ends(), segments)
        along = np.einsum("kc,kcx->kx", carried.end - carried.start, lay_out(self.triangulation.l[carried.faces]))
        lengths = np.linalg.norm(along, axis=1)
        counts = np.ceil(lengths / spacing).astype(np.int64)
        which, piece = grouping.enumerate_runs(counts)
        share = (piece + 0.5) / counts[which]
        barycentric = (1 - share)[:, None] * segments.start[which] + share[:, None] * segments.end[which]
        points = SourcePoints(segments.faces[which], barycentric, segments.label[which], segments.offset[which])
        return points, lengths[which] / counts[which]

    def _carried(self, points: SourcePoints, segments: SourceSegments) -> tuple[SourcePoints, SourceSegments]:
        """Points and segments in the faces of the triangulation."""
        faces, barycentric = self.triangulation.locate(points.faces, points.barycentric)
        faces_of_segments, start = self.triangulation.locate(segments.faces, segments.start)
        _, end = self.triangulation.locate(segments.faces, segments.end)
        return (
            replace(points, faces=faces, barycentric=barycentric),
            replace(segments, faces=faces_of_segments, start=start, end=end),
        )

    def _as_points(self, vertices: Seeds) -> SourcePoints:
        """Vertices as points in the first of their faces; vertices without a face are left out."""
        corner, which = self._adjacency.corners_at(vertices.vertex)
        which, first = np.unique(which, return_index=True)
        corner = corner[first]
        return SourcePoints(corner // 3, np.eye(3)[corner % 3], vertices.label[which], vertices.value[which])


class _Nearest:
    """The smallest value so far at each of n vertices, the label of the source, and the offset of the source."""

    def __init__(self, n: int) -> None:
        self._value = np.full(n, np.inf)
        self._label = np.full(n, -1)
        self._offset = np.zeros(n)
        self._entered = np.full(n, -1)
        self._share = np.zeros(n)

    def add(self, seen: SeenVertices) -> None:
        """Take over the values that are smaller than those so far."""
        vertex, distance, offset, label, entered, share = seen
        value = offset + distance
        order = np.argsort(-value, kind="stable")  # of several values for a vertex, the last one written stays
        better = order[value[order] < self._value[vertex[order]]]
        at = vertex[better]
        self._value[at], self._label[at], self._offset[at] = value[better], label[better], offset[better]
        self._entered[at] = -1 if entered is None else entered[better]
        self._share[at] = 0.0 if share is None else share[better]

    def lines(self) -> SightLines:
        """The lines behind the values so far."""
        return SightLines(self._value, self._value - self._offset, self._entered, self._share)

    def at(self, vertex: IntArray) -> FloatArray:
        """The values at some vertices, ``inf`` for those without one."""
        return np.asarray(self._value[vertex])

    def seeds(self, radius: float | FloatArray = np.inf) -> Seeds:
        """The vertices within `radius` of their sources, ascending."""
        vertex = np.flatnonzero((self._label >= 0) & (self._value - self._offset <= radius))
        return Seeds(vertex, self._value[vertex], self._label[vertex])
