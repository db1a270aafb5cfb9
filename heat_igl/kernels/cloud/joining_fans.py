"""Triangles between the fans of a vertex: parts that meet in a vertex alone are joined beside it."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY


def joining_triangles(
    P: cython.const[cython.double][:, ::1],
    triangles: cython.const[cython.int][:, ::1],
    pinched: cython.const[cython.longlong][::1],
):
    """Triangles (k, 3) int32 between fans with an end at each `pinched` vertex, that with the shortest side first.

    `triangles` (m, 3) are all those around the pinched vertices and around the neighbours of these, at most two at an
    edge. Each triangle runs along its sides against its neighbours, no edge gets a third one, and at no corner does
    one close a fan while there are others.
    """
    m: cython.Py_ssize_t = triangles.shape[0]
    # A vertex gets fewer triangles than it has fans.
    rows = np.empty((4 * m, 3), np.int32)
    rows[:m] = triangles
    found: cython.int[:, ::1] = rows
    head: cython.int[::1] = np.full(P.shape[0], -1, np.int32)
    following: cython.int[:, ::1] = np.empty((4 * m, 3), np.int32)
    count: cython.Py_ssize_t = m
    with cython.nogil:
        for f in range(m):
            _enter(found, head, following, f)
        for row in range(pinched.shape[0]):
            while _join(P, cython.cast(cython.int, pinched[row]), found, head, following, count):
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
    vertex: cython.int,
    found: cython.int[:, ::1],
    head: cython.int[::1],
    following: cython.int[:, ::1],
    count: cython.Py_ssize_t,
) -> cython.bint:
    """Put the triangle between two fans of a vertex with the shortest third side into row `count`, if there is one."""
    shortest: cython.double = INFINITY
    of_a: cython.int = head[vertex]
    while of_a >= 0:
        # Around the vertex, the corner after it begins a triangle, and the one before it ends it.
        a: cython.int = found[of_a // 3, (of_a + 2) % 3]
        of_b: cython.int = head[vertex]
        while of_b >= 0:
            b: cython.int = found[of_b // 3, (of_b + 1) % 3]
            square: cython.double = 0.0
            for x in range(3):
                square += (P[b, x] - P[a, x]) * (P[b, x] - P[a, x])
            if square < shortest and _fits(found, head, following, vertex, a, b):
                shortest = square
                found[count, 0], found[count, 1], found[count, 2] = vertex, a, b
            of_b = following[of_b // 3, of_b % 3]
        of_a = following[of_a // 3, of_a % 3]
    return shortest < INFINITY


@cython.cfunc
@cython.nogil
def _fits(
    found: cython.int[:, ::1],
    head: cython.int[::1],
    following: cython.int[:, ::1],
    vertex: cython.int,
    a: cython.int,
    b: cython.int,
) -> cython.bint:
    """Whether a triangle of a vertex, a and b joins two of its fans, the one that ends at a and that which begins at b.

    Its sides must be outer edges, or the third one new, and run against the triangles there.
    """
    beside: cython.Py_ssize_t = _triangles_at(found, head, following, a, b)
    if a == b or beside < 0 or _triangles_at(found, head, following, vertex, a) != 1:
        return False
    if _triangles_at(found, head, following, b, vertex) != 1:
        return False
    if _left_out(found, head, following, vertex, a, b) >= 0:
        return False
    if beside == 0:
        return True
    return not (
        _left_out(found, head, following, a, b, vertex) > 0 or _left_out(found, head, following, b, vertex, a) > 0
    )


@cython.cfunc
@cython.nogil
def _triangles_at(
    found: cython.int[:, ::1], head: cython.int[::1], following: cython.int[:, ::1], a: cython.int, b: cython.int
) -> cython.Py_ssize_t:
    """How many triangles run from b to a, 0 or 1; -1 if the edge has no side left that runs from a to b."""
    count: cython.Py_ssize_t = 0
    h: cython.int = head[a]
    while h >= 0:
        if found[h // 3, (h + 1) % 3] == b:
            return -1
        count += found[h // 3, (h + 2) % 3] == b
        h = following[h // 3, h % 3]
    return count if count < 2 else -1


@cython.cfunc
@cython.nogil
def _left_out(
    found: cython.int[:, ::1],
    head: cython.int[::1],
    following: cython.int[:, ::1],
    vertex: cython.int,
    a: cython.int,
    b: cython.int,
) -> cython.int:
    """How many triangles of a vertex are in other fans than that which begins at b; -1 if this does not end at a."""
    left: cython.int = 0
    h: cython.int = head[vertex]
    while h >= 0:
        left += 1
        h = following[h // 3, h % 3]
    at: cython.int = b
    h = head[vertex]
    while h >= 0 and left > 0:
        if found[h // 3, (h + 1) % 3] == at:
            at = found[h // 3, (h + 2) % 3]
            left -= 1
            h = head[vertex]
        else:
            h = following[h // 3, h % 3]
    return left if at == a else -1
