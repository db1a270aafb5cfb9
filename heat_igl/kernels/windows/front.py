"""Windows that wait: lists at half-edges, each with a key.

The square of the key of a list is the power of the root with respect to the circle around the face that is entered
next. On a Delaunay triangulation that power grows along every straight line from the root, it is no larger than the
square of the distance of any vertex ahead, and it sorts faces from front to back. So a list is nearly always complete
when its turn comes, a face is crossed once from each side, and no vertex can come nearer than the key. On other
triangulations the key is the distance of the nearest point of the windows.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge
from cython.cimports.heat_igl.kernels.windows.window_goal import towards_goal
from cython.cimports.heat_igl.kernels.windows.window_queue import push
from cython.cimports.heat_igl.kernels.windows.window_structures import List, Search, Window
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.libc.stdlib import realloc
from cython.cimports.libc.string import memcpy, memmove


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _key(
    s: cython.pointer(Search), w: cython.pointer(Window), length: cython.double, bulge: cython.double
) -> cython.double:
    """The key of a window. Of parallel lines, the power of the root becomes the distance of the circle's centre."""
    key: cython.double
    x: cython.double = 0.0
    if w.is_plane:
        if s.is_delaunay:
            return w.offset + 0.5 * (w.x * length + w.depth * bulge)
        return w.offset + w.x * (w.start if w.x > 0.0 else w.stop)
    if s.is_delaunay:
        key = w.x * (w.x - length) + w.depth * (w.depth + bulge)
        return w.offset + (sqrt(key) if key > 0.0 else 0.0)
    if w.x < w.start:
        x = w.start - w.x
    elif w.x > w.stop:
        x = w.x - w.stop
    return w.offset + sqrt(x * x + w.depth * w.depth)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _is_late(
    s: cython.pointer(Search),
    run: cython.pointer(Window),
    n: cython.int,
    length: cython.double,
    bulge: cython.double,
) -> cython.bint:
    """Whether the keys of all windows of a run, the same in both frames, lie beyond the end of the search."""
    i: cython.int
    for i in range(n):
        if _key(s, run + i, length, bulge) <= s.last_key:
            return False
    return True


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _has_room(one: cython.pointer(List), n: cython.int) -> cython.bint:
    """Make room for n more windows of a list; false without memory."""
    capacity: cython.int
    more: cython.pointer(Window)
    if one.count + n > one.capacity:
        capacity = 2 * (one.count + n) + 4
        more = cython.cast(cython.pointer(Window), realloc(one.windows, capacity * cython.sizeof(Window)))
        if more == cython.NULL:
            return False
        one.windows = more
        one.capacity = capacity
    return True


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _mirrored(w: Window, length: cython.double) -> Window:
    """A window in the frame that begins at the other end of its half-edge."""
    start: cython.double = w.start
    if w.is_plane:
        w.offset += w.x * length
        w.x = -w.x
    else:
        w.x = length - w.x
    w.start = length - w.stop
    w.stop = length - start
    return w


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def append(
    s: cython.pointer(Search),
    t: cython.int,
    run: cython.pointer(Window),
    n: cython.int,
    in_front: cython.bint,
    mirrored: cython.bint,
) -> cython.void:
    """Add windows to those that wait at half-edge t."""
    i: cython.int
    place: cython.int = s.slot[t]
    one: cython.pointer(List)
    to: cython.pointer(Window)
    length: cython.double = s.length[t]
    bulge: cython.double = s.bulge[t]
    key: cython.double
    lowest: cython.double = INFINITY
    if place < 0:
        if s.last_key < INFINITY and _is_late(s, run, n, length, bulge):
            return
        place = _free_list(s)
        if place < 0:
            return
        s.slot[t] = place
        s.lists[place].half_edge = t
        s.lists[place].count = 0
        s.lists[place].key = INFINITY
    one = cython.address(s.lists[place])
    if not _has_room(one, n):
        s.failed = True
        return
    if in_front != mirrored:
        if one.count > 0:
            memmove(one.windows + n, one.windows, one.count * cython.sizeof(Window))
        to = one.windows
    else:
        to = one.windows + one.count
    one.count += n
    s.n_windows += n
    s.n_waiting += n
    if mirrored:
        for i in range(n):
            to[i] = _mirrored(run[n - 1 - i], length)
    else:
        memcpy(to, run, n * cython.sizeof(Window))
    for i in range(n):
        key = _key(s, to + i, length, bulge)
        if key < lowest:
            lowest = key
    if lowest < one.key:
        one.key = lowest
        push(s, lowest, t)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _free_list(s: cython.pointer(Search)) -> cython.int:
    """A list that is not in use, with the room that it had before; -1 without memory."""
    place: cython.int = s.free_list
    more: cython.pointer(List)
    if place >= 0:
        s.free_list = s.lists[place].count
        return place
    if s.n_lists == s.n_all_lists:
        more = cython.cast(cython.pointer(List), realloc(s.lists, 2 * s.n_all_lists * cython.sizeof(List)))
        if more == cython.NULL:
            s.failed = True
            return -1
        s.lists = more
        s.n_all_lists *= 2
    place = s.n_lists
    s.n_lists += 1
    if place == s.n_made_lists:
        s.n_made_lists += 1
        s.lists[place].windows = cython.NULL
        s.lists[place].capacity = 0
    return place


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def add(
    s: cython.pointer(Search), e: cython.int, run: cython.pointer(Window), n: cython.int, in_front: cython.bint
) -> cython.void:
    """Windows over half-edge e, out of its face; their frame runs from the head of e to its tail."""
    t: cython.int = s.twin[e]
    if s.aim >= 0:
        n = towards_goal(s, e, run, n)
        if n == 0:
            return
    if t >= 0:
        append(s, t, run, n, in_front, not s.aligned[e])
    elif t == -2:
        t = s.ring[e]
        while t != e:
            append(s, t, run, n, in_front, s.vertex[next_half_edge(t)] == s.vertex[next_half_edge(e)])
            t = s.ring[t]
