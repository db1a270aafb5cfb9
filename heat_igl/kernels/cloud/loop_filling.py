"""Triangles that fill small gaps of a surface of points: ears cut from the loops of the outer edges, in space."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.cloud.loop_filling import MOST
from cython.cimports.libc.math import sqrt

__all__ = ["filling_triangles"]


def filling_triangles(
    P: cython.const[cython.double][:, ::1],
    ends: cython.const[cython.int][:, ::1],
    opposite: cython.const[cython.int][::1],
    at: cython.const[cython.int][:, ::1],
    largest: cython.const[cython.double][::1],
    edges: cython.const[cython.longlong][::1],
    most_folded: cython.double,
):
    """Triangles in the loops of at most 40 outer edges that can be filled.

    Of each loop, the ear with the smallest circumscribed circle is cut off again and again. A loop is filled whole or
    not at all.

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
    most_folded : float
        Cosine of the angle to the neighbour at an edge, 1 where the two lie on each other: no triangle has more.

    Returns
    -------
    triangles : (t, 3) int32
        In each loop two fewer than it has edges.
    """
    k: cython.Py_ssize_t = ends.shape[0]
    found = np.empty((k, 3), np.int32)
    triangles: cython.int[:, ::1] = found
    seen: cython.uchar[::1] = np.zeros(k, np.uint8)
    ring: cython.int[::1] = np.empty(MOST, np.int32)
    beyond: cython.int[::1] = np.empty(MOST, np.int32)
    count: cython.Py_ssize_t = 0
    e: cython.Py_ssize_t
    with cython.nogil:
        for e in range(k):
            if not seen[e]:
                size: cython.Py_ssize_t = _loop(e, ends, opposite, at, seen, ring, beyond)
                if size >= 3 and _fill(P, ring, beyond, size, largest, edges, most_folded, triangles[count:]):
                    count += size - 2
    return found[:count]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _loop(
    start: cython.Py_ssize_t,
    ends: cython.const[cython.int][:, ::1],
    opposite: cython.const[cython.int][::1],
    at: cython.const[cython.int][:, ::1],
    seen: cython.uchar[::1],
    ring: cython.int[::1],
    beyond: cython.int[::1],
) -> cython.Py_ssize_t:
    """The points of the loop from an edge on, and the corners opposite to the edges; their number, 0 if too many."""
    size: cython.Py_ssize_t = 0
    e: cython.Py_ssize_t = start
    point: cython.int = ends[e, 0]
    while not seen[e]:
        seen[e] = 1
        if size < MOST:
            ring[size], beyond[size] = point, opposite[e]
        size += 1
        point = ends[e, 1] if ends[e, 0] == point else ends[e, 0]
        if at[point, 0] < 0:
            return 0
        e = at[point, 1] if at[point, 0] == e else at[point, 0]
    return size if e == start and size <= MOST else 0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _fill(
    P: cython.const[cython.double][:, ::1],
    ring: cython.int[::1],
    beyond: cython.int[::1],
    size: cython.Py_ssize_t,
    largest: cython.const[cython.double][::1],
    edges: cython.const[cython.longlong][::1],
    most_folded: cython.double,
    triangles: cython.int[:, ::1],
) -> cython.bint:
    """Cut ears from a ring of points until nothing is left of it; whether that was possible."""
    count: cython.Py_ssize_t = 0
    i: cython.Py_ssize_t
    while size > 2:
        best: cython.Py_ssize_t = -1
        smallest: cython.double = 0.0
        for i in range(size):
            radius: cython.double = _ear(P, ring, beyond, size, i, largest, edges, most_folded)
            if radius >= 0.0 and (best < 0 or radius < smallest):
                best, smallest = i, radius
        if best < 0:
            return False
        before: cython.Py_ssize_t = size - 1 if best == 0 else best - 1
        triangles[count, 0], triangles[count, 1] = ring[before], ring[best]
        triangles[count, 2] = ring[0 if best == size - 1 else best + 1]
        count += 1
        beyond[before] = ring[best]
        size -= 1
        for i in range(best, size):
            ring[i], beyond[i] = ring[i + 1], beyond[i + 1]
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
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
    """Radius of the circle around the triangle of point i of a ring and its neighbours; -1 if it must not be cut."""
    before: cython.Py_ssize_t = size - 1 if i == 0 else i - 1
    after: cython.Py_ssize_t = 0 if i == size - 1 else i + 1
    a: cython.int = ring[before]
    b: cython.int = ring[i]
    c: cython.int = ring[after]
    if size > 3 and _is_edge(edges, min(a, c), max(a, c), P.shape[0]):
        return -1.0
    radius: cython.double = _circumradius(P, a, b, c)
    # The last triangle has no edge of its own, and closes the gap even if its corners lie on a line.
    if size > 3 and radius >= min(largest[a], min(largest[b], largest[c])):
        return -1.0
    folded: cython.double = max(_fold(P, a, b, c, beyond[before]), _fold(P, b, c, a, beyond[i]))
    if size == 3:
        folded = max(folded, _fold(P, c, a, b, beyond[after]))
    return -1.0 if folded > most_folded else radius


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
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
@cython.exceptval(check=False)
def _circumradius(
    P: cython.const[cython.double][:, ::1], a: cython.Py_ssize_t, b: cython.Py_ssize_t, c: cython.Py_ssize_t
) -> cython.double:
    u: cython.double = 0.0
    v: cython.double = 0.0
    along: cython.double = 0.0
    third: cython.double = 0.0
    x: cython.Py_ssize_t
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
@cython.exceptval(check=False)
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
    x: cython.Py_ssize_t
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
