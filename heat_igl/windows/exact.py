"""Exact polyhedral distance by windows from all kinds of sources; `heat_igl.kernels.windows` has the algorithm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.kernels.signals import raise_caught
from heat_igl.kernels.windows import windows
from heat_igl.kernels.windows.surface import FLAT_VERTEX
from heat_igl.mesh import ON_SIDE, Mesh, SurfacePoints, as_triangles
from heat_igl.runtime import n_threads, side_by_side
from heat_igl.sources import Sources, SourceSet, source_set, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.windows.tables import NO_POINTS, NO_SEGMENTS, Located, Tables, from_mesh, from_triangulation

#: A window is trimmed where another path is shorter by more than this fraction of the distance, which exceeds the
#: accumulated rounding. A larger value keeps more windows, all of them valid paths, and changes no distance.
TOLERANCE = 1e-11
# With fewer vertices a search takes a few milliseconds, and starting a thread a large part of one.
_FEWEST_SHARED = 10_000
# Length of a round of two threads, in mean edge lengths. Shorter rounds spend more time on synchronization; longer ones
# let more windows cross the border of the two parts. From 1 to 10 distances are the same bits, and the processor time
# within 7 %, on six meshes of 10k to 41k vertices.
_ROUND = 3.0
# From about this number of windows on the front, a round of two threads has enough work: a tenth of a millisecond.
_PLENTY = 1000
_NO_VERTICES = np.empty(0, np.int64)


class Starts(NamedTuple):
    """Sources of a search: k vertices, p points and q segments inside faces, each with an offset.

    The ends of segments are among the points. `place` (p + q + 1,) is the caller's number of each point and segment,
    where the caller counts points first; its last entry is -1, for no source. `label` (k + p + q + 1,) is the caller's
    number of each source, counted vertices, points, segments, and again -1 at the end.
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


def starts_at(tables: Tables, sources: SourceSet, directed: bool = False) -> Starts:
    """Sources for the kernel; points at corners become vertices. Directed searches need the turns of copies.

    A ValueError if there are points or segments, and the tables cannot locate them.
    """
    vertices, begin, segments = tables.number[sources.vertices], tables.scaled(sources.vertex_offset), sources.segments
    k, p = len(vertices), len(sources.points.faces)
    if sources.on_vertices_alone:
        label = np.append(np.arange(k), -1)
        return NO_STARTS._replace(vertices=vertices, offset=begin, place=label[k:], label=label)
    number = p + np.arange(len(segments.faces))
    points = sources.points.joined(segments.ends())
    place, lines = tables.located(points, directed), tables.located_segments(segments)
    late = tables.scaled(points.offset)[place.point]
    counted = np.concatenate([np.arange(p), number, number])[place.point]
    is_corner = (place.barycentric == 0).sum(axis=1) == 2
    corner = 3 * place.faces[is_corner] + place.barycentric[is_corner].argmax(axis=1)
    inside = np.flatnonzero(~is_corner)
    # A segment begins where the one before it ends: once in each face.
    rows = np.column_stack([place.faces, points.label[place.point], late, place.barycentric])[inside]
    order = np.lexsort(rows.T)
    differs = np.abs(np.diff(rows[order], axis=0)).max(axis=1) >= ON_SIDE
    inside = inside[np.sort(np.append(order[:1], order[1:][differs]))]
    numbers = np.concatenate([counted[inside], p + lines.point, [-1]])
    return Starts(
        np.concatenate([vertices, tables.edges.vertex[corner]]),
        np.concatenate([begin, late[is_corner]]),
        Located(*(column[inside] for column in place)),
        late[inside],
        lines,
        tables.scaled(segments.offset)[lines.point],
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


class Targets(NamedTuple):
    """Target points: t copies of points in the triangles, and the results there.

    `first` (m,) is the first copy in each triangle and `following` (t,) the next in the same triangle, -1 for none;
    `largest_circle` is the diameter of the largest circumcircle of a triangle with a target.
    """

    place: Located
    first: AnyArray
    following: AnyArray
    largest_circle: float
    found: Found


class Leaving(NamedTuple):
    """How paths to n vertices leave their roots, as the kernel stores it: `corner` and `direction` of `Origin`.

    For paths from segments, a length along the segment and a side take the place of the direction, see `front.relax`.
    """

    corner: AnyArray
    direction: FloatArray

    @classmethod
    def of(cls, n: int) -> Leaving:
        """Initial values for n vertices."""
        return cls(np.full(n, -1, np.int32), np.zeros((n, 2)))


class Searched(NamedTuple):
    """Results of a search at the vertices and target points, and how paths leave their roots if requested."""

    starts: Starts
    found: Found
    targets: Targets
    n_windows: int
    leaving: Leaving | None

    def nearest_copy(self, n_targets: int) -> IntArray:
        """The copy of each target with the smallest distance."""
        order = np.lexsort((-self.targets.found.distance, self.targets.place.point))
        which = np.empty(n_targets, np.int64)
        which[self.targets.place.point[order]] = order
        return which


class Origin(NamedTuple):
    """Origins of the shortest paths to k vertices. The fields with defaults are set in directed searches.

    Attributes
    ----------
    label : (k,) int64
        The nearest source, counted vertices first, then points, then segments; -1 for none.
    root : (k,) int64
        The last vertex at which the path bends, or else its source: a vertex, n + i for source point i, or n + p + i
        for segment i after p points; -1 for none.
    entered : (k,) int64
        The half-edge of the triangulation over which the last straight part of the path enters its last face; -1 if
        the path has length 0 or runs inside one face.
    crossing : (k,) float64
        Distance of the crossing from the tail of this half-edge, in the unit of the mesh.
    corner : (k,) int64
        Corner ``3 f + c`` of the triangulation through which the last straight part leaves the root, on consistently
        oriented faces; ``3 f`` for a source point in face f; -1 for none.
    direction : (k, 2) float64
        The direction in the frame of this corner, not normalized. The first axis is the side to the next corner.
    turn : (k,) float64, optional
        Angle to be added to a direction in this triangle to get it in the first triangle of the source point.
    place : (k, 3) float64, optional
        Barycentric coordinates in this triangle of the point at which the path starts, for paths from curves.
    """

    label: IntArray
    root: IntArray
    entered: IntArray
    crossing: FloatArray
    corner: IntArray = _NO_VERTICES
    direction: FloatArray = np.empty((0, 2))
    turn: FloatArray | None = None
    place: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ExactSolution:
    """Distances at vertices (n,), with the origins of the shortest paths, and at target points (t,).

    Distances are ``inf`` if no source is within reach or the cutoff. The half-edge over which a path to a vertex enters
    its last face is opposite the vertex. `n_windows` is the number of windows that crossed an edge.
    """

    distance: FloatArray
    origin: Origin
    target_distance: FloatArray
    n_windows: int


class ExactSurface:
    """Exact distance on a triangulated surface for any number of queries, fastest on an intrinsic Delaunay one.

    Boundaries, edges of more than two faces, non-orientable surfaces, vertices with several fans, and several
    components are allowed. Immutable; threads may share it, and a query releases the interpreter's lock.
    A MeshError if there are too many triangles for 32-bit indices.
    """

    def __init__(self, triangulation: IntrinsicTriangulation | Tables) -> None:
        if isinstance(triangulation, IntrinsicTriangulation):
            triangulation = from_triangulation(triangulation)
        self.tables = triangulation
        self.n = self.tables.n

    def solve(
        self,
        sources: SourceSet,
        *,
        cutoff: float = np.inf,
        targets: SurfacePoints | None = None,
        goals: IntArray | None = None,
        directed: bool = False,
        threads: int = 1,
    ) -> ExactSolution:
        """Distances from vertices, points and curves, exact on the polyhedral surface to rounding.

        Source points, and the t `targets` whose distances are requested, lie in the faces from which the triangulation
        was made; segments need a triangulation without flips. Labels of the sources are not used. Distances beyond the
        `cutoff` are ``inf``, and the search ends there. With `goals` (g,), it also ends once the distances of these
        vertices and of the targets are known; other distances may then be too large or ``inf``. A `directed` search
        also finds how paths to the vertices leave their roots, see `Origin`, on consistently oriented faces.

        With `threads` > 1, two threads share a search for the distances of all vertices of a large surface. The
        distances are the same; among paths of equal length, another one may be found.

        A MemoryError if the windows do not fit into memory, and a ValueError if there are segments or points that the
        surface cannot locate.
        """
        done = search(
            self.tables, sources, cutoff=cutoff, targets=targets, goals=goals, directed=directed, threads=threads
        )
        distance, origin = self._result(done, cutoff)
        if done.leaving is not None:
            origin = self._with_leaving(origin, done, done.leaving)
        which = done.nearest_copy(0 if targets is None else len(targets))
        to_targets = self.tables.unscaled(done.targets.found.distance[which])
        to_targets[to_targets > cutoff] = np.inf
        return ExactSolution(distance, origin, to_targets, done.n_windows)

    def distance(
        self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1, than: FloatArray | None = None
    ) -> FloatArray:
        """Distance (n,) as by `solve`, without the origins of the paths.

        With `than` (n,), the distances from other sources, only smaller distances are found; the rest is ``inf``.
        """
        tables = self.tables
        upper = None if than is None else tables.scaled(than[tables.old_vertex])
        done = search(tables, sources, cutoff=cutoff, threads=threads, upper=upper)
        distance = tables.unscaled(done.found.distance[tables.number])
        if cutoff < np.inf:
            distance[distance > cutoff] = np.inf
        return distance

    def _with_leaving(self, origin: Origin, done: Searched, leaving: Leaving) -> Origin:
        """The origin of the paths to the vertices with its optional fields, in the caller's numbering."""
        number, root = self.tables.number, done.found.root.astype(np.int64)
        origin = origin._replace(corner=self.tables.old_half_edge(leaving.corner[number]))
        if len(done.starts.segments.faces):
            place, direction = _from_curves(self.tables, done, leaving, root)
            return origin._replace(direction=direction[number], place=place[number])
        # By the copy of the point, not by its triangle: of two sides glued to each other, both have a copy in it.
        row = np.flatnonzero((leaving.corner >= 0) & (root >= self.n))
        turn = np.zeros(self.n)
        turn[row] = done.starts.points.turn[root[row] - self.n]
        return origin._replace(direction=leaving.direction[number], turn=turn[number])

    def _result(self, done: Searched, cutoff: float) -> tuple[FloatArray, Origin]:
        """Distance and origin of the kernel's results, in the caller's numbering and unit."""
        tables, starts, found, which = self.tables, done.starts, done.found, self.tables.number
        distance = tables.unscaled(found.distance[which])
        within: BoolArray = (distance <= cutoff) & (found.root[which] >= 0)
        root = np.where(within, found.root[which], -1)
        # All copies of a point or segment have one number, and the ends of a segment have that of the segment.
        names = np.concatenate([tables.old_vertex, np.where(starts.place < 0, -1, self.n + starts.place)])
        origin = Origin(
            starts.label[np.where(within, found.label[which], -1)],
            names[root],
            tables.old_half_edge(np.where(within, found.entered[which], -1)),
            tables.unscaled(found.crossing[which]),
        )
        return np.where(within, distance, np.inf), origin


def exact_distance(V: ArrayLike, F: ArrayLike, sources: Sources) -> FloatArray:
    """Exact geodesic distance (n,) on triangles F (m, 3) with positions V (n, 3), in one call.

    `sources` are a vertex, a sequence of them or a mask (n,) of bool. A MeshError if the mesh cannot be used or is
    tetrahedral, and a SourceError if `sources` does not name vertices.
    """
    mesh = as_triangles(Mesh(V, F), "exact distance needs")
    chosen = source_set(vertex_sources(sources, mesh.n_vertices), mesh.n_vertices, None)
    return ExactSurface(from_mesh(mesh, int(chosen.vertices[0]))).distance(chosen, threads=n_threads())


# A search of the kernel from some sources on a front; it fills statistics and returns false if memory ran out.
_Run = Callable[[windows.Front, Starts, IntArray], bool]


def search(
    tables: Tables,
    sources: SourceSet,
    *,
    cutoff: float = np.inf,
    targets: SurfacePoints | None = None,
    goals: IntArray | None = None,
    directed: bool = False,
    threads: int = 1,
    upper: FloatArray | None = None,
) -> Searched:
    """Distances on `tables`; keywords and errors are those of `ExactSurface.solve`.

    Only distances smaller than `upper` (n,), in the numbering of the tables, are found.
    """
    n, starts, place = tables.n, starts_at(tables, sources, directed), tables.located(targets)
    wanted = Targets(place, *tables.by_face(place), tables.largest_circle(place), Found.of(len(place.faces), 0))
    n_labels = n + len(starts.points.faces) + len(starts.segments.faces)
    found, leaving = Found.of(n, n_labels), Leaving.of(n) if directed else None
    goal, limit = tables.number[_NO_VERTICES if goals is None else goals], float(tables.scaled(cutoff))

    def run(front: windows.Front, starts: Starts, statistics: IntArray) -> bool:
        return windows.search(front, starts, goal, wanted, goals is not None, limit, statistics)

    statistics = None
    # Flat vertices are known only after a first search.
    asks_for_all = not len(wanted.place.faces) and goals is None and not directed
    shares = threads > 1 and n >= _FEWEST_SHARED and asks_for_all
    if shares and not (tables.kind == FLAT_VERTEX).any():
        statistics = _beside(tables, starts, found, upper, run)
        if statistics is None:
            found = Found.of(n, n_labels)
    if statistics is None:
        statistics = np.zeros(3, np.int64)
        front = windows.Front(tables, found, TOLERANCE, leaving)
        if upper is not None:
            windows.bound(front, upper)
        require_memory(run(front, starts, statistics), statistics[0] < 0)
    return Searched(starts, found, wanted, int(statistics[1]), leaving)


class EndlessSearchError(RuntimeError):
    """Paths that wind around a surface are equal to rounding, so that a search would not end."""


def require_memory(is_done: bool, is_endless: bool = False) -> None:
    """Raise an error, or the signal that was caught, if a search of the kernel was not done."""
    if not is_done:
        raise_caught()
        if is_endless:
            raise EndlessSearchError("the search did not end, as the surface is too thin for doubles: remesh it")
        raise MemoryError("the windows of the exact distance do not fit into memory")


def _beside(tables: Tables, starts: Starts, found: Found, upper: FloatArray | None, run: _Run) -> IntArray | None:
    """Search on two threads; returns the statistics of both, or None if one thread must repeat the search."""
    also, statistics, done = Found.of(tables.n, len(found.label)), np.zeros((2, 3), np.int64), []
    first, second = windows.Front(tables, found, TOLERANCE), windows.Front(tables, also, TOLERANCE)
    bounds = np.tile(np.full(tables.n, np.inf) if upper is None else upper, (2, 1))
    windows.pair(first, second, bounds[0], bounds[1], _ROUND * float(tables.edges.length.mean()), _PLENTY)
    calls: list[Callable[[], bool]] = [
        lambda: run(first, starts, statistics[0]),
        lambda: run(second, NO_STARTS, statistics[1]),
    ]
    try:
        side_by_side(lambda call: done.append(call()), calls)
    finally:
        is_same = windows.part(first, second)
    require_memory(all(done), statistics.min() < 0)
    is_nearer = np.flatnonzero(also.distance < found.distance)
    for mine, theirs in zip(found, also, strict=True):
        mine[is_nearer] = theirs[is_nearer]
    return np.asarray(statistics.sum(axis=0)) if is_same else None


def _from_curves(tables: Tables, done: Searched, leaving: Leaving, root: IntArray) -> tuple[FloatArray, FloatArray]:
    """Barycentric coordinates (n, 3), 0 for none, and directions (n, 2) in which last parts of paths leave their roots.

    All arrays are in the numbering of the tables.
    """
    starts, n = done.starts, tables.n
    first_segment = n + len(starts.points.faces)
    has_path, place = leaving.corner >= 0, np.zeros((n, 3))
    row = np.flatnonzero(has_path & (root < n))
    place[row, leaving.corner[row] % 3] = 1.0
    row = np.flatnonzero(has_path & (root >= n) & (root < first_segment))
    place[row] = starts.points.barycentric[root[row] - n]
    row = np.flatnonzero(has_path & (root >= first_segment))
    direction = leaving.direction.copy()
    place[row], direction[row] = _from_segments(tables, done, leaving, row, root[row] - first_segment)
    return place, direction


def _from_segments(
    tables: Tables, done: Searched, leaving: Leaving, row: IntArray, which: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Barycentric coordinates (k, 3) of the starts, and directions (k, 2), of paths from segments (k,) to vertices."""
    segments = done.starts.segments
    sides = tables.edges.length.reshape(-1, 3)[segments.faces]
    # The segments as complex numbers in the planes of their faces.
    corners = lay_out(sides) @ np.array([1, 1j])
    start, end = np.einsum("qec,qc->eq", segments.barycentric, corners)
    length = np.maximum(np.abs(end - start), np.finfo(float).tiny)
    unit = (end - start) / length
    along, side = leaving.direction[row].T
    way = 1j * side * unit[which]
    # For corners of the same face: the nearest point of the segment.
    inside = np.flatnonzero(done.found.entered[row] < 0)
    if len(inside):
        i = which[inside]
        at = tables.edges.vertex.reshape(-1, 3)[segments.faces[i]] == row[inside, None]
        ahead = corners[i, at.argmax(axis=1)]
        along[inside] = np.clip(((ahead - start[i]) * unit[i].conj()).real, 0.0, length[i])
        way[inside] = ahead - start[i] - along[inside] * unit[i]
    share = np.clip(along / length[which], 0.0, 1.0)[:, None]
    ends = segments.barycentric[which]
    return (1 - share) * ends[:, 0] + share * ends[:, 1], np.stack([way.real, way.imag], axis=1)
