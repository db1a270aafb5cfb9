"""Continuous Dijkstra: lists of windows cross their faces in ascending order of distance, until the result is known."""

import cython
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.signals import is_interrupted
from cython.cimports.heat_igl.kernels.windows.window_bends import emit_vertex
from cython.cimports.heat_igl.kernels.windows.window_crossing import cross, over_corners
from cython.cimports.heat_igl.kernels.windows.window_memory import empty_front
from cython.cimports.heat_igl.kernels.windows.window_queue import pop
from cython.cimports.heat_igl.kernels.windows.window_segments import emit_segment
from cython.cimports.heat_igl.kernels.windows.window_sources import emit_point
from cython.cimports.heat_igl.kernels.windows.window_structures import MARGIN, Entry, Search
from cython.cimports.libc.math import INFINITY
from cython.cimports.libc.stdlib import free, malloc

# Lists that cross a face before a signal is asked for: some milliseconds.
_ASK = cython.declare(cython.longlong, 4096)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _all_found(s: cython.pointer(Search), key: cython.double) -> cython.bint:
    """Whether the result cannot change any more by windows with this key or a larger one."""
    j: cython.int
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
@cython.exceptval(check=False)
def carry(s: cython.pointer(Search), entry: Entry) -> cython.void:
    """Let a list cross its face, or windows leave a vertex, point or segment, unless the entry is out of date."""
    v: cython.int
    place: cython.int
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
@cython.nogil
@cython.exceptval(check=False)
def run(s: cython.pointer(Search)) -> cython.void:
    """Carry lists, and let windows leave vertices, points and segments, in ascending order of their keys."""
    entry: Entry
    j: cython.int
    s.last_key = s.cutoff * (1.0 + MARGIN) + s.slack
    while s.n_heap > 0 and not s.failed:
        if s.n_nearest > 0 and s.n_touched >= s.n_next:
            narrow(s)
            s.last_key = s.cutoff * (1.0 + MARGIN)
        entry = pop(s)
        if s.n_heap > 0:
            prefetch(s.slot + s.heap[0].what)
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


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def narrow(s: cython.pointer(Search)) -> cython.void:
    """Lower the cutoff to a distance within which the requested number of vertices are known to lie."""
    i: cython.int
    j: cython.int
    low: cython.int = 0
    high: cython.int = s.n_touched - 1
    wanted: cython.int = s.n_nearest - 1
    pivot: cython.double
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


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def forget(s: cython.pointer(Search)) -> cython.void:
    """Clear the entries that a search wrote, for the next search on the same front."""
    i: cython.int
    v: cython.int
    empty_front(s)
    for i in range(s.n_touched):
        v = s.touched[i]
        s.distance[v] = s.emitted[v] = INFINITY
        s.root[v] = s.label[v] = s.entered[v] = -1
        if s.corner != cython.NULL:
            s.corner[v] = -1
    s.n_touched = s.n_found = 0
