"""Edges of triangles and connected components, by counting instead of comparing."""

import cython
import numpy as np


def edges_of_triangles(F: cython.const[cython.longlong][:, ::1], n: cython.Py_ssize_t):
    """The distinct edges of triangles F (m, 3) on n vertices, in lexicographic order.

    Returns the ends (k, 2) of each edge, ascending; the edge (m, 3) opposite each corner; and the number (k,) of sides
    of triangles at each edge.
    """
    size: cython.Py_ssize_t = 3 * F.shape[0]
    by_upper, by_both, number = np.empty(size, np.int64), np.empty(size, np.int64), np.empty(size, np.int64)
    order: cython.longlong[::1] = by_upper
    sorted_sides: cython.longlong[::1] = by_both
    edge: cython.longlong[::1] = number
    place: cython.longlong[::1] = np.empty(n + 1, np.int64)
    k: cython.longlong = -1
    lower: cython.longlong = -1
    upper: cython.longlong = -1
    with cython.nogil:
        for i in range(size):
            sorted_sides[i] = i
        _by_end(F, sorted_sides, order, place, False)
        _by_end(F, order, sorted_sides, place, True)
        for i in range(size):
            h: cython.longlong = sorted_sides[i]
            if _end(F, h, True) != lower or _end(F, h, False) != upper:
                k += 1
                lower, upper = _end(F, h, True), _end(F, h, False)
            edge[h] = k
    ends, counts = np.empty((k + 1, 2), np.int64), np.zeros(k + 1, np.int64)
    vertices: cython.longlong[:, ::1] = ends
    n_faces: cython.longlong[::1] = counts
    with cython.nogil:
        for i in range(size):
            vertices[edge[i], 0], vertices[edge[i], 1] = _end(F, i, True), _end(F, i, False)
            n_faces[edge[i]] += 1
    return ends, number.reshape(-1, 3), counts


def corners_by_vertex(corners: cython.const[cython.int][:, ::1], n: cython.Py_ssize_t):
    """The corners ``size * simplex + corner`` at vertex v: places ``first[v]`` to ``first[v + 1]`` of `incident`."""
    size: cython.Py_ssize_t = corners.shape[1]
    begins, found = np.zeros(n + 2, np.int32), np.empty(corners.shape[0] * size, np.int32)
    # One place ahead, until each corner has moved the begin of its vertex to the end.
    place: cython.int[::1] = begins
    incident: cython.int[::1] = found
    with cython.nogil:
        for i in range(incident.shape[0]):
            place[corners[i // size, i % size] + 2] += 1
        for i in range(n):
            place[i + 2] += place[i + 1]
        for i in range(incident.shape[0]):
            incident[place[corners[i // size, i % size] + 1]] = i
            place[corners[i // size, i % size] + 1] += 1
    return begins[:-1], found


@cython.cfunc
@cython.inline
@cython.nogil
def _end(
    F: cython.const[cython.longlong][:, ::1], half_edge: cython.longlong, is_lower: cython.bint
) -> cython.longlong:
    """The lower or the upper end of the side opposite a corner."""
    f: cython.longlong = half_edge // 3
    c: cython.longlong = half_edge - 3 * f
    a: cython.longlong = F[f, 1 if c == 0 else 0]
    b: cython.longlong = F[f, 1 if c == 2 else 2]
    return min(a, b) if is_lower else max(a, b)


@cython.cfunc
@cython.nogil
def _by_end(
    F: cython.const[cython.longlong][:, ::1],
    sides: cython.longlong[::1],
    ordered: cython.longlong[::1],
    place: cython.longlong[::1],
    is_lower: cython.bint,
) -> cython.void:
    """Sort sides by one of their ends; those with the same end stay in order. `place` (n + 1,) is working space."""
    place[:] = 0
    for i in range(sides.shape[0]):
        place[_end(F, sides[i], is_lower) + 1] += 1
    for i in range(place.shape[0] - 1):
        place[i + 1] += place[i]
    for i in range(sides.shape[0]):
        v: cython.longlong = _end(F, sides[i], is_lower)
        ordered[place[v]] = sides[i]
        place[v] += 1


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
@cython.inline
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
