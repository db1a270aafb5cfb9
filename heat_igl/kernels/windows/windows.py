"""What Python calls: `search` from one set of sources, shared by two threads after `pair`, and `search_each`."""

import cython
import numpy as np
from cython.cimports.cpython.pythread import (
    WAIT_LOCK,
    PyThread_acquire_lock,
    PyThread_allocate_lock,
    PyThread_free_lock,
)
from cython.cimports.heat_igl.kernels.windows.front import aim_at, allocate, empty_front, free_front, push
from cython.cimports.heat_igl.kernels.windows.search import forget, narrow, run, run_beside
from cython.cimports.heat_igl.kernels.windows.sources import start_at
from cython.cimports.heat_igl.kernels.windows.structures import Search
from cython.cimports.libc.stdlib import free


class Front:
    """A surface, and the arrays that searches on it write, for `search` or `search_each`.

    Parameters
    ----------
    tables : Tables
        m triangles on n vertices, see `heat_igl.windows.tables.Tables`. The kinds of vertices are filled further,
        the same by every search.
    found : Found
        Takes distances, and where the shortest paths come from, see `heat_igl.windows.exact.Found`: nothing
        found yet at n vertices, with labels for as many source points and segments as there will be.
    tolerance : float
        A window is cut where another path is shorter by more than this fraction of the distance.
    leaving : Leaving, optional
        Takes in which direction the straight last parts of the paths leave their roots, see `front.relax`:
        on surfaces whose faces are oriented alike.
    position : (3 n,), optional
        Positions of the vertices, in the unit of the lengths. With one goal for a source, `search_each` uses them to
        leave out vertices that are too far from the goal along straight lines.
    """

    def __init__(
        self,
        tables,
        found,
        tolerance: cython.double,
        leaving=None,
        position: cython.const[cython.double][::1] = None,
    ) -> None:
        s: cython.pointer(Search) = cython.address(self.state)
        emitted, touched = np.full(tables.n, np.inf), np.empty(tables.n, np.int32)
        slot = np.full(len(tables.edges.vertex), -1, np.int32)
        # The pointers hold as long as the arrays do.
        self.arrays = (tables, found, leaving, position, emitted, touched, slot)
        _take_surface(s, tables)
        s.distance, s.root, s.label = _doubles(found.distance), _ints(found.root), _ints(found.label)
        s.entered, s.crossing = _ints(found.entered), _doubles(found.crossing)
        s.emitted, s.touched, s.slot = _doubles(emitted), _ints(touched), _ints(slot)
        s.upper, s.other = s.distance, cython.NULL
        s.corner = cython.NULL
        if leaving is not None:
            s.corner, s.leaving = _ints(leaving.corner), _doubles(leaving.direction.ravel())
        s.position = cython.NULL
        if position is not None:
            s.position = cython.cast(cython.p_double, cython.address(position[0]))
        s.aim = -1
        s.tolerance = tolerance
        s.n_points = s.n_segments = s.n_targets = s.n_goals = 0
        s.first_target = cython.NULL


@cython.cfunc
@cython.exceptval(check=True)
def _take_surface(s: cython.pointer(Search), tables) -> cython.void:
    edges = tables.edges
    s.vertex, s.twin, s.ring = _ints(edges.vertex), _ints(edges.twin), _ints(edges.ring)
    s.aligned, s.length = _bytes(edges.aligned), _doubles(edges.length)
    s.kind, s.double_area, s.bulge = _bytes(tables.kind), _doubles(tables.double_area), _doubles(tables.bulge)
    s.corner_of_vertex, s.next_corner = _ints(tables.corner_of_vertex), _ints(tables.next_corner)
    s.n_corners = _ints(tables.n_corners)
    s.is_delaunay = tables.is_delaunay
    s.n, s.n_half_edges = tables.n, len(edges.vertex)


@cython.cfunc
def _ints(array: cython.int[::1]) -> cython.p_int:
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


@cython.cfunc
def _doubles(array: cython.double[::1]) -> cython.p_double:
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


@cython.cfunc
def _bytes(array: cython.uchar[::1]) -> cython.p_uchar:
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


def search(
    front: Front,
    starts,
    goal: cython.int[::1],
    targets,
    stops_early: bool,
    cutoff: cython.double,
    statistics: cython.longlong[::1],
) -> bool:
    """Exact distances from vertices, points and segments; false if memory runs out.

    Parameters
    ----------
    front : Front
        Used for one search only; its labels have room for the source points and segments. Of a pair (see
        `pair`), one gets all sources and the other none.
    starts : Starts
        The sources, see `heat_igl.windows.exact.Starts`. A source on a side is listed once for every face
        there, and the ends of segments must be among the points.
    goal : (g,)
        With `stops_early`, the search ends when the distances of these vertices and of all targets are known.
    targets : Targets
        Points whose distance is asked for, see `heat_igl.windows.exact.Targets`.
    cutoff : float
        Distances up to here are exact, larger ones may be too large.
    statistics : (3,)
        Takes the numbers of vertices that were reached, of windows, and of lists that crossed a face.
    """
    s: cython.pointer(Search) = cython.address(front.state)
    source: cython.int[::1] = starts.vertices
    offset: cython.double[::1] = starts.offset
    _take_sources(s, starts)
    _take_targets(s, targets)
    s.n_goals = goal.shape[0]
    s.goal = _ints(goal)
    s.stops_early = stops_early
    s.cutoff = cutoff
    with cython.nogil:
        allocate(s)
        for i in range(source.shape[0]):
            start_at(s, source[i], offset[i], i)
        for i in range(s.n_points + s.n_segments):
            if not s.failed:
                s.label[s.n + i] = source.shape[0] + i
                begin: cython.double = s.point_offset[i] if i < s.n_points else s.segment_offset[i - s.n_points]
                push(s, begin, s.n_half_edges + s.n + i)
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


@cython.cfunc
@cython.exceptval(check=True)
def _take_sources(s: cython.pointer(Search), starts) -> cython.void:
    """Sources inside faces."""
    point: cython.double[:, ::1] = starts.points.barycentric
    segment: cython.double[:, :, ::1] = starts.segments.barycentric
    s.n_points, s.n_segments = point.shape[0], segment.shape[0]
    s.point_face, s.point_offset = _ints(starts.points.faces), _doubles(starts.point_offset)
    s.point = cython.NULL if s.n_points == 0 else cython.address(point[0, 0])
    s.segment_face, s.segment_offset = _ints(starts.segments.faces), _doubles(starts.segment_offset)
    s.segment = cython.NULL if s.n_segments == 0 else cython.address(segment[0, 0, 0])


@cython.cfunc
@cython.exceptval(check=True)
def _take_targets(s: cython.pointer(Search), targets) -> cython.void:
    found = targets.found
    target: cython.double[:, ::1] = targets.place.barycentric
    s.n_targets = target.shape[0]
    s.target = cython.NULL if s.n_targets == 0 else cython.address(target[0, 0])
    s.first_target, s.next_target = _ints(targets.first), _ints(targets.following)
    s.target_face = _ints(targets.place.faces)
    s.target_distance, s.target_root = _doubles(found.distance), _ints(found.root)
    s.target_entered, s.target_crossing = _ints(found.entered), _doubles(found.crossing)
    s.slack = targets.largest_circle


@cython.cfunc
@cython.nogil
def _write_within(
    s: cython.pointer(Search),
    name: cython.p_longlong,
    to: cython.p_int,
    value: cython.p_double,
    way: cython.p_int,
    line: cython.p_double,
) -> cython.int:
    """Store the vertices within the cutoff and their distances, and unless `way` is NULL, the paths; their number.

    Of each path the root, the corner out of which it leaves that and the half-edge by which it enters its last face;
    and the direction out of the corner and the crossing of the half-edge.
    """
    n: cython.int = 0
    for i in range(s.n_touched):
        v: cython.int = s.touched[i]
        if s.distance[v] <= s.cutoff:
            to[n] = name[v]
            value[n] = s.distance[v]
            if way != cython.NULL:
                way[3 * n] = s.root[v]
                way[3 * n + 1] = s.corner[v]
                way[3 * n + 2] = s.entered[v]
                line[3 * n] = s.leaving[2 * v]
                line[3 * n + 1] = s.leaving[2 * v + 1]
                line[3 * n + 2] = s.crossing[v]
            n += 1
    return n


@cython.cfunc
@cython.nogil
def _write_nearest(
    s: cython.pointer(Search), name: cython.p_longlong, to: cython.p_int, value: cython.p_double
) -> cython.int:
    """Store the nearest vertices in order, equally near ones by ascending name; returns their number."""
    n: cython.int = 0
    for i in range(s.n_touched):
        v: cython.int = s.touched[i]
        d: cython.double = s.distance[v]
        if d > s.cutoff:
            continue
        if n < s.n_nearest:
            n += 1
        elif d > value[n - 1] or (d == value[n - 1] and name[v] > to[n - 1]):
            continue
        j: cython.int = n - 1
        while j > 0 and (d < value[j - 1] or (d == value[j - 1] and name[v] < to[j - 1])):
            value[j] = value[j - 1]
            to[j] = to[j - 1]
            j -= 1
        value[j] = d
        to[j] = name[v]
    return n


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
    way: cython.int[:, ::1],
    line: cython.double[:, ::1],
) -> int:
    """Search from one vertex after the other; returns the number of sources done, -1 if memory ran out.

    Searches end early, and clear the entries that they changed, so the cost does not depend on the size of the mesh.

    Parameters
    ----------
    front : Front
        In its initial state, to which it returns.
    source : (k,)
        Vertices that distance starts from, each alone.
    goal, first_goal : (g,), (k + 1,)
        If not empty: the distances of ``goal[first_goal[i]:first_goal[i + 1]]`` are asked for from source i.
    cutoff : float
        Without goals: all vertices up to this distance are asked for.
    n_nearest : int
        At most this many of them, the nearest; 0 for all.
    name : (n,)
        The number by which `found` refers to each vertex.
    found, value : (r,)
        Take vertices and their distances, source after source. The search stops at the first source whose results do
        not fit.
    end : (k,)
        Takes the end of the results of each source. With goals each result is one value, and `found` is not used.
    way, line : (r, 3)
        If not empty, on a front that finds in which direction paths leave: take how the path to each vertex within the
        cutoff runs, see `_write_within`, by the numbers of the tables.
    """
    s: cython.pointer(Search) = cython.address(front.state)
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
                to: cython.p_int = cython.address(found[0]) + at
                distance: cython.p_double = cython.address(value[0]) + at
                if n_nearest > 0:
                    if s.n_touched >= n_nearest:
                        narrow(s)
                    at += _write_nearest(s, names, to, distance)
                elif way.shape[0] > 0:
                    at += _write_within(s, names, to, distance, cython.address(way[at, 0]), cython.address(line[at, 0]))
                else:
                    at += _write_within(s, names, to, distance, cython.NULL, cython.NULL)
            end[i] = at
            n_done += 1
            forget(s)
        forget(s)
        free_front(s)
    return -1 if s.failed else n_done


def pair(
    first: Front,
    second: Front,
    upper: cython.double[::1],
    other_upper: cython.double[::1],
    round_length: cython.double,
    plenty: cython.longlong,
) -> None:
    """Prepare two fronts to share a search: `search` is called on both, on one with all sources, on the other with
    none.

    Parameters
    ----------
    first, second : Front
        The two fronts. Each has result arrays of its own; they share `kind` only. The distance of a vertex is the
        smaller of the two that they find.
    upper, other_upper : (n,)
        Upper bounds on distances, see `bound`; infinity if there are none.
    round_length : float
        How far the search goes before the threads exchange distances.
    plenty : int
        With about this many windows on the front there is work for two threads. With less than a third, one goes on
        alone.
    """
    bound(first, upper)
    bound(second, other_upper)
    _join(first, second)
    _join(second, first)
    first.state.round_length = second.state.round_length = round_length
    first.state.plenty = second.state.plenty = plenty
    first.state.few = second.state.few = plenty // 3
    first.state.is_first, second.state.is_first = True, False


def bound(front: Front, upper: cython.double[::1]) -> None:
    """Let a search find only distances that are smaller than `upper` (n,), which takes those that it finds."""
    front.arrays += (upper.base,)
    front.state.upper = cython.address(upper[0])


@cython.cfunc
def _join(one: Front, other: Front) -> None:
    s: cython.pointer(Search) = cython.address(one.state)
    s.other = cython.address(other.state)
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
    """Free what `pair` allocated; false if one thread must search again to get the bits of a search on one thread."""
    one: Front
    for one in (first, second):
        s: cython.pointer(Search) = cython.address(one.state)
        s.other = cython.NULL
        for i in range(2):
            free(s.news[i])
        for i in range(4):
            PyThread_free_lock(s.arrived[i])
    return not (first.state.is_shared and (first.state.meets_flat or second.state.meets_flat))
