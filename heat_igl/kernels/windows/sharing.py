"""A search on two threads: what each does on its part of the front, and how the parts are kept equal.

Each thread propagates the windows on its part, with its own queue, lists and distances. The threads work in rounds, up
to a key on which both have agreed. After each round they exchange the distances that they have found, and trim windows
by them, as one thread does. Therefore only windows next to the border of the two parts go further than in a search on
one thread, by the length of a round. If one part has much less work left, it gets a piece of the other. All decisions
depend on the two queues alone, never on which thread is faster.

The rounding of a distance depends on the faces that the path crosses, not on the thread. There are two exceptions: the
halves of a window that are merged behind a flat vertex must wait in one list, and which of three windows equal to
rounding stays depends on the list. The rounds then end, and one thread repeats the search. Surfaces with flat parts
have few windows in any case.
"""

import cython
from cython.cimports.cpython.pythread import NOWAIT_LOCK, WAIT_LOCK, PyThread_acquire_lock, PyThread_release_lock
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.front import append, push, release
from cython.cimports.heat_igl.kernels.windows.structures import FLAT, PASSED, PER_LIST, p_list, p_search
from cython.cimports.libc.math import INFINITY
from cython.cimports.libc.stdlib import free, malloc

# Attempts to take the lock of the other thread before this thread sleeps: some 100 us, as long as a round.
_TRIES = cython.declare(cython.int, 2000)


def load(s):
    """Estimated amount of work on the front, as a number of windows; 0 if there is none."""
    return s.n_waiting + PER_LIST * s.n_heap


def meet(s, which):
    """Wait for the other thread, at first by spinning, since rounds are short."""
    PyThread_release_lock(s.arrived[which])
    for _ in range(_TRIES):
        if PyThread_acquire_lock(s.other.arrived[which], NOWAIT_LOCK):
            return
    PyThread_acquire_lock(s.other.arrived[which], WAIT_LOCK)


def balance(s):
    """Hand over windows if one thread has more work; true if one thread has all, because there is little work."""
    o: p_search = s.other
    mine: cython.longlong = s.load[s.parity]
    theirs: cython.longlong = o.load[s.parity]
    least: cython.longlong = (mine + theirs) // 8
    is_small: cython.bint = mine + theirs < s.few
    if (mine == 0 or theirs == 0) and (mine + theirs < s.plenty):
        return True
    if not is_small and mine - theirs <= least and theirs - mine <= least:
        return False
    s.is_shared = True
    meet(s, 2)
    if is_small and not s.is_first:
        _hand_over(s, o, mine)
        s.n_heap = 0
    elif not is_small and mine > theirs:
        _hand_over(s, o, (mine - theirs) // 2)
    meet(s, 3)
    return is_small


def _next_seed(s):
    """A half-edge with waiting windows, if possible next to the part of the other thread; -1 if there is none."""
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


def _give_list(s, o, h):
    """Hand over the windows that wait at half-edge h; returns the amount of work."""
    place: cython.int = s.slot[h]
    one: p_list = cython.address(s.lists[place])
    n: cython.int = one.count
    for i in range(n):
        root: cython.int = one.windows[i].root
        # A vertex that the other search has nearer may have its path from another source.
        if root >= s.n or s.distance[root] <= o.distance[root]:
            o.label[root] = s.label[root]
    append(o, h, one.windows, n, one.turns, False)
    o.n_windows -= n
    s.n_waiting -= n
    s.slot[h] = -1
    release(s, place)
    return n + PER_LIST


def _give_vertex(s, o, v):
    """Hand over a vertex that has yet to emit windows; returns the amount of work."""
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


def _hand_over(s, o, amount):
    """Hand over a connected piece of the front to the other search, which waits until this is done."""
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
