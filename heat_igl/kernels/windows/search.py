"""Continuous Dijkstra: lists of windows cross their faces in ascending order of distance, until the result is known.

One search may run on two threads: each carries the windows on a part of the front, with a queue, lists and distances of
its own. It works in rounds: up to a key that both have agreed on. After a round the threads exchange the distances that
they have found, and cut windows that are longer, as one thread would do. So only windows next to the border of the two
parts go further than in a search on one thread, by the length of a round. If one part has much less work left, it gets
a piece of the other. All decisions depend on the two queues alone, never on which thread is faster.

Rounding of a distance depends on the faces that the path crosses, not on the thread. The exception are the halves of a
window that are joined behind a flat vertex, since both must wait in one list: `run_beside` then ends, and one thread
repeats the search. Surfaces with flat parts have few windows anyway.
"""

import cython
from cython.cimports.cpython.pythread import NOWAIT_LOCK, WAIT_LOCK, PyThread_acquire_lock, PyThread_release_lock
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.signals import is_interrupted
from cython.cimports.heat_igl.kernels.windows.crossing import cross, over_corners
from cython.cimports.heat_igl.kernels.windows.front import append, empty_front, pop, push, release
from cython.cimports.heat_igl.kernels.windows.sources import emit_point, emit_segment, emit_vertex
from cython.cimports.heat_igl.kernels.windows.structures import (
    FLAT,
    MARGIN,
    PASSED,
    PER_LIST,
    TRIES,
    Entry,
    List,
    Search,
)
from cython.cimports.libc.math import INFINITY
from cython.cimports.libc.stdlib import free, malloc

# Lists that cross a face before a signal is asked for: some milliseconds.
_ASK = cython.declare(cython.longlong, 4096)


@cython.cfunc
@cython.nogil
def _all_found(s: cython.pointer(Search), key: cython.double) -> cython.bint:
    """Whether the result cannot change any more by windows with this key or a larger one."""
    while s.n_found < s.n_goals:
        if s.distance[s.goal[s.n_found]] > key:
            return False
        s.n_found += 1
    while s.n_found < s.n_goals + s.n_targets:
        j = s.n_found - s.n_goals
        over_corners(s, j)
        # A window may lead to a point of a face before it has left the circle around the face.
        if s.target_distance[j] + s.slack > key:
            return False
        s.n_found += 1
    return True


@cython.cfunc
@cython.inline
@cython.nogil
def carry(s: cython.pointer(Search), entry: Entry) -> cython.void:
    """Let a list cross its face, or windows leave a vertex, point or segment, unless the entry is out of date."""
    if entry.what < s.n_half_edges:
        place = s.slot[entry.what]
        if place >= 0 and s.lists[place].key == entry.key:
            cross(s, entry.what)
            if s.n_lists_done % _ASK == 0 and is_interrupted():
                s.failed = True
        return
    v = entry.what - s.n_half_edges
    if v >= s.n + s.n_points:
        emit_segment(s, v - s.n - s.n_points)
    elif v >= s.n:
        emit_point(s, v - s.n)
    elif entry.key == s.upper[v] and s.emitted[v] > entry.key:
        emit_vertex(s, v)


@cython.cfunc
@cython.inline
@cython.nogil
def _first(s: cython.pointer(Search)) -> Entry:
    """Take the first entry of the queue, and prefetch what the next one reads."""
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


def run(s: cython.pointer(Search)) -> cython.void:
    """Carry lists, and let windows leave vertices, points and segments, in ascending order of their keys."""
    entry: Entry
    s.last_key = s.cutoff * (1.0 + MARGIN) + s.slack
    while s.n_heap > 0 and not s.failed:
        if s.n_nearest > 0 and s.n_touched >= s.n_next:
            narrow(s)
            s.last_key = s.cutoff * (1.0 + MARGIN)
        entry = _first(s)
        if entry.key > s.last_key:
            break
        if s.stops_early:
            if _all_found(s, entry.key):
                break
            if s.n_targets == 0 and s.n_found + 1 == s.n_goals:
                s.last_key = min(s.last_key, s.distance[s.goal[s.n_found]] * (1.0 + MARGIN))
        carry(s, entry)
    for j in range(s.n_targets):
        over_corners(s, j)


def narrow(s: cython.pointer(Search)) -> cython.void:
    """Lower the cutoff to a distance within which the requested number of vertices are known to lie."""
    i: cython.int
    j: cython.int
    low: cython.int = 0
    high: cython.int = s.n_touched - 1
    wanted: cython.int = s.n_nearest - 1
    if s.n_touched > s.n_all_ranked:
        free(s.ranked)
        s.n_all_ranked = 2 * s.n_touched
        s.ranked = cython.cast(cython.p_double, malloc(s.n_all_ranked * cython.sizeof(cython.double)))
        if s.ranked == cython.NULL:
            s.n_all_ranked = 0
            s.failed = True
            return
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


def forget(s: cython.pointer(Search)) -> cython.void:
    """Clear the entries that a search wrote, for the next search on the same front."""
    empty_front(s)
    for i in range(s.n_touched):
        v = s.touched[i]
        s.distance[v] = s.emitted[v] = INFINITY
        s.root[v] = s.label[v] = s.entered[v] = -1
        if s.corner != cython.NULL:
            s.corner[v] = -1
    s.n_touched = s.n_found = 0


@cython.cfunc
@cython.nogil
def _advance(s: cython.pointer(Search), until: cython.double) -> cython.void:
    """Carry lists with keys below `until`; if that is infinite, until there is work for two threads."""
    entry: Entry
    while s.n_heap > 0 and s.heap[0].key < until and s.heap[0].key <= s.last_key and not s.failed:
        if until == INFINITY and _load(s) > s.plenty and not s.meets_flat:
            return
        entry = _first(s)
        carry(s, entry)


@cython.cfunc
@cython.inline
@cython.nogil
def _load(s: cython.pointer(Search)) -> cython.longlong:
    """Estimated work on the front, counted in windows; 0 if there is none."""
    return s.n_waiting + PER_LIST * s.n_heap


@cython.cfunc
@cython.nogil
def _meet(s: cython.pointer(Search), which: cython.int) -> cython.void:
    """Wait for the other thread: first without sleep, since rounds are short."""
    PyThread_release_lock(s.arrived[which])
    for _ in range(TRIES):
        if PyThread_acquire_lock(s.other.arrived[which], NOWAIT_LOCK):
            return
    PyThread_acquire_lock(s.other.arrived[which], WAIT_LOCK)


@cython.cfunc
@cython.nogil
def _hear(s: cython.pointer(Search), news: cython.pointer(Entry), n: cython.int) -> cython.void:
    """Take distances that the other search has found as upper bounds."""
    for i in range(n):
        if news[i].key < s.upper[news[i].what]:
            s.upper[news[i].what] = news[i].key


def run_beside(s: cython.pointer(Search)) -> cython.void:
    """As `run`, for one of two searches on two threads; both return at the same time."""
    o: cython.pointer(Search) = s.other
    s.last_key = s.cutoff * (1.0 + MARGIN)
    while True:
        p = s.parity
        s.first_key[p] = s.heap[0].key if s.n_heap > 0 else INFINITY
        s.load[p] = _load(s)
        s.has_failed[p], s.met_flat[p] = s.failed, s.meets_flat
        _meet(s, p)
        _hear(s, o.news[p], o.n_news[p])
        key = min(s.first_key[p], o.first_key[p])
        if s.has_failed[p] or o.has_failed[p] or key == INFINITY or key > s.last_key:
            break
        if s.is_shared and (s.met_flat[p] or o.met_flat[p]):
            break
        is_alone = _balance(s)
        s.parity = 1 - p
        s.n_news[s.parity] = 0
        _advance(s, INFINITY if is_alone else key + s.round_length)


@cython.cfunc
@cython.nogil
def _balance(s: cython.pointer(Search)) -> cython.bint:
    """Hand windows over if one thread has more work; true if one got all, because there is too little work for two."""
    o: cython.pointer(Search) = s.other
    mine: cython.longlong = s.load[s.parity]
    theirs: cython.longlong = o.load[s.parity]
    least: cython.longlong = (mine + theirs) // 8
    is_small: cython.bint = mine + theirs < s.few
    if (mine == 0 or theirs == 0) and (mine + theirs < s.plenty):
        return True
    if not is_small and mine - theirs <= least and theirs - mine <= least:
        return False
    s.is_shared = True
    _meet(s, 2)
    if is_small and not s.is_first:
        _hand_over(s, o, mine)
        s.n_heap = 0
    elif not is_small and mine > theirs:
        _hand_over(s, o, (mine - theirs) // 2)
    _meet(s, 3)
    return is_small


@cython.cfunc
@cython.nogil
def _next_seed(s: cython.pointer(Search)) -> cython.int:
    """A half-edge with windows that wait, if possible next to the part of the other thread; -1 if there is none."""
    seed: cython.int = -1
    for i in range(s.n_lists):
        h = s.lists[i].half_edge
        if h < 0:
            continue
        seed = h
        u, v = s.vertex[next_half_edge(h)], s.vertex[previous_half_edge(h)]
        if s.upper[u] < s.distance[u] or s.upper[v] < s.distance[v]:
            break
    return seed


@cython.cfunc
@cython.nogil
def _give_list(s: cython.pointer(Search), o: cython.pointer(Search), h: cython.int) -> cython.longlong:
    """Hand over the windows that wait at half-edge h; returns their work."""
    place: cython.int = s.slot[h]
    one: cython.pointer(List) = cython.address(s.lists[place])
    n: cython.int = one.count
    for i in range(n):
        o.label[one.windows[i].root] = s.label[one.windows[i].root]
    append(o, h, one.windows, n, False, False)
    o.n_windows -= n
    s.n_waiting -= n
    s.slot[h] = -1
    release(s, place)
    return n + PER_LIST


@cython.cfunc
@cython.nogil
def _give_vertex(s: cython.pointer(Search), o: cython.pointer(Search), v: cython.int) -> cython.longlong:
    """Hand over a vertex from which windows are to start; returns the work."""
    if (
        s.kind[v] == PASSED
        or s.kind[v] == FLAT
        or s.emitted[v] <= s.distance[v]
        or s.distance[v] > s.upper[v]
        or s.distance[v] == INFINITY
    ):
        return 0
    if o.distance[v] == INFINITY:
        o.touched[o.n_touched] = v
        o.n_touched += 1
    s.emitted[v] = s.distance[v]
    o.emitted[v] = INFINITY  # the other search may have handed it over before
    o.distance[v] = o.upper[v] = s.distance[v]
    o.root[v] = s.root[v]
    o.label[v] = s.label[v]
    o.entered[v] = s.entered[v]
    o.crossing[v] = s.crossing[v]
    if s.corner != cython.NULL:
        o.corner[v] = s.corner[v]
        o.leaving[2 * v] = s.leaving[2 * v]
        o.leaving[2 * v + 1] = s.leaving[2 * v + 1]
    push(o, s.distance[v], s.n_half_edges + v)
    return PER_LIST


@cython.cfunc
@cython.nogil
def _hand_over(s: cython.pointer(Search), o: cython.pointer(Search), amount: cython.longlong) -> cython.void:
    """Give a connected piece of the front to the other search, which waits until this is done."""
    queue: cython.p_int = cython.cast(cython.p_int, malloc((s.n_lists + 1) * cython.sizeof(cython.int)))
    n: cython.int = 0
    i: cython.int = 0
    h: cython.int
    if queue == cython.NULL:
        return
    if amount == s.load[s.parity]:
        for i in range(s.n_heap):
            if s.heap[i].what >= s.n_half_edges:
                _give_vertex(s, o, s.heap[i].what - s.n_half_edges)
        i = 0
    while amount > 0 and not o.failed:
        if i == n:
            h = _next_seed(s)
            if h < 0:
                break
            amount -= _give_list(s, o, h)
            queue[n] = h
            n += 1
        h = queue[i]
        i += 1
        for c in range(2):
            v = s.vertex[next_half_edge(h) if c == 0 else previous_half_edge(h)]
            amount -= _give_vertex(s, o, v)
            k = s.corner_of_vertex[v]
            while k >= 0 and amount > 0:
                for h in range(3 * (k // 3), 3 * (k // 3) + 3):
                    if s.slot[h] >= 0:
                        amount -= _give_list(s, o, h)
                        queue[n] = h
                        n += 1
                k = s.next_corner[k]
            h = queue[i - 1]
    free(queue)
