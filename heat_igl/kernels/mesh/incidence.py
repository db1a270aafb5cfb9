"""Distinct rows, corners by vertex and connected components, by counting instead of comparing."""

import cython
import numpy as np


def unique_rows(columns: cython.const[cython.int][:, ::1], n: cython.Py_ssize_t):
    """As `heat_igl.mesh.connectivity.unique_rows`, of rows that are given by columns (d, r)."""
    size: cython.Py_ssize_t = columns.shape[1]
    ascending, sorted_once, inverses = (
        np.arange(size, dtype=np.int32),
        np.empty(size, np.int32),
        np.empty(size, np.int64),
    )
    order: cython.int[::1] = ascending
    spare: cython.int[::1] = sorted_once
    inverse: cython.longlong[::1] = inverses
    place: cython.int[::1] = np.empty(n + 1, np.int32)
    k: cython.int = 0
    column: cython.Py_ssize_t
    with cython.nogil:
        # By the last column first: rows that are equal there stay in order.
        for column in range(columns.shape[0] - 1, -1, -1):
            place[:] = 0
            for i in range(size):
                place[columns[column, i] + 1] += 1
            for v in range(n):
                place[v + 1] += place[v]
            for i in range(size):
                v = columns[column, order[i]]
                spare[place[v]] = order[i]
                place[v] += 1
            order[:] = spare
        for i in range(size):
            is_new: cython.bint = i == 0
            for column in range(columns.shape[0]):
                is_new = is_new or columns[column, order[i]] != columns[column, order[i - 1]]
            if is_new:
                spare[k] = i
                k += 1
            inverse[order[i]] = k - 1
    start = sorted_once[:k].astype(np.int64)
    return ascending[start].astype(np.int64), inverses, np.diff(start, append=size)


def corners_by_vertex(corners: cython.const[cython.int][:, ::1], n: cython.Py_ssize_t):
    """The corners ``size * simplex + corner`` at vertex v: places ``first[v]`` to ``first[v + 1]`` of `incident`."""
    size: cython.Py_ssize_t = corners.shape[1]
    begins, found = np.zeros(n + 2, np.int32), np.empty(corners.shape[0] * size, np.int32)
    # One place ahead, until each corner has moved the begin of its vertex to the end.
    place: cython.int[::1] = begins
    incident: cython.int[::1] = found
    with cython.nogil:
        for i in range(corners.shape[0]):
            for c in range(size):
                place[corners[i, c] + 2] += 1
        for i in range(n):
            place[i + 2] += place[i + 1]
        for i in range(corners.shape[0]):
            for c in range(size):
                incident[place[corners[i, c] + 1]] = i * size + c
                place[corners[i, c] + 1] += 1
    return begins[:-1], found


def components(F: cython.const[cython.longlong][:, ::1], n: cython.Py_ssize_t):
    """Labels (n,) int64 of the connected components, ascending by their lowest vertex (Galler and Fischer 1964).

    `F` (m, k) int64 has the vertices of each face; a vertex that no face uses is a component of its own.
    """
    labels = np.arange(n)
    above: cython.longlong[::1] = labels  # a vertex of the same component, not above this one; then the label
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(1, F.shape[1]):
                _join(above, F[f, 0], F[f, c])
        _number(above)
    return labels


def fans(F: cython.const[cython.int][:, ::1], n: cython.Py_ssize_t):
    """Labels (3 m,) int64 of the fans of corners of triangles F (m, 3), ascending by the first corner of each.

    Corners of one of the n vertices are in one fan if edges join their triangles.
    """
    begins, found = corners_by_vertex(F, n)
    labels = np.arange(len(found))
    first: cython.int[::1] = begins
    incident: cython.int[::1] = found
    above: cython.longlong[::1] = labels
    # The last corner from which an edge to each vertex was seen.
    seen: cython.int[::1] = np.full(n, -1, np.int32)
    with cython.nogil:
        for v in range(n):
            for i in range(first[v], first[v + 1]):
                h: cython.int = incident[i]
                for turn in range(1, 3):
                    w: cython.int = F[h // 3, (h % 3 + turn) % 3]
                    if seen[w] >= 0 and F[seen[w] // 3, seen[w] % 3] == v:
                        _join(above, seen[w], h)
                    seen[w] = h
        _number(above)
    return labels


@cython.cfunc
@cython.nogil
def _number(above: cython.longlong[::1]) -> cython.void:
    """The number of the component in place of what is above each element."""
    count: cython.longlong = 0
    for v in range(above.shape[0]):
        if above[v] == v:
            above[v] = count
            count += 1
        else:
            above[v] = above[above[v]]


@cython.cfunc
@cython.nogil
def _join(above: cython.longlong[::1], a: cython.longlong, b: cython.longlong) -> cython.void:
    """Put the component of the higher lowest vertex below that of the other; paths are halved on the way."""
    while above[a] != a:
        above[a] = above[above[a]]
        a = above[a]
    while above[b] != b:
        above[b] = above[above[b]]
        b = above[b]
    if a < b:
        above[b] = a
    else:
        above[a] = b
