"""Exact distance by windows: continuous Dijkstra over the faces of an intrinsic triangulation.

A *window* is the part of a half-edge that straight lines from one root cross, all through the same faces; the root laid
out in the plane before the half-edge gives the distance of every point of the window (Mitchell, Mount, Papadimitriou
1987). Windows that enter a face over the same side wait there in one list and cross the face together, as in Qin et al.
2016; the order of the lists is different here, see `window_lists`. Before a list crosses its face, windows lose what
another path reaches sooner (`window_trimming`), and what would cross a shorter way to the corner ahead
(`window_crossing`). A vertex gets windows of its own where shortest paths can bend (`window_sources`).

This module has what Python calls: `search` for one question about all vertices, `search_each` for many local ones.
"""

import cython
from cython.cimports.cpython.pythread import (
    WAIT_LOCK,
    PyThread_acquire_lock,
    PyThread_allocate_lock,
    PyThread_free_lock,
)
from cython.cimports.heat_igl.kernels.window_lists import allocate, empty_front, free_front, push
from cython.cimports.heat_igl.kernels.window_search import forget, narrow, run
from cython.cimports.heat_igl.kernels.window_sharing import run_beside
from cython.cimports.heat_igl.kernels.window_sources import aim_at, start_at
from cython.cimports.heat_igl.kernels.window_structures import Search
from cython.cimports.libc.stdlib import free

__all__ = ["Front", "assist", "pair", "part", "search", "search_each"]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _write_within(
    s: cython.pointer(Search), name: cython.p_longlong, to: cython.p_int, value: cython.p_double
) -> cython.int:
    """All vertices within the cutoff and their distances; how many they are."""
    i: cython.int
    v: cython.int
    n: cython.int = 0
    for i in range(s.n_touched):
        v = s.touched[i]
        if s.distance[v] <= s.cutoff:
            to[n] = name[v]
            value[n] = s.distance[v]
            n += 1
    return n


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _write_nearest(
    s: cython.pointer(Search), name: cython.p_longlong, to: cython.p_int, value: cython.p_double
) -> cython.int:
    """The nearest vertices, of equally near ones those with the lowest names, in order; how many they are."""
    i: cython.int
    j: cython.int
    v: cython.int
    n: cython.int = 0
    d: cython.double
    for i in range(s.n_touched):
        v = s.touched[i]
        d = s.distance[v]
        if d > s.cutoff:
            continue
        if n < s.n_nearest:
            n += 1
        elif d > value[n - 1] or (d == value[n - 1] and name[v] > to[n - 1]):
            continue
        j = n - 1
        while j > 0 and (d < value[j - 1] or (d == value[j - 1] and name[v] < to[j - 1])):
            value[j] = value[j - 1]
            to[j] = to[j - 1]
            j -= 1
        value[j] = d
        to[j] = name[v]
    return n


class Front:
    """A surface, and what searches on it write; `search` and `search_each` say in which state.

    Parameters
    ----------
    vertex, length, twin, double_area, bulge, corner_of_vertex, next_corner, n_corners, kind
        As `window_surface.shapes` takes and fills them. `kind` is filled further, the same by every search.
    aligned : (3 m,)
        Whether the faces at a glued half-edge run along it in opposite directions.
    ring : (3 m,)
        Where more than two faces meet, the next half-edge of the same edge.
    is_delaunay : bool
        What `shapes` returned.
    distance, emitted : (n,)
        Must come full of infinity; the first takes distances.
    root, label, entered, crossing : (n,), (n + p + q,), (n,), (n,)
        Take where the shortest paths come from; see `heat_igl.unfolding.exact.Origin`. They must come full of -1.
    touched : (n,)
        Takes the vertices that were reached.
    slot : (3 m,)
        Must come full of -1, and is again after a search.
    corner, leaving : (n,), (2 n,), optional
        Take in which direction the straight last parts of the paths leave their roots, see `window_sources.relax`: on
        surfaces whose faces are oriented alike.
    tolerance : float
        The fraction of a distance by which another way must be shorter before a window is cut.
    position : (3 n,), optional
        Of the vertices in space, in the unit of the lengths. With one goal for a source, `search_each` then leaves out
        what is too far from it along straight lines.
    """

    def __init__(
        self,
        vertex: cython.int[::1],
        length: cython.double[::1],
        twin: cython.int[::1],
        aligned: cython.uchar[::1],
        ring: cython.int[::1],
        double_area: cython.double[::1],
        bulge: cython.double[::1],
        corner_of_vertex: cython.int[::1],
        next_corner: cython.int[::1],
        n_corners: cython.int[::1],
        kind: cython.uchar[::1],
        is_delaunay: bool,
        distance: cython.double[::1],
        emitted: cython.double[::1],
        root: cython.int[::1],
        label: cython.int[::1],
        entered: cython.int[::1],
        crossing: cython.double[::1],
        touched: cython.int[::1],
        slot: cython.int[::1],
        tolerance: cython.double,
        corner: cython.int[::1] = None,
        leaving: cython.double[::1] = None,
        position: cython.const[cython.double][::1] = None,
    ) -> None:
        s: cython.pointer(Search) = cython.address(self.state)
        # The pointers hold as long as the arrays do.
        self.arrays = (
            vertex.base,
            length.base,
            twin.base,
            aligned.base,
            ring.base,
            double_area.base,
            bulge.base,
            corner_of_vertex.base,
            next_corner.base,
            n_corners.base,
            kind.base,
            distance.base,
            emitted.base,
            root.base,
            label.base,
            entered.base,
            crossing.base,
            touched.base,
            slot.base,
            corner,
            leaving,
            position,
        )
        s.vertex = cython.address(vertex[0])
        s.length = cython.address(length[0])
        s.twin = cython.address(twin[0])
        s.aligned = cython.address(aligned[0])
        s.ring = cython.address(ring[0])
        s.double_area = cython.address(double_area[0])
        s.bulge = cython.address(bulge[0])
        s.corner_of_vertex = cython.address(corner_of_vertex[0])
        s.next_corner = cython.address(next_corner[0])
        s.n_corners = cython.address(n_corners[0])
        s.kind = cython.address(kind[0])
        s.distance = cython.address(distance[0])
        s.upper = s.distance
        s.other = cython.NULL
        s.emitted = cython.address(emitted[0])
        s.root = cython.address(root[0])
        s.label = cython.address(label[0])
        s.entered = cython.address(entered[0])
        s.crossing = cython.address(crossing[0])
        s.touched = cython.address(touched[0])
        s.slot = cython.address(slot[0])
        s.corner = cython.NULL
        if corner is not None:
            s.corner = cython.address(corner[0])
            s.leaving = cython.address(leaving[0])
        s.position = cython.NULL
        if position is not None:
            s.position = cython.cast(cython.p_double, cython.address(position[0]))
        s.aim = -1
        s.is_delaunay = is_delaunay
        s.n = corner_of_vertex.shape[0]
        s.n_half_edges = vertex.shape[0]
        s.tolerance = tolerance
        s.n_points = s.n_segments = s.n_targets = s.n_goals = 0
        s.first_target = cython.NULL


def pair(
    first: Front,
    second: Front,
    upper: cython.double[::1],
    other_upper: cython.double[::1],
    round_length: cython.double,
    plenty: cython.longlong,
) -> None:
    """Let two searches on one surface go on side by side: `search` on the first, `assist` on the second.

    Parameters
    ----------
    first, second : Front
        For one search, with arrays of their own for what they write, but for `kind`. Each vertex has the smaller of
        the two distances that they find.
    upper, other_upper : (n,)
        Must come full of infinity.
    round_length : float
        How far the distance goes between two meetings.
    plenty : int
        About so many windows on the front are work for two threads. When less than a third is left, one goes on alone.
    """
    _join(first, upper, second)
    _join(second, other_upper, first)
    first.state.round_length = second.state.round_length = round_length
    first.state.plenty = second.state.plenty = plenty
    first.state.few = second.state.few = plenty // 3
    first.state.is_first, second.state.is_first = True, False


@cython.cfunc
def _join(one: Front, upper: cython.double[::1], other: Front) -> None:
    s: cython.pointer(Search) = cython.address(one.state)
    i: cython.int
    one.arrays += (upper.base,)
    s.other = cython.address(other.state)
    s.upper = cython.address(upper[0])
    s.parity = 0
    for i in range(2):
        s.news[i] = cython.NULL
        s.n_news[i] = s.n_all_news[i] = 0
    for i in range(4):
        s.arrived[i] = PyThread_allocate_lock()
        if s.arrived[i] == cython.NULL:
            raise MemoryError("there is no room for a lock")
        PyThread_acquire_lock(s.arrived[i], WAIT_LOCK)


def part(first: Front, second: Front) -> bool:
    """Return what `pair` took; whether the distances are those of one thread to the bit, otherwise it must search."""
    one: Front
    s: cython.pointer(Search)
    i: cython.int
    for one in (first, second):
        s = cython.address(one.state)
        s.other = cython.NULL
        for i in range(2):
            free(s.news[i])
        for i in range(4):
            PyThread_free_lock(s.arrived[i])
    return not (first.state.is_shared and (first.state.meets_flat or second.state.meets_flat))


def assist(front: Front, cutoff: cython.double, statistics: cython.longlong[::1]) -> bool:
    """Take a part of the search that the other front of a `pair` begins; parameters and result as for `search`."""
    s: cython.pointer(Search) = cython.address(front.state)
    s.stops_early = False
    s.slack = 0.0
    s.cutoff = cutoff
    with cython.nogil:
        allocate(s)
        run_beside(s)
        empty_front(s)
        free_front(s)
    statistics[0] = s.n_touched
    statistics[1] = s.n_windows
    statistics[2] = s.n_lists_done
    return not s.failed


def search_each(
    front: Front,
    source: cython.int[::1],
    goal: cython.int[::1],
    first_goal: cython.longlong[::1],
    cutoff: cython.double,
    n_nearest: cython.int,
    name: cython.longlong[::1],
    found: cython.int[::1],
    value: cython.double[::1],
    end: cython.longlong[::1],
) -> int:
    """Distances from one vertex after the other, each search ended early; how many sources were done, -1 for no memory.

    What a search touched is cleared after it, so that its cost depends on what is near alone.

    Parameters
    ----------
    front : Front
        In its first state, and in it again afterwards.
    source : (k,)
        Vertices that distance starts from, each alone.
    goal, first_goal : (g,), (k + 1,)
        The distances that are asked for, ``goal[first_goal[i]:first_goal[i + 1]]`` of source i, if there are any.
    cutoff : float
        Otherwise all vertices up to here are asked for,
    n_nearest : int
        and so many at most, the nearest; 0 for all.
    name : (n,)
        What vertices are called in `found`.
    found, value : (r,)
        Take vertices and their distances, source after source. The last source done is the last whose results had room.
    end : (k,)
        Takes where the results of each source end. Results for goals are one value each, and `found` is not used.
    """
    s: cython.pointer(Search) = cython.address(front.state)
    i: cython.int
    j: cython.longlong
    n_done: cython.int = 0
    at: cython.longlong = 0
    room: cython.longlong = value.shape[0]
    names: cython.p_longlong = cython.address(name[0])
    s.stops_early = goal.shape[0] > 0
    s.slack = 0.0
    with cython.nogil:
        allocate(s)
        for i in range(source.shape[0]):
            s.cutoff = cutoff
            s.n_nearest = s.n_next = n_nearest
            if s.stops_early:
                s.n_goals = cython.cast(cython.int, first_goal[i + 1] - first_goal[i])
                s.goal = cython.address(goal[0]) + first_goal[i]
            s.aim = -1
            if s.stops_early and s.n_goals == 1 and s.position != cython.NULL:
                aim_at(s, source[i], s.goal[0])
                s.cutoff = s.within
            start_at(s, source[i], 0.0, 0)
            if not s.failed:
                run(s)
            if s.failed:
                break
            if s.stops_early:
                for j in range(first_goal[i], first_goal[i + 1]):
                    value[j] = s.distance[goal[j]]
                at = first_goal[i + 1]
            else:
                if at + (n_nearest if n_nearest > 0 else s.n_touched) > room:
                    break
                if n_nearest > 0:
                    if s.n_touched >= n_nearest:
                        narrow(s)
                    at += _write_nearest(s, names, cython.address(found[0]) + at, cython.address(value[0]) + at)
                else:
                    at += _write_within(s, names, cython.address(found[0]) + at, cython.address(value[0]) + at)
            end[i] = at
            n_done += 1
            forget(s)
        forget(s)
        free_front(s)
    return -1 if s.failed else n_done


def search(
    front: Front,
    source: cython.int[::1],
    offset: cython.double[::1],
    point_face: cython.int[::1],
    point: cython.double[::1],
    point_offset: cython.double[::1],
    segment_face: cython.int[::1],
    segment: cython.double[::1],
    segment_offset: cython.double[::1],
    goal: cython.int[::1],
    first_target: cython.int[::1],
    next_target: cython.int[::1],
    target_face: cython.int[::1],
    target: cython.double[::1],
    target_distance: cython.double[::1],
    target_root: cython.int[::1],
    target_entered: cython.int[::1],
    target_crossing: cython.double[::1],
    slack: cython.double,
    stops_early: bool,
    cutoff: cython.double,
    statistics: cython.longlong[::1],
) -> bool:
    """Exact distances from vertices and points; false where memory runs out.

    Parameters
    ----------
    front : Front
        For one search alone, whose `label` has room for p source points and q segments.
    source, offset : (k,)
        Vertices that distance starts from, and the distance at which each starts.
    point_face, point, point_offset : (p,), (3 p,), (p,)
        Sources inside faces: face, barycentric coordinates, distance. A source on a side, with a coordinate of 0, comes
        once for every face there.
    segment_face, segment, segment_offset : (q,), (6 q,), (q,)
        Source segments inside faces, likewise: face, coordinates of one end and the other, distance. The ends must be
        among the points.
    goal : (g,)
        With `stops_early`, the search ends when the distances of these vertices and of all targets are known.
    first_target, next_target, target_face, target : (m,), (t,), (t,), (3 t,)
        Points whose distance is asked for, as linked lists by face, with their barycentric coordinates.
    target_distance, target_root, target_entered, target_crossing : (t,)
        As for vertices.
    slack : float
        Diameter of the largest circle around a face with targets.
    cutoff : float
        Distances up to here are exact, larger ones may be too large.
    statistics : (3,)
        Takes the numbers of vertices that were reached, of windows, and of lists that crossed a face.
    """
    s: cython.pointer(Search) = cython.address(front.state)
    i: cython.int
    s.n_points = point_face.shape[0]
    if s.n_points > 0:
        s.point_face = cython.address(point_face[0])
        s.point = cython.address(point[0])
        s.point_offset = cython.address(point_offset[0])
    s.n_segments = segment_face.shape[0]
    if s.n_segments > 0:
        s.segment_face = cython.address(segment_face[0])
        s.segment = cython.address(segment[0])
        s.segment_offset = cython.address(segment_offset[0])
    s.n_goals = goal.shape[0]
    if s.n_goals > 0:
        s.goal = cython.address(goal[0])
    s.n_targets = target_face.shape[0]
    if s.n_targets > 0:
        s.first_target = cython.address(first_target[0])
        s.next_target = cython.address(next_target[0])
        s.target_face = cython.address(target_face[0])
        s.target = cython.address(target[0])
        s.target_distance = cython.address(target_distance[0])
        s.target_root = cython.address(target_root[0])
        s.target_entered = cython.address(target_entered[0])
        s.target_crossing = cython.address(target_crossing[0])
    s.stops_early = stops_early
    s.slack = slack
    s.cutoff = cutoff
    with cython.nogil:
        allocate(s)
        for i in range(source.shape[0]):
            start_at(s, source[i], offset[i], i)
        for i in range(s.n_points):
            if not s.failed:
                s.label[s.n + i] = source.shape[0] + i
                push(s, point_offset[i], s.n_half_edges + s.n + i)
        for i in range(s.n_segments):
            if not s.failed:
                s.label[s.n + s.n_points + i] = source.shape[0] + s.n_points + i
                push(s, segment_offset[i], s.n_half_edges + s.n + s.n_points + i)
        if s.other != cython.NULL:
            run_beside(s)
        elif not s.failed:
            run(s)
        empty_front(s)
        free_front(s)
    statistics[0] = s.n_touched
    statistics[1] = s.n_windows
    statistics[2] = s.n_lists_done
    return not s.failed
