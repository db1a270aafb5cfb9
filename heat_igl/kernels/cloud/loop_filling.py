"""Triangles in the gaps of a surface of points: ears cut from the loops of the outer edges, in space."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.cloud.loop_filling import BEYOND, POINT
from cython.cimports.libc.math import INFINITY, sqrt


def filling_triangles(
    P: cython.const[cython.double][:, ::1],
    ends: cython.const[cython.int][:, ::1],
    opposite: cython.const[cython.int][::1],
    partner: cython.const[cython.longlong][::1],
    joints: cython.int[::1],
    largest: cython.const[cython.double][::1],
    edges: cython.const[cython.int][:, ::1],
    most_bent: cython.double,
    most_folded: cython.double,
):
    """Triangles in the loops of outer edges.

    Of each loop, the ear with the smallest circumscribed circle is cut off again and again, as long as one may be: a
    small gap is filled, and of a hole or of the border the notches. Before these come ears that join two fans of a
    point, however large, that with the shortest third side first. Ears that fold back are cut last, and only where
    nothing is left of the loop then, as in creases.

    Parameters
    ----------
    P : (n, 3) float64
        Points.
    ends : (k, 2) int32
        Outer edges: sides of one triangle alone.
    opposite : (k,) int32
        The third corner of this triangle.
    partner : (2 k,) int64
        The end ``2 f + d`` of edge f at which a loop goes on that comes to the end ``2 e + c`` of edge e; -1 if none.
    joints : (n,) int32
        How many fans there are at each point beside the first. Triangles between them are counted down.
    largest : (n,) float64
        Largest radius of circles through each point.
    edges : (e, 2) int32
        All edges between the points of loops: none gets another triangle.
    most_bent, most_folded : float
        Cosines of the angle to the neighbour at an edge, 1 where the two lie on each other: the largest of triangles
        that are cut first, and of those in loops of which nothing is left.

    Returns
    -------
    triangles : (t, 3) int32
    is_whole : (t,) bool
        Whether they are in a loop of which nothing is left, and join no fans.
    """
    k: cython.Py_ssize_t = ends.shape[0]
    found, whole = np.empty((k, 3), np.int32), np.empty(k, np.bool_)
    is_whole: cython.uchar[::1] = whole.view(np.uint8)
    triangles: cython.int[:, ::1] = found
    seen: cython.uchar[::1] = np.zeros(k, np.uint8)
    ring: cython.int[:, ::1] = np.empty((2, k), np.int32)
    cost: cython.double[::1] = np.empty(k)
    # The edges at each lower end, one after the other.
    head: cython.int[::1] = np.full(P.shape[0], -1, np.int32)
    link: cython.int[:, ::1] = np.empty((edges.shape[0] + k, 2), np.int32)
    count: cython.Py_ssize_t = 0
    with cython.nogil:
        for e in range(edges.shape[0]):
            _enter(head, link, e, edges[e, 0], edges[e, 1])
        for e in range(k):
            if not seen[e]:
                size: cython.Py_ssize_t = _loop(e, ends, opposite, partner, seen, ring)
                if size >= 3:
                    cut: cython.Py_ssize_t = _fill(
                        P,
                        ring,
                        cost,
                        size,
                        joints,
                        largest,
                        head,
                        link,
                        edges.shape[0] + count,
                        most_bent,
                        most_folded,
                        triangles[count:],
                        is_whole[count:],
                    )
                    if cut < size - 2:
                        is_whole[count : count + cut] = 0
                    count += cut
    return found[:count], whole[:count]


@cython.cfunc
@cython.nogil
def _loop(
    start: cython.Py_ssize_t,
    ends: cython.const[cython.int][:, ::1],
    opposite: cython.const[cython.int][::1],
    partner: cython.const[cython.longlong][::1],
    seen: cython.uchar[::1],
    ring: cython.int[:, ::1],
) -> cython.Py_ssize_t:
    """The points of the loop from an edge on, and the corners opposite to the edges; their number, 0 if it ends.

    It goes against the triangle of the first edge, so that triangles in the loop run like those around it.
    """
    size: cython.Py_ssize_t = 0
    at: cython.Py_ssize_t = 2 * start + 1
    while not seen[at // 2]:
        e: cython.Py_ssize_t = at // 2
        seen[e] = 1
        ring[POINT, size], ring[BEYOND, size] = ends[e, at % 2], opposite[e]
        size += 1
        at = partner[at ^ 1]
        if at < 0:
            return 0
    return size if at == 2 * start + 1 else 0


@cython.cfunc
@cython.nogil
def _fill(
    P: cython.const[cython.double][:, ::1],
    ring: cython.int[:, ::1],
    cost: cython.double[::1],
    size: cython.Py_ssize_t,
    joints: cython.int[::1],
    largest: cython.const[cython.double][::1],
    head: cython.int[::1],
    link: cython.int[:, ::1],
    n_edges: cython.Py_ssize_t,
    most_bent: cython.double,
    most_folded: cython.double,
    triangles: cython.int[:, ::1],
    is_whole: cython.uchar[::1],
) -> cython.Py_ssize_t:
    """Cut ears from a ring of points while there are any; how many. Each enters its third side as an edge."""
    count: cython.Py_ssize_t = 0
    flat: cython.Py_ssize_t = -1
    limit: cython.double = most_bent
    for i in range(size):
        cost[i] = _ear(P, ring, size, i, joints, largest, head, link, limit)
    while size > 2:
        best: cython.Py_ssize_t = 0
        for i in range(1, size):
            if cost[i] < cost[best]:
                best = i
        if cost[best] == INFINITY:
            if flat >= 0:
                # What was cut last closes nothing, and goes with its edges.
                for i in range(count - 1, flat - 1, -1):
                    head[min(triangles[i, 0], triangles[i, 2])] = link[n_edges + i, 1]
                return flat
            flat, limit = count, most_folded
            for i in range(size):
                cost[i] = _ear(P, ring, size, i, joints, largest, head, link, limit)
            continue
        before: cython.Py_ssize_t = size - 1 if best == 0 else best - 1
        after: cython.Py_ssize_t = 0 if best == size - 1 else best + 1
        # In the meantime its third side may have become an edge, or all fans there may be joined.
        is_edge: cython.bint = size > 3 and _is_edge(head, link, ring[POINT, before], ring[POINT, after])
        if is_edge or (cost[best] < 0.0 and joints[ring[POINT, best]] == 0):
            cost[best] = INFINITY if is_edge else _ear(P, ring, size, best, joints, largest, head, link, limit)
            continue
        is_whole[count] = cost[best] >= 0.0
        joints[ring[POINT, best]] -= joints[ring[POINT, best]] > 0
        triangles[count, 0], triangles[count, 1] = ring[POINT, before], ring[POINT, best]
        triangles[count, 2] = ring[POINT, after]
        _enter(head, link, n_edges + count, ring[POINT, before], ring[POINT, after])
        count += 1
        ring[BEYOND, before] = ring[POINT, best]
        size -= 1
        for i in range(best, size):
            ring[POINT, i], ring[BEYOND, i], cost[i] = ring[POINT, i + 1], ring[BEYOND, i + 1], cost[i + 1]
        # The two neighbours have other ears now.
        for i in range(best - 1, best + 1):
            j: cython.Py_ssize_t = (i + size) % size
            cost[j] = _ear(P, ring, size, j, joints, largest, head, link, limit)
        if size == 3:  # one triangle is left
            cost[0] = cost[1] = cost[2] = _ear(P, ring, size, 0, joints, largest, head, link, limit)
    return count


@cython.cfunc
@cython.nogil
def _ear(
    P: cython.const[cython.double][:, ::1],
    ring: cython.int[:, ::1],
    size: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    joints: cython.int[::1],
    largest: cython.const[cython.double][::1],
    head: cython.int[::1],
    link: cython.int[:, ::1],
    most_folded: cython.double,
) -> cython.double:
    """Radius of the circle through point i of a ring and its neighbours; infinite if it may not be cut.

    Negative if it joins two fans, and the smaller the shorter the third side is.
    """
    before: cython.Py_ssize_t = size - 1 if i == 0 else i - 1
    after: cython.Py_ssize_t = 0 if i == size - 1 else i + 1
    a: cython.int = ring[POINT, before]
    b: cython.int = ring[POINT, i]
    c: cython.int = ring[POINT, after]
    if a in (b, c) or b == c or (size > 3 and _is_edge(head, link, a, c)):
        return INFINITY
    if joints[b] > 0:
        square: cython.double = 0.0
        for x in range(3):
            square += (P[c, x] - P[a, x]) * (P[c, x] - P[a, x])
        return -1.0 / square if square > 0.0 else -INFINITY
    radius: cython.double = _circumradius(P, a, b, c)
    # The last triangle has no edge of its own, and closes the gap even if its corners lie on a line.
    if size > 3 and radius >= min(largest[a], min(largest[b], largest[c])):
        return INFINITY
    folded: cython.double = max(_fold(P, a, b, c, ring[BEYOND, before]), _fold(P, b, c, a, ring[BEYOND, i]))
    if size == 3:
        folded = max(folded, _fold(P, c, a, b, ring[BEYOND, after]))
    return INFINITY if folded > most_folded else radius


@cython.cfunc
@cython.nogil
def _enter(
    head: cython.int[::1], link: cython.int[:, ::1], e: cython.Py_ssize_t, a: cython.int, b: cython.int
) -> cython.void:
    link[e, 0], link[e, 1] = max(a, b), head[min(a, b)]
    head[min(a, b)] = cython.cast(cython.int, e)


@cython.cfunc
@cython.nogil
def _is_edge(head: cython.int[::1], link: cython.int[:, ::1], a: cython.int, b: cython.int) -> cython.bint:
    e: cython.int = head[min(a, b)]
    while e >= 0 and link[e, 0] != max(a, b):
        e = link[e, 1]
    return e >= 0


@cython.cfunc
@cython.nogil
def _circumradius(
    P: cython.const[cython.double][:, ::1], a: cython.Py_ssize_t, b: cython.Py_ssize_t, c: cython.Py_ssize_t
) -> cython.double:
    u: cython.double = 0.0
    v: cython.double = 0.0
    along: cython.double = 0.0
    third: cython.double = 0.0
    for x in range(3):
        to_a: cython.double = P[a, x] - P[b, x]
        to_c: cython.double = P[c, x] - P[b, x]
        u += to_a * to_a
        v += to_c * to_c
        along += to_a * to_c
        third += (to_a - to_c) * (to_a - to_c)
    double_area: cython.double = sqrt(max(u * v - along * along, 0.0))
    product: cython.double = sqrt(u) * sqrt(v) * sqrt(third)
    # Without a bound, points on a line are not an error: their circle is larger than any.
    return 0.5 * product / double_area if double_area > 1e-12 * sqrt(u) * sqrt(v) else 1e300


@cython.cfunc
@cython.nogil
def _fold(
    P: cython.const[cython.double][:, ::1],
    a: cython.Py_ssize_t,
    b: cython.Py_ssize_t,
    c: cython.Py_ssize_t,
    d: cython.Py_ssize_t,
) -> cython.double:
    """Cosine of the angle around the edge from a to b between the sides of c and d: 1 if they fold back."""
    square: cython.double = 0.0
    of_c: cython.double = 0.0
    of_d: cython.double = 0.0
    for x in range(3):
        square += (P[b, x] - P[a, x]) * (P[b, x] - P[a, x])
        of_c += (P[c, x] - P[a, x]) * (P[b, x] - P[a, x])
        of_d += (P[d, x] - P[a, x]) * (P[b, x] - P[a, x])
    size_c: cython.double = 0.0
    size_d: cython.double = 0.0
    alike: cython.double = 0.0
    for x in range(3):
        along: cython.double = (P[b, x] - P[a, x]) / square if square > 0.0 else 0.0
        across_c: cython.double = P[c, x] - P[a, x] - of_c * along
        across_d: cython.double = P[d, x] - P[a, x] - of_d * along
        size_c += across_c * across_c
        size_d += across_d * across_d
        alike += across_c * across_d
    size: cython.double = sqrt(size_c) * sqrt(size_d)
    return alike / size if size > 0.0 else -1.0
