"""One search by windows on the tables of a surface: what the kernel is given, and what it leaves behind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from heat_igl.kernels import window_pairs, windows
from heat_igl.kernels.window_surface import FLAT_VERTEX
from heat_igl.mesh import SurfacePoints
from heat_igl.runtime import side_by_side
from heat_igl.sources import SourceSegments
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.half_edges import NO_POINTS, NO_SEGMENTS, HalfEdges, Located

__all__ = ["TOLERANCE", "Found", "Leaving", "Searched", "Starts", "search", "starts_at"]

#: What another way must be shorter by, as a fraction of the distance, before a window is cut: more than rounding adds
#: up to. A larger number keeps a few windows more and changes no result.
TOLERANCE = 1e-11
# On fewer vertices a search takes a few milliseconds, and a thread with its arrays a part of one.
_FEWEST_SHARED = 10_000
# Two threads meet after so many mean edge lengths. Shorter rounds cost time, longer ones more windows that cross the
# line between the two parts.
_ROUND = 3.0
# With about so many windows on the front there is work for two threads between two meetings: a tenth of a millisecond.
_PLENTY = 1000
_NO_VERTICES = np.empty(0, np.int64)


class Starts(NamedTuple):
    """Sources by the numbers of the tables.

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


class Found(NamedTuple):
    """What the kernel fills for each of some places."""

    distance: FloatArray
    root: AnyArray
    label: AnyArray
    entered: AnyArray
    crossing: FloatArray

    @classmethod
    def of(cls, k: int, n_labels: int) -> Found:
        """Nothing found yet, at k places."""
        nothing = np.full((2, k), -1, np.int32)
        return cls(np.full(k, np.inf), nothing[0], np.full(n_labels, -1, np.int32), nothing[1], np.zeros(k))

    def take_nearer(self, other: Found) -> None:
        """Take over what was found nearer by another search."""
        is_nearer = np.flatnonzero(other.distance < self.distance)
        for mine, theirs in zip(self, other, strict=True):
            mine[is_nearer] = theirs[is_nearer]


class Leaving(NamedTuple):
    """How the straight last parts of the paths to n vertices leave the roots, on faces that are oriented alike.

    Attributes
    ----------
    corner : (n,)
        The corner of the root that the path leaves through; of a source point in face f, ``3 f``; -1 for none.
    direction : (n, 2) float64
        The direction in the plane of that corner, of any length. The first axis is the side to the next corner.
    """

    corner: AnyArray
    direction: FloatArray

    @classmethod
    def of(cls, n: int) -> Leaving:
        """Nothing found yet, at n vertices."""
        return cls(np.full(n, -1, np.int32), np.zeros((n, 2)))


class Searched(NamedTuple):
    """A search that is done.

    Attributes
    ----------
    starts : Starts
        The sources.
    found : Found
        At the vertices.
    place : Located
        The targets.
    at_targets : Found
        At each of `place`.
    n_windows, n_crossings : int
        As in `ExactSolution`.
    leaving : Leaving or None
        At the vertices, if asked for.
    """

    starts: Starts
    found: Found
    place: Located
    at_targets: Found
    n_windows: int
    n_crossings: int
    leaving: Leaving | None

    def nearest_copy(self, n_targets: int) -> IntArray:
        """Of the copies of each target, the one with the smallest distance."""
        order = np.lexsort((-self.at_targets.distance, self.place.point))
        which = np.empty(n_targets, np.int64)
        which[self.place.point[order]] = order
        return which


def search(
    edges: HalfEdges,
    starts: Starts,
    *,
    cutoff: float = np.inf,
    targets: SurfacePoints | None = None,
    goals: IntArray | None = None,
    directed: bool = False,
    threads: int = 1,
) -> Searched:
    """Distances on the tables `edges`; keywords and errors are those of `ExactSurface.solve`."""
    place = edges.located(targets)
    n, t = edges.n, len(place.faces)
    n_labels = n + len(starts.points.faces) + len(starts.segments.faces)
    found, at_targets = Found.of(n, n_labels), Found.of(t, 0)
    leaving = Leaving.of(n) if directed else None
    arguments: tuple[Any, ...] = (
        starts.vertices,
        starts.offset,
        starts.points.faces,
        np.ascontiguousarray(starts.points.barycentric).ravel(),
        starts.point_offset,
        starts.segments.faces,
        np.ascontiguousarray(starts.segments.barycentric).ravel(),
        starts.segment_offset,
        edges.number[_NO_VERTICES if goals is None else goals],
        *edges.by_face(place),
        place.faces,
        np.ascontiguousarray(place.barycentric).ravel(),
        at_targets.distance,
        at_targets.root,
        at_targets.entered,
        at_targets.crossing,
        edges.largest_circle(place),
        goals is not None,
        float(edges.scaled(cutoff)),
    )
    statistics = None
    # Vertices are found flat by the first search.
    asks_for_all = t == 0 and goals is None and not directed
    if threads > 1 and n >= _FEWEST_SHARED and asks_for_all and not (edges.tables.kind == FLAT_VERTEX).any():
        statistics = _beside(edges, found, arguments)
        if statistics is None:
            found = Found.of(n, n_labels)
    if statistics is None:
        statistics = np.zeros(3, np.int64)
        _require(windows.search(*(_front(edges, found, leaving), *arguments, statistics)))
    return Searched(starts, found, place, at_targets, int(statistics[1]), int(statistics[2]), leaving)


def _require(is_done: bool) -> None:
    if not is_done:
        raise MemoryError("the windows of the exact distance do not fit into memory")


def _front(edges: HalfEdges, found: Found, leaving: Leaving | None = None) -> windows.Front:
    """What the kernel writes in one search."""
    return windows.Front(
        *edges.tables,
        found.distance,
        np.full(edges.n, np.inf),
        found.root,
        found.label,
        found.entered,
        found.crossing,
        np.empty(edges.n, np.int32),
        np.full(len(edges.tables.vertex), -1, np.int32),
        TOLERANCE,
        *(() if leaving is None else (leaving.corner, leaving.direction.ravel())),
    )


def _beside(edges: HalfEdges, found: Found, arguments: tuple[Any, ...]) -> IntArray | None:
    """Search on two threads; the statistics of both, or None if one thread has to search instead."""
    also, statistics, done = Found.of(edges.n, len(found.label)), np.zeros((2, 3), np.int64), []
    first, second = _front(edges, found), _front(edges, also)
    bounds = np.full((2, edges.n), np.inf)
    window_pairs.pair(first, second, bounds[0], bounds[1], _ROUND * float(edges.tables.length.mean()), _PLENTY)
    calls: list[Callable[[], bool]] = [
        lambda: windows.search(*(first, *arguments, statistics[0])),
        lambda: window_pairs.assist(second, arguments[-1], statistics[1]),
    ]
    try:
        side_by_side(lambda call: done.append(call()), calls)
    finally:
        is_same = window_pairs.part(first, second)
    _require(all(done))
    found.take_nearer(also)
    return np.asarray(statistics.sum(axis=0)) if is_same else None


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
        nothing, label = np.zeros(0), np.append(np.arange(k), -1)
        return Starts(edges.number[sources], begin, NO_POINTS, nothing, NO_SEGMENTS, nothing, label[k:], label)
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
