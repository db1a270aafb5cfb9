"""Many local searches by windows on one surface. The cost of each is proportional to the vertices that it visits."""

import cython
from cython.cimports.heat_igl.kernels.windows.window_goal import aim_at
from cython.cimports.heat_igl.kernels.windows.window_memory import allocate, free_front
from cython.cimports.heat_igl.kernels.windows.window_search import forget, narrow, run
from cython.cimports.heat_igl.kernels.windows.window_sources import start_at
from cython.cimports.heat_igl.kernels.windows.window_structures import Search
from cython.cimports.heat_igl.kernels.windows.windows import Front

__all__ = ["search_each"]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _write_within(
    s: cython.pointer(Search), name: cython.p_longlong, to: cython.p_int, value: cython.p_double
) -> cython.int:
    """Store the vertices within the cutoff and their distances; returns their number."""
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
def _write_ways(s: cython.pointer(Search), way: cython.p_int, line: cython.p_double) -> cython.void:
    """Store how the paths to the vertices within the cutoff come there, in the order of `_write_within`.

    Of each path the root, the corner out of which it leaves that and the half-edge by which it enters its last face;
    and the direction out of the corner and the crossing of the half-edge.
    """
    i: cython.int
    v: cython.int
    n: cython.int = 0
    for i in range(s.n_touched):
        v = s.touched[i]
        if s.distance[v] <= s.cutoff:
            way[3 * n] = s.root[v]
            way[3 * n + 1] = s.corner[v]
            way[3 * n + 2] = s.entered[v]
            line[3 * n] = s.leaving[2 * v]
            line[3 * n + 1] = s.leaving[2 * v + 1]
            line[3 * n + 2] = s.crossing[v]
            n += 1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _write_nearest(
    s: cython.pointer(Search), name: cython.p_longlong, to: cython.p_int, value: cython.p_double
) -> cython.int:
    """Store the nearest vertices in order, equally near ones by ascending name; returns their number."""
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
        cutoff runs, see `_write_ways`, by the numbers of the tables.
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
                    if way.shape[0] > 0:
                        _write_ways(s, cython.address(way[at, 0]), cython.address(line[at, 0]))
                    at += _write_within(s, names, cython.address(found[0]) + at, cython.address(value[0]) + at)
            end[i] = at
            n_done += 1
            forget(s)
        forget(s)
        free_front(s)
    return -1 if s.failed else n_done
