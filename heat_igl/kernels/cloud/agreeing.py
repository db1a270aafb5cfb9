"""Triangles of a point cloud as the stars of several points have them: agreement of stars, and orientation."""

import cython
import numpy as np

__all__ = ["agreement", "orient"]


def agreement(
    first: cython.const[cython.longlong][::1],
    triangles: cython.const[cython.int][:, ::1],
    radii: cython.const[cython.double][::1],
    is_closed: cython.const[cython.uchar][::1],
    begin: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
):
    """In how many stars the triangles are, for the stars of the points from `begin` to `end`.

    Parameters
    ----------
    first : (n + 1,) int64
        The star of point i has rows ``first[i]`` to ``first[i + 1]`` of `triangles`.
    triangles : (s, 3) int32
        The triangles of all stars, the point itself first.
    radii : (s,) float64
        Of their circles.
    is_closed : (n,) uint8
        Whether a star goes all the way around its point.

    Returns
    -------
    count : (b,) uint8
        For each row of these stars the number of stars that have the triangle, 1 to 3, in the star of its lowest point
        that has it; 0 in the others.
    radius : (b,) float64
        The largest radius that one of these stars gives the triangle.
    is_settled : (end - begin,) uint8
        Whether the star of a point is closed, and all its triangles are in three stars.
    """
    offset: cython.Py_ssize_t = first[begin]
    counts, largest = np.zeros(first[end] - offset, np.uint8), np.empty(first[end] - offset)
    settled = np.empty(end - begin, np.uint8)
    count: cython.uchar[::1] = counts
    radius: cython.double[::1] = largest
    is_settled: cython.uchar[::1] = settled
    i: cython.Py_ssize_t
    row: cython.Py_ssize_t
    with cython.nogil:
        for i in range(begin, end):
            is_settled[i - begin] = is_closed[i]
            for row in range(first[i], first[i + 1]):
                a: cython.int = triangles[row, 1]
                b: cython.int = triangles[row, 2]
                of_a: cython.Py_ssize_t = _row_of(first, triangles, a, b, triangles[row, 0])
                of_b: cython.Py_ssize_t = _row_of(first, triangles, b, a, triangles[row, 0])
                if of_a < 0 or of_b < 0:
                    is_settled[i - begin] = 0
                if (of_a >= 0 and a < i) or (of_b >= 0 and b < i):
                    continue
                count[row - offset] = 1 + (of_a >= 0) + (of_b >= 0)
                radius[row - offset] = radii[row]
                if of_a >= 0:
                    radius[row - offset] = max(radius[row - offset], radii[of_a])
                if of_b >= 0:
                    radius[row - offset] = max(radius[row - offset], radii[of_b])
    return counts, largest, settled


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _row_of(
    first: cython.const[cython.longlong][::1],
    triangles: cython.const[cython.int][:, ::1],
    i: cython.int,
    a: cython.int,
    b: cython.int,
) -> cython.Py_ssize_t:
    """The row of the triangle of i, a and b in the star of i, or -1."""
    row: cython.Py_ssize_t
    for row in range(first[i], first[i + 1]):
        p: cython.int = triangles[row, 1]
        q: cython.int = triangles[row, 2]
        if (p == a and q == b) or (p == b and q == a):
            return row
    return -1


def orient(F: cython.int[:, ::1], n: cython.Py_ssize_t):
    """Turn triangles until neighbours run along their common edge in opposite directions, as far as that is possible.

    Parameters
    ----------
    F : (m, 3) int32
        Triangles on n vertices, at most two at an edge; corners 1 and 2 of some are exchanged.

    Returns
    -------
    part : (m,) int32
        The part of each triangle: those that are joined by edges, counted from 0.
    is_oriented : bool
        Whether all neighbours run in opposite directions now.
    """
    m: cython.Py_ssize_t = F.shape[0]
    parts = np.full(m, -1, np.int32)
    part: cython.int[::1] = parts
    first: cython.int[::1] = np.zeros(n + 1, np.int32)
    around: cython.int[::1] = np.empty(3 * m, np.int32)
    queue: cython.int[::1] = np.empty(m, np.int32)
    f: cython.Py_ssize_t
    c: cython.Py_ssize_t
    n_parts: cython.int = 0
    is_oriented: cython.bint = True
    with cython.nogil:
        for f in range(m):
            for c in range(3):
                first[F[f, c]] += 1
        for f in range(n):
            first[f + 1] += first[f]
        # From the ends of the groups to their beginnings.
        for f in range(m - 1, -1, -1):
            for c in range(3):
                first[F[f, c]] -= 1
                around[first[F[f, c]]] = cython.cast(cython.int, f)
        for f in range(m):
            if part[f] < 0:
                if not _orient_part(F, f, n_parts, first, around, queue, part):
                    is_oriented = False
                n_parts += 1
    return parts, bool(is_oriented)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _orient_part(
    F: cython.int[:, ::1],
    start: cython.Py_ssize_t,
    number: cython.int,
    first: cython.int[::1],
    around: cython.int[::1],
    queue: cython.int[::1],
    part: cython.int[::1],
) -> cython.bint:
    """Give the part of triangle `start` the number, breadth first, and orient it alike; whether that is possible."""
    is_oriented: cython.bint = True
    begin: cython.Py_ssize_t = 0
    end: cython.Py_ssize_t = 1
    queue[0] = cython.cast(cython.int, start)
    part[start] = number
    c: cython.Py_ssize_t
    e: cython.Py_ssize_t
    row: cython.Py_ssize_t
    while begin < end:
        f: cython.Py_ssize_t = queue[begin]
        begin += 1
        for c in range(3):
            tail: cython.int = F[f, c]
            head: cython.int = F[f, 0 if c == 2 else c + 1]
            for row in range(first[tail], first[tail + 1]):
                g: cython.Py_ssize_t = around[row]
                if g == f:
                    continue
                for e in range(3):
                    if F[g, e] == tail:
                        break
                # From the tail, the neighbour must not go on to the head.
                runs_alike: cython.bint = F[g, 0 if e == 2 else e + 1] == head
                if not runs_alike and F[g, 2 if e == 0 else e - 1] != head:
                    continue
                if part[g] >= 0:
                    is_oriented = is_oriented and not runs_alike
                else:
                    if runs_alike:
                        F[g, 1], F[g, 2] = F[g, 2], F[g, 1]
                    part[g] = number
                    queue[end] = cython.cast(cython.int, g)
                    end += 1
                # An edge has no third triangle.
                break
    return is_oriented
