"""Triangles between the fans of a vertex: parts that meet in a vertex alone are joined beside it."""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt


def joining_triangles(
    P: cython.const[cython.double][:, ::1],
    triangles: cython.const[cython.int][:, ::1],
    pinched: cython.const[cython.longlong][::1],
):
    """Triangles (k, 3) int32 between fans with an end at each `pinched` vertex, the smallest angle there first.

    `triangles` (m, 3) are all those around the pinched vertices and around the neighbours of these, at most two at an
    edge, and an edge gets no third one.
    """
    m: cython.Py_ssize_t = triangles.shape[0]
    # A vertex gets fewer triangles than it has fans.
    rows = np.empty((4 * m, 3), np.int32)
    rows[:m] = triangles
    found: cython.int[:, ::1] = rows
    head: cython.int[::1] = np.full(P.shape[0], -1, np.int32)
    following: cython.int[:, ::1] = np.empty((4 * m, 3), np.int32)
    end: cython.int[::1] = np.empty(6 * m, np.int32)
    fan: cython.int[::1] = np.empty(6 * m, np.int32)
    count: cython.Py_ssize_t = m
    with cython.nogil:
        for f in range(m):
            _enter(found, head, following, f)
        for row in range(pinched.shape[0]):
            while _join(P, pinched[row], found, head, following, count, end, fan):
                _enter(found, head, following, count)
                count += 1
    return rows[m:count]


@cython.cfunc
@cython.nogil
def _enter(
    found: cython.int[:, ::1], head: cython.int[::1], following: cython.int[:, ::1], f: cython.Py_ssize_t
) -> cython.void:
    """Put triangle f before the other triangles of its corners."""
    for c in range(3):
        following[f, c] = head[found[f, c]]
        head[found[f, c]] = cython.cast(cython.int, 3 * f + c)


@cython.cfunc
@cython.nogil
def _join(
    P: cython.const[cython.double][:, ::1],
    vertex: cython.Py_ssize_t,
    found: cython.int[:, ::1],
    head: cython.int[::1],
    following: cython.int[:, ::1],
    count: cython.Py_ssize_t,
    end: cython.int[::1],
    fan: cython.int[::1],
) -> cython.bint:
    """Put the triangle between two fans of a vertex with the smallest angle there into row `count`, if there is one."""
    size: cython.Py_ssize_t = 0
    # The other two corners of each triangle, side by side, and the fan of both.
    h: cython.Py_ssize_t = head[vertex]
    while h >= 0:
        for c in range(2):
            end[size + c] = found[h // 3, (h + 1 + c) % 3]
            fan[size + c] = cython.cast(cython.int, size // 2)
        size += 2
        h = following[h // 3, h % 3]
    for i in range(size):
        for j in range(i):
            if end[i] == end[j] and fan[i] != fan[j]:
                one: cython.int = fan[i]
                for k in range(size):
                    if fan[k] == one:
                        fan[k] = fan[j]
    closest: cython.double = -2.0
    for i in range(size):
        if _is_inner(end, size, i):
            continue
        for j in range(i):
            if fan[i] == fan[j] or _is_inner(end, size, j):
                continue
            alike: cython.double = _cosine(P, vertex, end[i], end[j])
            if alike > closest and _triangles_at(found, head, following, end[i], end[j]) < 2:
                closest = alike
                found[count, 0], found[count, 1] = cython.cast(cython.int, vertex), end[j]
                found[count, 2] = end[i]
    return closest > -2.0


@cython.cfunc
@cython.nogil
def _is_inner(end: cython.int[::1], size: cython.Py_ssize_t, i: cython.Py_ssize_t) -> cython.bint:
    """Whether there are triangles on both sides of the edge to a neighbour."""
    for j in range(size):
        if j != i and end[j] == end[i]:
            return True
    return False


@cython.cfunc
@cython.nogil
def _cosine(
    P: cython.const[cython.double][:, ::1], vertex: cython.Py_ssize_t, a: cython.Py_ssize_t, b: cython.Py_ssize_t
) -> cython.double:
    """Cosine of the angle at the vertex."""
    along: cython.double = 0.0
    of_a: cython.double = 0.0
    of_b: cython.double = 0.0
    for x in range(3):
        to_a: cython.double = P[a, x] - P[vertex, x]
        to_b: cython.double = P[b, x] - P[vertex, x]
        along += to_a * to_b
        of_a += to_a * to_a
        of_b += to_b * to_b
    size: cython.double = sqrt(of_a) * sqrt(of_b)
    return along / size if size > 0.0 else 1.0


@cython.cfunc
@cython.nogil
def _triangles_at(
    found: cython.int[:, ::1], head: cython.int[::1], following: cython.int[:, ::1], a: cython.int, b: cython.int
) -> cython.Py_ssize_t:
    """How many triangles the edge from a to b has."""
    count: cython.Py_ssize_t = 0
    h: cython.Py_ssize_t = head[a]
    while h >= 0:
        count += found[h // 3, (h + 1) % 3] == b or found[h // 3, (h + 2) % 3] == b
        h = following[h // 3, h % 3]
    return count
