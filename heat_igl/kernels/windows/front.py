"""The front of a search: lists of windows waiting at half-edges, the priority queue, and the distances found so far.

The key of a list is the root's offset plus the square root of the power of the root with respect to the circumcircle
of the face that the windows enter next. On a Delaunay triangulation this power increases along every straight line
from the root, does not exceed the squared distance of any vertex ahead, and orders faces from front to back. Therefore
a list is nearly always complete when it is processed, each face is crossed once from each side, and no vertex can still
get a distance below the current key. On other triangulations the key is the distance of the nearest point of the
windows. The queue is a binary heap in which outdated entries stay until they are popped. `kernels.priority_queue`
updates keys in place instead, but needs three numbers for every half-edge and vertex of the surface.

A search for a single goal drops windows that cannot contain a shortest path to it.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.structures import (
    FLAT,
    PASSED,
    UNKNOWN,
    Entry,
    List,
    Window,
    grown,
    p_entry,
    p_list,
    p_window,
    reach,
    straight,
)
from cython.cimports.heat_igl.kernels.windows.surface import classify, third
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.libc.stdlib import free
from cython.cimports.libc.string import memmove


def allocate(s):
    """Allocate the memory of a front."""
    s.n_lists = s.n_made_lists = s.n_heap = s.n_touched = s.n_found = 0
    s.n_all_lists = s.n_all_heap = 0
    s.free_list = -1
    s.failed = s.meets_ties = s.is_shared = False
    s.n_windows = s.n_lists_done = s.n_waiting = s.n_compared = s.before = s.next_question = 0
    s.is_endless = False
    s.n_nearest = s.n_crossed = 0
    s.lists, s.heap, s.kept = cython.NULL, cython.NULL, cython.NULL
    s.to_left = s.to_right = cython.NULL
    more_room(s, 128)


def more_room(s, n):
    """Allocate room for n windows on each side of an apex."""
    room, failed = cython.address(s.n_out), cython.address(s.failed)
    s.to_left = cython.cast(p_window, grown(s.to_left, room, n, cython.sizeof(Window), failed))
    s.to_right = cython.cast(p_window, grown(s.to_right, room, n, cython.sizeof(Window), failed))


def empty_front(s):
    """Remove all waiting windows and queue entries; lists and queue keep their memory."""
    for i in range(s.n_lists):
        if s.lists[i].half_edge >= 0:
            s.slot[s.lists[i].half_edge] = -1
    s.n_lists = s.n_heap = 0
    s.n_waiting = s.n_crossed = 0
    s.free_list = -1
    if s.kept != cython.NULL:
        for h in range(s.n_half_edges):
            free(s.kept[h].windows)
        free(s.kept)
        s.kept = cython.NULL


def free_front(s):
    """Return the memory of a front."""
    for i in range(s.n_made_lists):
        free(s.lists[i].windows)
    free(s.lists)
    free(s.heap)
    free(s.to_left)
    free(s.to_right)


def push(s, key, what):
    """Add to the queue, a binary heap."""
    if s.n_heap == s.n_all_heap:
        more = grown(s.heap, cython.address(s.n_all_heap), s.n_heap + 1, cython.sizeof(Entry), cython.address(s.failed))
        s.heap = cython.cast(p_entry, more)
        if s.failed:
            return
    i: cython.int = s.n_heap
    s.n_heap += 1
    while i > 0:
        above: cython.int = (i - 1) // 2
        if s.heap[above].key <= key:
            break
        s.heap[i] = s.heap[above]
        i = above
    s.heap[i].key = key
    s.heap[i].what = what


def pop(s):
    """Take the entry with the smallest key."""
    heap: p_entry = s.heap
    top: Entry = heap[0]
    i: cython.int = 0
    below: cython.int = 1
    s.n_heap -= 1
    last: Entry = heap[s.n_heap]
    # Bottom-up: moving the gap down to a leaf needs no branch on keys, and the last entry seldom rises from there.
    while below + 1 < s.n_heap:
        below += heap[below + 1].key < heap[below].key
        heap[i] = heap[below]
        i = below
        below = 2 * i + 1
    if below < s.n_heap:
        heap[i] = heap[below]
        i = below
    while i > 0:
        above: cython.int = (i - 1) // 2
        if heap[above].key <= last.key:
            break
        heap[i] = heap[above]
        i = above
    heap[i] = last
    return top


def aim_at(s, v, goal):
    """Make the search from v one for the distance of `goal` alone, bounded by the length of a path along edges.

    The path is greedy: each edge minimizes its length plus the straight distance from its end to the goal. There is no
    bound if an edge does not end nearer to the goal.
    """
    length: cython.double = 0.0
    s.aim = goal
    s.within = INFINITY
    left: cython.double = straight(s, v)
    while v != goal:
        shortest: cython.double = INFINITY
        best: cython.int = -1
        k: cython.int = s.corner_of_vertex[v]
        while k >= 0:
            for i in range(2):
                h: cython.int = next_half_edge(k) if i == 0 else previous_half_edge(k)
                along: cython.double = s.length[third(k, h)]
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


def towards_goal(s, e, run, n):
    """Keep the windows over e that may contain a path to the goal no longer than the known bound; returns their number.

    A path from a point of e to the goal is at least as long as the straight line from an end of e to the goal, minus
    the distance of the point from that end. Together with the distance of the point, this lower bound is monotone along
    e, so its minimum over a window is at one end of the window.
    """
    k: cython.int = 0
    # In the frame of the windows, whose origin is the head of e.
    from_tail: cython.double = straight(s, s.vertex[previous_half_edge(e)])
    from_head: cython.double = straight(s, s.vertex[next_half_edge(e)]) - s.length[e]
    for i in range(n):
        w: p_window = run + i
        if w.offset + reach(w, w.stop) + (from_tail - w.stop) > s.within:
            continue
        if w.offset + reach(w, w.start) + (from_head + w.start) > s.within:
            continue
        if k < i:
            run[k] = run[i]
        k += 1
    return k


def relax(s, v, distance, root, entered, crossing, corner, x, y):
    """Lower the distance of v to `distance` if that is smaller, and store the path: root, half-edge, and crossing.

    The last straight part of the path leaves the root through a corner, in the direction (x, y). The first axis of the
    frame of a corner is the side to the next corner of the face. For a source point in face f, the frame is that of
    corner 3 f. For a segment in face f, x is the arc length along the segment at which the path starts, and y is 1 if
    the path leaves to the left and -1 if it leaves to the right; both are 0 for corners of the same face.
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
        s.meets_ties = True
    elif s.kind[v] != PASSED:
        push(s, distance, s.n_half_edges + v)


def take(s, j, distance, root):
    """Lower the distance of target j to one along a straight line inside the face, if that is shorter."""
    if distance < s.target_distance[j]:
        s.target_distance[j] = distance
        s.target_root[j] = root
        s.target_entered[j] = -1


def tell(s, v, distance):
    """Record a distance of vertex v for the search on the other thread."""
    n: cython.int = s.n_news[s.parity]
    if n == s.n_all_news[s.parity]:
        more = grown(s.news[s.parity], s.n_all_news + s.parity, n + 1, cython.sizeof(Entry), cython.address(s.failed))
        s.news[s.parity] = cython.cast(p_entry, more)
        if s.failed:
            return
    s.news[s.parity][n].key = distance
    s.news[s.parity][n].what = v
    s.n_news[s.parity] = n + 1


def _key(s, w, length, bulge):
    """The key of a window, the same in both frames of its half-edge.

    For parallel lines, the root of the power is replaced by the distance of the circumcentre.
    """
    if w.is_plane:
        x = w.x * length + w.depth * bulge
        return w.offset + (0.5 * x if s.is_delaunay else w.x * (w.start if w.x > 0.0 else w.stop))
    if s.is_delaunay:
        square = w.x * (w.x - length) + w.depth * (w.depth + bulge)
    else:
        x = max(w.start - w.x, w.x - w.stop, 0.0)
        square = x * x + w.depth * w.depth
    return w.offset + sqrt(max(square, 0.0))


def _mirrored(w, length):
    """A window in the frame whose origin is the other end of its half-edge."""
    start: cython.double = w.start
    if w.is_plane:
        w.offset += w.x * length
        w.x = -w.x
    else:
        w.x = length - w.x
    w.start = length - w.stop
    w.stop = length - start
    return w


def append(s, t, run, n, turns, mirrored):
    """Add windows to those that wait at half-edge t."""
    place: cython.int = s.slot[t]
    to: p_window
    length: cython.double = s.length[t]
    bulge: cython.double = s.bulge[t]
    lowest: cython.double = INFINITY
    is_new: cython.bint = place < 0
    turns = -turns if mirrored else turns
    if is_new:
        place = _free_list(s)
        if place < 0:
            return
        s.lists[place].half_edge = t
        s.lists[place].count = 0
        s.lists[place].key = INFINITY
        s.lists[place].turns = turns
    one: p_list = cython.address(s.lists[place])
    if one.count + n > one.capacity:
        room: cython.p_int = cython.address(one.capacity)
        more = grown(one.windows, room, one.count + n, cython.sizeof(Window), cython.address(s.failed))
        one.windows = cython.cast(p_window, more)
        if s.failed:
            return
    to = one.windows + one.count
    if turns > 0:
        to = one.windows
        if one.count > 0:
            memmove(to + n, to, one.count * cython.sizeof(Window))
    for i in range(n):
        lowest = min(lowest, _key(s, run + i, length, bulge))
        if mirrored:
            to[n - 1 - i] = _mirrored(run[i], length)
        else:
            to[i] = run[i]
    if is_new:
        if lowest > s.last_key:
            release(s, place)
            return
        s.slot[t] = place
    if not is_new:
        one.turns = max(min(turns, one.turns), 0) + min(max(turns, one.turns), 0)
    one.count += n
    s.n_windows += n
    s.n_waiting += n
    if lowest < one.key:
        one.key = lowest
        push(s, lowest, t)


def _free_list(s):
    """An unused list, with the capacity that it has from earlier use; -1 if memory runs out."""
    place: cython.int = s.free_list
    if place >= 0:
        s.free_list = s.lists[place].count
        return place
    place = s.n_lists
    if s.n_lists == s.n_all_lists:
        more = grown(s.lists, cython.address(s.n_all_lists), place + 1, cython.sizeof(List), cython.address(s.failed))
        s.lists = cython.cast(p_list, more)
        if s.failed:
            return -1
    s.n_lists += 1
    if place == s.n_made_lists:
        s.n_made_lists += 1
        s.lists[place].windows = cython.NULL
        s.lists[place].capacity = 0
    return place


def add(s, e, run, n, turns):
    """Add windows that cross half-edge e out of its face; their frame runs from the head of e to its tail."""
    t: cython.int = s.twin[e]
    if s.aim >= 0:
        n = towards_goal(s, e, run, n)
        if n == 0:
            return
    if t >= 0:
        append(s, t, run, n, turns, not s.aligned[e])
    elif t == -2:
        t = s.ring[e]
        while t != e:
            append(s, t, run, n, turns, s.vertex[next_half_edge(t)] == s.vertex[next_half_edge(e)])
            t = s.ring[t]


def start_at(s, v, offset, label):
    """Make vertex v a source with the given offset."""
    if not s.failed and offset < s.upper[v]:
        s.label[v] = label
        relax(s, v, offset, v, -1, 0.0, -1, 0.0, 0.0)
        push(s, offset, s.n_half_edges + v)
