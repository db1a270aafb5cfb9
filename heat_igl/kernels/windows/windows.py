"""Continuous Dijkstra: lists of windows cross their faces in ascending order of their keys, until the result is known.

Called from Python: `search` for one set of sources (on two threads after `pair`, see `sharing`), and `search_each` for
many vertices.
"""

import cython
import numpy as np
from cython.cimports.cpython.pythread import (
    WAIT_LOCK,
    PyThread_acquire_lock,
    PyThread_allocate_lock,
    PyThread_free_lock,
)
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.signals import is_interrupted
from cython.cimports.heat_igl.kernels.windows.crossing import cross, over_corners
from cython.cimports.heat_igl.kernels.windows.emission import emit_point, emit_segment, emit_vertex
from cython.cimports.heat_igl.kernels.windows.front import (
    aim_at,
    allocate,
    empty_front,
    free_front,
    pop,
    push,
    start_at,
)
from cython.cimports.heat_igl.kernels.windows.sharing import balance, load, meet
from cython.cimports.heat_igl.kernels.windows.structures import MARGIN, Entry, Search, p_search
from cython.cimports.libc.math import INFINITY
from cython.cimports.libc.stdlib import free

# After this number of windows and comparisons, some milliseconds, signals are checked.
_ASK = cython.declare(cython.longlong, 50_000)
# A search ends in vain after so many for each half-edge: on surfaces that are stretched by 1e10, paths that wind around
# them are equal to rounding. Others take up to 120, and fans of 2048 triangles 1400.
_MOST = cython.declare(cython.longlong, 100_000)


@cython.final
@cython.cclass
class Front:
    """A surface and the result arrays of its searches, for `search` or `search_each`.

    `tables` are m triangles on n vertices; searches add to their array of kinds of vertices, all the same entries.
    `found` takes distances and the origins of shortest paths at the n vertices, and labels for all source points and
    segments as well. A window is trimmed where another path is shorter by more than the fraction `tolerance` of the
    distance. On surfaces with consistently oriented faces, `leaving` takes the directions in which the last straight
    parts of paths leave their roots, see `front.relax`. With `position` (3 n,), the positions of the vertices in the
    unit of the lengths, a search of `search_each` for a single goal drops windows whose straight distance to the goal
    is too large.
    """

    state: Search
    arrays: object

    def __init__(
        self, tables, found, tolerance: cython.double, leaving=None, position: cython.const[cython.double][::1] = None
    ) -> None:
        s: p_search = cython.address(self.state)
        emitted, ranked, touched = np.full(tables.n, np.inf), np.empty(tables.n), np.empty(tables.n, np.int32)
        slot = np.full(len(tables.edges.vertex), -1, np.int32)
        # The pointers hold as long as the arrays do.
        self.arrays = (tables, found, leaving, position, emitted, ranked, touched, slot)
        edges = tables.edges
        s.vertex, s.twin, s.ring = _ints(edges.vertex), _ints(edges.twin), _ints(edges.ring)
        s.aligned, s.length = _bytes(edges.aligned), _doubles(edges.length)
        s.kind, s.double_area, s.bulge = _bytes(tables.kind), _doubles(tables.double_area), _doubles(tables.bulge)
        s.corner_of_vertex, s.next_corner = _ints(tables.corner_of_vertex), _ints(tables.next_corner)
        s.n_corners = _ints(tables.n_corners)
        s.is_delaunay = tables.is_delaunay
        s.n, s.n_half_edges = tables.n, len(edges.vertex)
        s.distance, s.root, s.label = _doubles(found.distance), _ints(found.root), _ints(found.label)
        s.entered, s.crossing = _ints(found.entered), _doubles(found.crossing)
        s.emitted, s.ranked, s.touched, s.slot = _doubles(emitted), _doubles(ranked), _ints(touched), _ints(slot)
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


def _ints(array):
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


def _doubles(array):
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


def _bytes(array):
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
    """Exact distances from vertices, points and segments; false if memory runs out, or the search would not end.

    A front serves one search only; of a pair (see `pair`), one gets all sources and the other none. A source of
    `starts` on a side is listed once for every face there, and the ends of segments must be among the points. With
    `stops_early`, the search ends when the distances of the vertices `goal` and of all points `targets` are known.
    Distances up to the cutoff are exact, larger ones may be too large. `statistics` (3,) takes the numbers of
    comparisons with kept windows (-1 if the search would not end), of windows, and of lists that crossed a face.
    """
    s: p_search = cython.address(front.state)
    source: cython.int[::1] = starts.vertices
    offset: cython.double[::1] = starts.offset
    # Sources inside faces.
    point: cython.double[:, ::1] = starts.points.barycentric
    segment: cython.double[:, :, ::1] = starts.segments.barycentric
    s.n_points, s.n_segments = point.shape[0], segment.shape[0]
    s.point_face, s.point_offset = _ints(starts.points.faces), _doubles(starts.point_offset)
    s.point = cython.NULL if s.n_points == 0 else cython.address(point[0, 0])
    s.segment_face, s.segment_offset = _ints(starts.segments.faces), _doubles(starts.segment_offset)
    s.segment = cython.NULL if s.n_segments == 0 else cython.address(segment[0, 0, 0])
    found = targets.found
    target: cython.double[:, ::1] = targets.place.barycentric
    s.n_targets = target.shape[0]
    s.target = cython.NULL if s.n_targets == 0 else cython.address(target[0, 0])
    s.first_target, s.next_target = _ints(targets.first), _ints(targets.following)
    s.target_face = _ints(targets.place.faces)
    s.target_distance, s.target_root = _doubles(found.distance), _ints(found.root)
    s.target_entered, s.target_crossing = _ints(found.entered), _doubles(found.crossing)
    s.slack = targets.largest_circle
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
            _run_beside(s)
        elif not s.failed:
            _run(s)
        empty_front(s)
        free_front(s)
    statistics[0] = -1 if s.is_endless else s.n_compared
    statistics[1] = s.n_windows
    statistics[2] = s.n_lists_done
    return not s.failed


def _write_within(s, name, to, value, way, line):
    """Store the vertices within the cutoff, their distances and, unless `way` is NULL, their paths; returns the number.

    `way` takes the root of a path, the corner through which it leaves the root, and the half-edge by which it enters
    its last face; `line` takes the direction in the frame of the corner (2) and the crossing of the half-edge.
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


def _write_nearest(s, name, to, value):
    """Store the nearest vertices by ascending distance, ties by ascending name; returns their number."""
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
    """A separate search from each vertex of `source` (k,); returns the number of sources done.

    It is -1 if memory ran out, and -2 if a search would not end.

    Each search ends early and resets the entries that it changed, so its cost does not depend on the size of the mesh.
    The front must be in its initial state, and is left in it.

    Source i finds the distances of ``goal[first_goal[i] : first_goal[i + 1]]``. Without goals, it finds all vertices up
    to the cutoff, or if `n_nearest` is not 0, the nearest `n_nearest` of them.

    `found` and `value` (r,) take vertices, by their `name` (n,), and distances, source after source, and `end` (k,) the
    end of each source's results; with goals there is one value per goal, and `found` is not used. The function stops at
    the first source whose results do not fit. If `way` and `line` (r, 3) are not empty, on a front with `leaving`, they
    take the path to each vertex within the cutoff, see `_write_within`, in the numbering of the tables.
    """
    s: p_search = cython.address(front.state)
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
                _run(s)
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
                        _narrow(s)
                    at += _write_nearest(s, names, to, distance)
                else:
                    ways: cython.p_int = cython.address(way[at, 0]) if way.shape[0] > 0 else cython.NULL
                    lines: cython.p_double = cython.address(line[at, 0]) if way.shape[0] > 0 else cython.NULL
                    at += _write_within(s, names, to, distance, ways, lines)
            end[i] = at
            n_done += 1
            _forget(s)
        _forget(s)
        free_front(s)
    if s.failed:
        return -2 if s.is_endless else -1
    return n_done


def pair(
    first: Front,
    second: Front,
    upper: cython.double[::1],
    other_upper: cython.double[::1],
    round_length: cython.double,
    plenty: cython.longlong,
) -> None:
    """Prepare two fronts to share a search: call `search` on both, on one with all sources, on the other with none.

    They share the array `kind`; result arrays are separate, and the distance of a vertex is the smaller of the two.
    `upper` and `other_upper` (n,) bound the distances, see `bound`; infinity for no bound. The threads exchange
    distances after every `round_length`. They start to share the front when about `plenty` windows wait, and one
    continues alone when less than a third of that is left.
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
    """Restrict a search to distances below `upper` (n,), which is updated to the distances found."""
    front.arrays += (upper.base,)
    front.state.upper = cython.address(upper[0])


@cython.cfunc
def _join(one: Front, other: Front) -> None:
    s: p_search = cython.address(one.state)
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
    """Free what `pair` allocated; false if bits may differ from those of one thread, which must then search again."""
    one: Front
    for one in (first, second):
        s: p_search = cython.address(one.state)
        s.other = cython.NULL
        for i in range(2):
            free(s.news[i])
        for i in range(4):
            PyThread_free_lock(s.arrived[i])
    return not (first.state.is_shared and (first.state.meets_ties or second.state.meets_ties))


def _all_found(s, key):
    """Whether all requested distances are final: entries with this key or a larger one cannot change them."""
    while s.n_found < s.n_goals:
        if s.distance[s.goal[s.n_found]] > key:
            return False
        s.n_found += 1
    while s.n_found < s.n_goals + s.n_targets:
        j = s.n_found - s.n_goals
        over_corners(s, j)
        # A window may reach a point of a face before it has left the circumcircle of the face.
        if s.target_distance[j] + s.slack > key:
            return False
        s.n_found += 1
    return True


def _carry(s, entry):
    """Process a queue entry unless it is outdated: a list crosses its face, or a vertex or source emits windows."""
    if entry.what < s.n_half_edges:
        place = s.slot[entry.what]
        if place >= 0 and s.lists[place].key == entry.key:
            cross(s, entry.what)
            work: cython.longlong = s.n_windows + s.n_compared
            if work >= s.next_question:
                s.next_question = work + _ASK
                s.is_endless = work - s.before > _MOST * s.n_half_edges
                if s.is_endless or is_interrupted():
                    s.failed = True
        return
    v = entry.what - s.n_half_edges
    if v >= s.n + s.n_points:
        emit_segment(s, v - s.n - s.n_points)
    elif v >= s.n:
        emit_point(s, v - s.n)
    elif entry.key == s.upper[v] and s.emitted[v] > entry.key:
        emit_vertex(s, v)


def _first(s):
    """Pop the first entry of the queue, and prefetch the data of the next one."""
    first: Entry = pop(s)
    h: cython.int = s.heap[0].what
    if s.n_heap > 0 and h >= s.n_half_edges:
        h -= s.n_half_edges
        prefetch(s.upper + h)
        prefetch(s.emitted + h)
        prefetch(s.entered + h)
    elif s.n_heap > 0:
        prefetch(s.length + h)
        prefetch(s.vertex + h)
        prefetch(s.twin + h)
        prefetch(s.double_area + h // 3)
        place = s.slot[h]
        if place >= 0:
            prefetch(s.lists[place].windows)
            prefetch(s.lists[place].windows + 1)
            prefetch(s.lists[place].windows + 2)
            prefetch(s.lists[place].windows + 3)
    return first


def _run(s):
    """Process queue entries in ascending order of their keys until the requested distances are final."""
    entry: Entry
    s.last_key = s.cutoff * (1.0 + MARGIN) + s.slack
    while s.n_heap > 0 and not s.failed:
        if s.n_nearest > 0 and s.n_touched >= s.n_next:
            _narrow(s)
            s.last_key = s.cutoff * (1.0 + MARGIN)
        entry = _first(s)
        if entry.key > s.last_key:
            break
        if s.stops_early:
            if _all_found(s, entry.key):
                break
            if s.n_targets == 0 and s.n_found + 1 == s.n_goals:
                s.last_key = min(s.last_key, s.distance[s.goal[s.n_found]] * (1.0 + MARGIN))
        _carry(s, entry)
    for j in range(s.n_targets):
        over_corners(s, j)


def _narrow(s):
    """Lower the cutoff to a distance within which the requested number of vertices are known to lie."""
    i: cython.int
    j: cython.int
    low: cython.int = 0
    high: cython.int = s.n_touched - 1
    wanted: cython.int = s.n_nearest - 1
    for i in range(s.n_touched):
        s.ranked[i] = s.distance[s.touched[i]]
    # Quickselect, Hoare 1961.
    while low < high:
        pivot = s.ranked[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while s.ranked[i] < pivot:
                i += 1
            while s.ranked[j] > pivot:
                j -= 1
            if i <= j:
                s.ranked[i], s.ranked[j] = s.ranked[j], s.ranked[i]
                i += 1
                j -= 1
        if wanted <= j:
            high = j
        elif wanted >= i:
            low = i
        else:
            break
    if s.ranked[wanted] < s.cutoff:
        s.cutoff = s.ranked[wanted]
    s.n_next = s.n_touched + s.n_nearest // 4 + 1


def _forget(s):
    """Reset the entries that a search wrote, for the next search on the same front."""
    empty_front(s)
    s.before = s.n_windows + s.n_compared
    for i in range(s.n_touched):
        v = s.touched[i]
        s.distance[v] = s.emitted[v] = INFINITY
        s.root[v] = s.label[v] = s.entered[v] = -1
        if s.corner != cython.NULL:
            s.corner[v] = -1
    s.n_touched = s.n_found = 0


def _advance(s, until):
    """Process entries with keys below `until`; if that is infinite, until there is enough work for two threads."""
    entry: Entry
    while s.n_heap > 0 and s.heap[0].key < until and s.heap[0].key <= s.last_key and not s.failed:
        if until == INFINITY and load(s) > s.plenty and not s.meets_ties:
            return
        entry = _first(s)
        _carry(s, entry)


def _run_beside(s):
    """`_run` for one of two searches on two threads; both return after the same round."""
    o: p_search = s.other
    s.last_key = s.cutoff * (1.0 + MARGIN)
    while True:
        p = s.parity
        s.first_key[p] = s.heap[0].key if s.n_heap > 0 else INFINITY
        s.load[p] = load(s)
        s.has_failed[p], s.met_ties[p] = s.failed, s.meets_ties
        meet(s, p)
        # Distances that the other search has found are upper bounds.
        for i in range(o.n_news[p]):
            v: cython.int = o.news[p][i].what
            s.upper[v] = min(s.upper[v], o.news[p][i].key)
        key = min(s.first_key[p], o.first_key[p])
        if s.has_failed[p] or o.has_failed[p] or key == INFINITY or key > s.last_key:
            break
        if s.is_shared and (s.met_ties[p] or o.met_ties[p]):
            break
        is_alone = balance(s)
        s.parity = 1 - p
        s.n_news[s.parity] = 0
        _advance(s, INFINITY if is_alone else key + s.round_length)
