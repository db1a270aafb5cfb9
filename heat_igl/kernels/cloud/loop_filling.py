"""Triangles in the gaps of a surface of points: ears cut from the loops of the outer edges, in space."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, sqrt


def filling_triangles(
    P: cython.const[cython.double][:, ::1],
    ends: cython.const[cython.int][:, ::1],
    opposite: cython.const[cython.int][::1],
    at: cython.const[cython.int][:, ::1],
    largest: cython.const[cython.double][::1],
    edges: cython.const[cython.longlong][::1],
    folded_back: cython.double,
    most_folded: cython.double,
):
    """Triangles in the loops of outer edges.

    Of each loop, the ear with the smallest circumscribed circle is cut off again and again, as long as one may be: a
    small gap is filled, and of a hole or of the border the notches. Ears that fold back are cut last, and only where
    nothing is left of the loop then, as in creases.

    Parameters
    ----------
    P : (n, 3) float64
        Points.
    ends : (k, 2) int32
        Outer edges: sides of one triangle alone.
    opposite : (k,) int32
        The third corner of this triangle.
    at : (n, 2) int32
        The outer edges at points that have two, -1 at others: no loop goes through these.
    largest : (n,) float64
        Largest radius of circles through each point.
    edges : (e,) int64
        All edges of the surface, the numbers ``lower * n + upper`` in ascending order: none gets another triangle.
    folded_back, most_folded : float
        Cosines of the angle to the neighbour at an edge, 1 where the two lie on each other: the largest of triangles
        that are cut first, and of those in loops of which nothing is left.

    Returns
    -------
    triangles : (t, 3) int32
    is_closed : (t,) bool
        Whether nothing is left of the loop.
    """
    k: cython.Py_ssize_t = ends.shape[0]
    found, whole = np.empty((k, 3), np.int32), np.empty(k, np.bool_)
    is_closed: cython.uchar[::1] = whole.view(np.uint8)
    triangles: cython.int[:, ::1] = found
    seen: cython.uchar[::1] = np.zeros(k, np.uint8)
    ring: cython.int[::1] = np.empty(k, np.int32)
    beyond: cython.int[::1] = np.empty(k, np.int32)
    radius: cython.double[::1] = np.empty(k)
    count: cython.Py_ssize_t = 0
    with cython.nogil:
        for e in range(k):
            if not seen[e]:
                size: cython.Py_ssize_t = _loop(e, ends, opposite, at, seen, ring, beyond)
                if size >= 3:
                    cut: cython.Py_ssize_t = _fill(
                        P, ring, beyond, radius, size, largest, edges, folded_back, most_folded, triangles[count:]
                    )
                    is_closed[count : count + cut] = cut == size - 2
                    count += cut
    return found[:count], whole[:count]


@cython.cfunc
@cython.nogil
def _loop(
    start: cython.Py_ssize_t,
    ends: cython.const[cython.int][:, ::1],
    opposite: cython.const[cython.int][::1],
    at: cython.const[cython.int][:, ::1],
    seen: cython.uchar[::1],
    ring: cython.int[::1],
    beyond: cython.int[::1],
) -> cython.Py_ssize_t:
    """The points of the loop from an edge on, and the corners opposite to the edges; their number, 0 if it ends."""
    size: cython.Py_ssize_t = 0
    e: cython.Py_ssize_t = start
    point: cython.int = ends[e, 0]
    while not seen[e]:
        seen[e] = 1
        ring[size], beyond[size] = point, opposite[e]
        size += 1
        point = ends[e, 1] if ends[e, 0] == point else ends[e, 0]
        if at[point, 0] < 0:
            return 0
        e = at[point, 1] if at[point, 0] == e else at[point, 0]
    return size if e == start else 0


@cython.cfunc
@cython.nogil
def _fill(
    P: cython.const[cython.double][:, ::1],
    ring: cython.int[::1],
    beyond: cython.int[::1],
    radius: cython.double[::1],
    size: cython.Py_ssize_t,
    largest: cython.const[cython.double][::1],
    edges: cython.const[cython.longlong][::1],
    folded_back: cython.double,
    most_folded: cython.double,
    triangles: cython.int[:, ::1],
) -> cython.Py_ssize_t:
    """Cut ears from a ring of points while there are any; how many."""
    count: cython.Py_ssize_t = 0
    flat: cython.Py_ssize_t = -1
    limit: cython.double = folded_back
    for i in range(size):
        radius[i] = _ear(P, ring, beyond, size, i, largest, edges, limit)
    while size > 2:
        best: cython.Py_ssize_t = 0
        for i in range(1, size):
            if radius[i] < radius[best]:
                best = i
        if radius[best] == INFINITY:
            if flat >= 0:
                return flat
            flat, limit = count, most_folded
            for i in range(size):
                radius[i] = _ear(P, ring, beyond, size, i, largest, edges, limit)
            continue
        before: cython.Py_ssize_t = size - 1 if best == 0 else best - 1
        triangles[count, 0], triangles[count, 1] = ring[before], ring[best]
        triangles[count, 2] = ring[0 if best == size - 1 else best + 1]
        count += 1
        beyond[before] = ring[best]
        size -= 1
        for i in range(best, size):
            ring[i], beyond[i], radius[i] = ring[i + 1], beyond[i + 1], radius[i + 1]
        # The two neighbours have other ears now.
        for i in range(best - 1, best + 1):
            j: cython.Py_ssize_t = (i + size) % size
            radius[j] = _ear(P, ring, beyond, size, j, largest, edges, limit)
        if size == 3:  # one triangle is left
            radius[0] = radius[1] = radius[2] = _ear(P, ring, beyond, size, 0, largest, edges, limit)
    return count


@cython.cfunc
@cython.nogil
def _ear(
    P: cython.const[cython.double][:, ::1],
    ring: cython.int[::1],
    beyond: cython.int[::1],
    size: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    largest: cython.const[cython.double][::1],
    edges: cython.const[cython.longlong][::1],
    most_folded: cython.double,
) -> cython.double:
    """Radius of the circle through point i of a ring and its neighbours; infinite if it may not be cut."""
    before: cython.Py_ssize_t = size - 1 if i == 0 else i - 1
    after: cython.Py_ssize_t = 0 if i == size - 1 else i + 1
    a: cython.int = ring[before]
    b: cython.int = ring[i]
    c: cython.int = ring[after]
    if size > 3 and _is_edge(edges, min(a, c), max(a, c), P.shape[0]):
        return INFINITY
    radius: cython.double = _circumradius(P, a, b, c)
    # The last triangle has no edge of its own, and closes the gap even if its corners lie on a line.
    if size > 3 and radius >= min(largest[a], min(largest[b], largest[c])):
        return INFINITY
    folded: cython.double = max(_fold(P, a, b, c, beyond[before]), _fold(P, b, c, a, beyond[i]))
    if size == 3:
        folded = max(folded, _fold(P, c, a, b, beyond[after]))
    return INFINITY if folded > most_folded else radius


@cython.cfunc
@cython.nogil
def _is_edge(
    edges: cython.const[cython.longlong][::1], lower: cython.longlong, upper: cython.longlong, n: cython.longlong
) -> cython.bint:
    code: cython.longlong = lower * n + upper
    low: cython.Py_ssize_t = 0
    high: cython.Py_ssize_t = edges.shape[0]
    while low < high:
        middle: cython.Py_ssize_t = (low + high) // 2
        if edges[middle] < code:
            low = middle + 1
        else:
            high = middle
    return low < edges.shape[0] and edges[low] == code


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
