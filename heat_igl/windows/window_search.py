"""One search by windows on the tables of a surface: sources, arguments and results of the kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from heat_igl.kernels.signals import raise_caught
from heat_igl.kernels.windows import windows
from heat_igl.kernels.windows.surface import FLAT_VERTEX
from heat_igl.mesh import SurfacePoints
from heat_igl.runtime import side_by_side
from heat_igl.sources import SourceSegments
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows.tables import NO_POINTS, NO_SEGMENTS, Located, Tables

__all__ = ["TOLERANCE", "Found", "Leaving", "NO_STARTS", "Searched", "Starts", "Targets", "search", "starts_at"]

#: A window is cut where another path is shorter by this fraction of the distance: more than rounding adds up to. A
#: larger number keeps more windows, all of them paths, and changes no distance.
TOLERANCE = 1e-11
# On fewer vertices a search takes a few milliseconds, and starting a thread a good part of one.
_FEWEST_SHARED = 10_000
# Length of a round of two threads, in mean edge lengths. Shorter rounds cost time; longer ones make more windows that
# cross the border of the two parts.
_ROUND = 3.0
# With about this many windows on the front, a round has work for two threads: a tenth of a millisecond.
_PLENTY = 1000
_NO_VERTICES = np.empty(0, np.int64)


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
    tables: Tables,
    sources: IntArray,
    offsets: FloatArray | None,
    points: SurfacePoints | None,
    point_offsets: FloatArray | None,
    segments: SourceSegments | None,
) -> Starts:
    """Sources for the kernel, as `ExactSurface.solve` takes them; points at corners become vertices."""
    k, p = len(sources), 0 if points is None else len(points)
    begin = np.zeros(k) if offsets is None else tables.scaled(np.asarray(offsets, np.float64))
    if points is None and segments is None:
        label = np.append(np.arange(k), -1)
        return NO_STARTS._replace(vertices=tables.number[sources], offset=begin, place=label[k:], label=label)
    late = np.zeros(p) if point_offsets is None else tables.scaled(np.asarray(point_offsets, np.float64))
    counted = np.arange(p)
    if segments is not None:
        ends, number = segments.ends(), p + np.arange(len(segments.faces))
        all_faces = np.concatenate([np.empty(0, np.int64) if points is None else points.faces, ends.faces])
        all_places = np.concatenate([np.empty((0, 3)) if points is None else points.barycentric, ends.barycentric])
        points = SurfacePoints(all_faces, all_places)
        late, counted = np.concatenate([late, tables.scaled(ends.offset)]), np.concatenate([counted, number, number])
    place, lines = tables.located(points), tables.located_segments(segments)
    late, counted = late[place.point], counted[place.point]
    is_corner = (place.barycentric == 0).sum(axis=1) == 2
    corner = 3 * place.faces[is_corner] + place.barycentric[is_corner].argmax(axis=1)
    numbers = np.concatenate([counted[~is_corner], p + lines.point, [-1]])
    return Starts(
        np.concatenate([tables.number[sources], tables.edges.vertex[corner]]),
        np.concatenate([begin, late[is_corner]]),
        Located(*(column[~is_corner] for column in place)),
        late[~is_corner],
        lines,
        np.zeros(0) if segments is None else tables.scaled(segments.offset)[lines.point],
        numbers,
        np.concatenate([np.arange(k), k + counted[is_corner], np.where(numbers < 0, -1, k + numbers)]),
    )


class Found(NamedTuple):
    """Results of the kernel at k places."""

    distance: FloatArray
    root: AnyArray
    label: AnyArray
    entered: AnyArray
    crossing: FloatArray

    @classmethod
    def of(cls, k: int, n_labels: int) -> Found:
        """Initial values for k places."""
        nothing = np.full((2, k), -1, np.int32)
        return cls(np.full(k, np.inf), nothing[0], np.full(n_labels, -1, np.int32), nothing[1], np.zeros(k))

    def take_nearer(self, other: Found) -> None:
        """Take over the results of another search that are nearer."""
        is_nearer = np.flatnonzero(other.distance < self.distance)
        for mine, theirs in zip(self, other, strict=True):
            mine[is_nearer] = theirs[is_nearer]


class Targets(NamedTuple):
    """Points whose distance is asked for.

    Attributes
    ----------
    place : Located
        t places in the triangles, in contiguous arrays.
    first, following : (m,), (t,) int32
        The first place in each triangle, and the next place in the same triangle; -1 for none.
    largest_circle : float
        Diameter of the largest circle around a triangle with a place.
    found : Found
        At each place.
    """

    place: Located
    first: AnyArray
    following: AnyArray
    largest_circle: float
    found: Found


class Leaving(NamedTuple):
    """Directions in which the straight last parts of the paths to n vertices leave their roots, on faces oriented
    alike.

    Attributes
    ----------
    corner : (n,)
        The corner of the root that the path leaves through; of a source point in face f, ``3 f``; -1 for none.
    direction : (n, 2) float64
        The direction in the plane of that corner, of any length. The first axis is the side to the next corner.
    place : (n, 3) float64, optional
        Barycentric coordinates of the place that the path leaves, in the triangle of the corner.
    turn : (n,) float64, optional
        The angle that leads from a direction in that triangle to the same in the first triangle of a source point.

    Notes
    -----
    For paths from segments a search notes a length along the segment and a side, see `front.relax`;
    `leaving.with_places` turns both into a direction and a place.
    """

    corner: AnyArray
    direction: FloatArray
    place: FloatArray | None = None
    turn: FloatArray | None = None

    @classmethod
    def of(cls, n: int) -> Leaving:
        """Initial values for n vertices."""
        return cls(np.full(n, -1, np.int32), np.zeros((n, 2)))


class Searched(NamedTuple):
    """A search that is done.

    Attributes
    ----------
    starts : Starts
        The sources.
    found : Found
        At the vertices.
    targets : Targets
        The target points with their results.
    n_windows, n_crossings : int
        As in `ExactSolution`.
    leaving : Leaving or None
        At the vertices, if asked for.
    """

    starts: Starts
    found: Found
    targets: Targets
    n_windows: int
    n_crossings: int
    leaving: Leaving | None

    def nearest_copy(self, n_targets: int) -> IntArray:
        """Of the copies of each target, the one with the smallest distance."""
        order = np.lexsort((-self.targets.found.distance, self.targets.place.point))
        which = np.empty(n_targets, np.int64)
        which[self.targets.place.point[order]] = order
        return which


# A search of the kernel on a front, from some sources; it fills statistics, and returns whether memory sufficed.
_Run = Callable[[windows.Front, Starts, IntArray], bool]


def search(
    tables: Tables,
    starts: Starts,
    *,
    cutoff: float = np.inf,
    targets: SurfacePoints | None = None,
    goals: IntArray | None = None,
    directed: bool = False,
    threads: int = 1,
) -> Searched:
    """Distances on the tables `edges`; keywords and errors are those of `ExactSurface.solve`."""
    n, wanted = tables.n, _targets_at(tables, targets)
    n_labels = n + len(starts.points.faces) + len(starts.segments.faces)
    found, leaving = Found.of(n, n_labels), Leaving.of(n) if directed else None
    goal, limit = tables.number[_NO_VERTICES if goals is None else goals], float(tables.scaled(cutoff))

    def run(front: windows.Front, starts: Starts, statistics: IntArray) -> bool:
        return windows.search(front, starts, goal, wanted, goals is not None, limit, statistics)

    statistics = None
    # Vertices are found flat by the first search.
    asks_for_all = not len(wanted.place.faces) and goals is None and not directed
    shares = threads > 1 and n >= _FEWEST_SHARED and asks_for_all
    if shares and not (tables.kind == FLAT_VERTEX).any():
        statistics = _beside(tables, starts, found, run)
        if statistics is None:
            found = Found.of(n, n_labels)
    if statistics is None:
        statistics = np.zeros(3, np.int64)
        _require(run(windows.Front(tables, found, TOLERANCE, leaving), starts, statistics))
    return Searched(starts, found, wanted, int(statistics[1]), int(statistics[2]), leaving)


def _require(is_done: bool) -> None:
    if not is_done:
        raise_caught()
        raise MemoryError("the windows of the exact distance do not fit into memory")


def _beside(tables: Tables, starts: Starts, found: Found, run: _Run) -> IntArray | None:
    """Search on two threads; returns the statistics of both, or None if one thread must repeat the search."""
    also, statistics, done = Found.of(tables.n, len(found.label)), np.zeros((2, 3), np.int64), []
    first, second = (windows.Front(tables, each, TOLERANCE) for each in (found, also))
    bounds = np.full((2, tables.n), np.inf)
    windows.pair(first, second, bounds[0], bounds[1], _ROUND * float(tables.edges.length.mean()), _PLENTY)
    calls: list[Callable[[], bool]] = [
        lambda: run(first, starts, statistics[0]),
        lambda: run(second, NO_STARTS, statistics[1]),
    ]
    try:
        side_by_side(lambda call: done.append(call()), calls)
    finally:
        is_same = windows.part(first, second)
    _require(all(done))
    found.take_nearer(also)
    return np.asarray(statistics.sum(axis=0)) if is_same else None


def _targets_at(tables: Tables, points: SurfacePoints | None) -> Targets:
    """Target points for the kernel, with initial values."""
    place = tables.located(points)
    return Targets(place, *tables.by_face(place), tables.largest_circle(place), Found.of(len(place.faces), 0))
