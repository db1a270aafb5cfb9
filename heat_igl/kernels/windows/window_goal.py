"""Searches by windows for the distance of one goal: windows that cannot lead to it on a shortest path are left out."""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.window_goal import with_rounding
from cython.cimports.heat_igl.kernels.windows.window_structures import Search, Window, reach, straight
from cython.cimports.heat_igl.kernels.windows.window_surface import third
from cython.cimports.libc.math import INFINITY


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def aim_at(s: cython.pointer(Search), v: cython.int, goal: cython.int) -> cython.void:
    """Let the search from v be one for the distance of `goal` alone, and bound that by a path along edges.

    From each vertex, the path takes the edge that makes the way to the goal shortest, were it straight from there on.
    Where that comes no nearer to the goal, there is no bound.
    """
    k: cython.int
    h: cython.int
    i: cython.int
    best: cython.int
    length: cython.double = 0.0
    along: cython.double
    left: cython.double
    shortest: cython.double
    s.aim = goal
    s.within = INFINITY
    left = straight(s, v)
    while v != goal:
        shortest = INFINITY
        best = -1
        k = s.corner_of_vertex[v]
        while k >= 0:
            for i in range(2):
                h = next_half_edge(k) if i == 0 else previous_half_edge(k)
                along = s.length[third(k, h)]
                if along + straight(s, s.vertex[h]) < shortest:
                    shortest = along + straight(s, s.vertex[h])
                    best = s.vertex[h]
            k = s.next_corner[k]
        if best < 0 or straight(s, best) >= left:
            return
        v = best
        left = straight(s, v)
        length += shortest - left
    s.within = with_rounding(length)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def towards_goal(s: cython.pointer(Search), e: cython.int, run: cython.pointer(Window), n: cython.int) -> cython.int:
    """Keep the windows over e through which a path to the goal may be as short as the one known; how many they are.

    No path from a point of e to the goal is shorter than the straight line from an end of e, less the way to that end.
    With the distance of the point added, this falls from one end to the other, so it is least at an end of the window.
    """
    i: cython.int
    k: cython.int = 0
    w: cython.pointer(Window)
    # As seen by the windows, whose frame begins at the head of e.
    from_tail: cython.double = straight(s, s.vertex[previous_half_edge(e)])
    from_head: cython.double = straight(s, s.vertex[next_half_edge(e)]) - s.length[e]
    for i in range(n):
        w = run + i
        if w.offset + reach(w, w.stop) + (from_tail - w.stop) > s.within:
            continue
        if w.offset + reach(w, w.start) + (from_head + w.start) > s.within:
            continue
        if k < i:
            run[k] = run[i]
        k += 1
    return k
