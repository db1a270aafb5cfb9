"""Distances that a search by windows finds: those of vertices, and of targets inside faces."""

import cython
from cython.cimports.heat_igl.kernels.windows.window_goal import with_rounding
from cython.cimports.heat_igl.kernels.windows.window_queue import push
from cython.cimports.heat_igl.kernels.windows.window_structures import FLAT, PASSED, UNKNOWN, Entry, Search, straight
from cython.cimports.heat_igl.kernels.windows.window_surface import classify
from cython.cimports.libc.math import INFINITY
from cython.cimports.libc.stdlib import realloc


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def relax(
    s: cython.pointer(Search),
    v: cython.int,
    distance: cython.double,
    root: cython.int,
    entered: cython.int,
    crossing: cython.double,
    corner: cython.int,
    x: cython.double,
    y: cython.double,
) -> cython.void:
    """Lower the distance of v to `distance` if that is shorter, and note the path: root, half-edge, and crossing.

    The straight last part of the path leaves the root out of a corner, in the direction (x, y). The frame of a corner
    begins with the side to the next corner of the face. In the face f of a source point it is that of corner 3 f. Of a
    segment in face f, x is the length along the segment at which the path starts, and y is 1 if the path leaves to the
    left and -1 if to the right; both are 0 for corners of the same face.
    """
    if distance >= s.upper[v]:
        return
    if s.distance[v] == INFINITY:
        s.touched[s.n_touched] = v
        s.n_touched += 1
    s.distance[v] = s.upper[v] = distance
    s.root[v] = root
    s.label[v] = s.label[root]
    s.entered[v] = entered
    s.crossing[v] = crossing
    if s.corner != cython.NULL:
        s.corner[v] = corner
        s.leaving[2 * v] = x
        s.leaving[2 * v + 1] = y
    if s.other != cython.NULL:
        tell(s, v, distance)
    if distance > s.last_key:
        return
    if s.aim >= 0:
        if v == s.aim:
            s.within = min(s.within, with_rounding(distance))
        elif distance + straight(s, v) > s.within:
            return
    if s.kind[v] == UNKNOWN:
        s.kind[v] = classify(s, v)
    if s.kind[v] == FLAT:
        s.meets_flat = True
    elif s.kind[v] != PASSED:
        push(s, distance, s.n_half_edges + v)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def take(s: cython.pointer(Search), j: cython.int, distance: cython.double, root: cython.int) -> cython.void:
    """Lower the distance of target j to one along a straight line inside the face, if that is shorter."""
    if distance < s.target_distance[j]:
        s.target_distance[j] = distance
        s.target_root[j] = root
        s.target_entered[j] = -1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def tell(s: cython.pointer(Search), v: cython.int, distance: cython.double) -> cython.void:
    """Note a distance of vertex v for the other of two searches."""
    n: cython.int = s.n_news[s.parity]
    room: cython.int = s.n_all_news[s.parity]
    more: cython.pointer(Entry)
    if n == room:
        room = 2 * room + 64
        more = cython.cast(cython.pointer(Entry), realloc(s.news[s.parity], room * cython.sizeof(Entry)))
        if more == cython.NULL:
            s.failed = True
            return
        s.news[s.parity] = more
        s.n_all_news[s.parity] = room
    s.news[s.parity][n].key = distance
    s.news[s.parity][n].what = v
    s.n_news[s.parity] = n + 1
