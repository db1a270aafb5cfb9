"""Symbolic factorization: the rows of the fronts of a multifrontal factor, and a partition of the tree of fronts."""

import cython
import numpy as np


def front_rows(
    ends: cython.const[cython.int][::1],
    neighbours: cython.const[cython.int][::1],
    order: cython.const[cython.int][::1],
    place: cython.const[cython.int][::1],
    start: cython.const[cython.longlong][::1],
    parent: cython.const[cython.longlong][::1],
):
    """The rows of every front: neighbours of the columns, and rows of the children, that are eliminated later.

    Returns first_row (k + 1,) int64 and rows int32, ascending within each front.
    """
    n: cython.Py_ssize_t = order.shape[0]
    k: cython.Py_ssize_t = parent.shape[0]
    first = np.zeros(k + 1, np.int64)
    first_row: cython.longlong[::1] = first
    found = np.empty(4 * n + 16, np.int32)
    room: cython.int[::1] = found
    # The children of each front found so far, as linked lists.
    child: cython.longlong[::1] = np.full(k, -1, np.int64)
    sibling: cython.longlong[::1] = np.full(k, -1, np.int64)
    seen_by: cython.longlong[::1] = np.full(n, -1, np.int64)
    c: cython.Py_ssize_t
    for b in range(k):
        if first_row[b] + n > room.shape[0]:
            found = np.concatenate([found, np.empty(len(found) + n, np.int32)])
            room = found
        with cython.nogil:
            count: cython.Py_ssize_t = first_row[b]
            end: cython.Py_ssize_t = start[b + 1]
            for i in range(start[b], end):
                v: cython.Py_ssize_t = order[i]
                for p in range(ends[v], ends[v + 1]):
                    count = _append(room, count, place[neighbours[p]], end, seen_by, b)
            c = child[b]
            while c >= 0:
                for p in range(first_row[c], first_row[c + 1]):
                    count = _append(room, count, room[p], end, seen_by, b)
                c = sibling[c]
            first_row[b + 1] = count
            if parent[b] >= 0:
                sibling[b] = child[parent[b]]
                child[parent[b]] = b
    # Sorted by listing the fronts of each row, and dealing the rows out to them in ascending order.
    ordered = np.empty(first_row[k], np.int32)
    row_of: cython.int[::1] = ordered
    fronts: cython.int[::1] = np.empty_like(ordered)
    first_front: cython.longlong[::1] = np.zeros(n + 1, np.int64)
    filled: cython.longlong[::1] = first[:k].copy()
    at: cython.Py_ssize_t = 0
    with cython.nogil:
        for p in range(first_row[k]):
            first_front[room[p] + 1] += 1
        for row in range(n):
            first_front[row + 1] += first_front[row]
        for b in range(k):
            for p in range(first_row[b], first_row[b + 1]):
                fronts[first_front[room[p]]] = b
                first_front[room[p]] += 1
        # Each entry now holds the start of the next row's fronts.
        for row in range(n):
            while at < first_front[row]:
                row_of[filled[fronts[at]]] = row
                filled[fronts[at]] += 1
                at += 1
    return first, ordered


@cython.cfunc
@cython.nogil
def _append(
    rows: cython.int[::1],
    count: cython.Py_ssize_t,
    row: cython.int,
    end: cython.Py_ssize_t,
    seen_by: cython.longlong[::1],
    b: cython.Py_ssize_t,
) -> cython.Py_ssize_t:
    """Append a row of front b, unless it is there already or one of the columns, which `end` follows."""
    if row >= end and seen_by[row] != b:
        seen_by[row] = b
        rows[count] = row
        count += 1
    return count


def tree_pieces(
    parent: cython.const[cython.longlong][::1], entries: cython.const[cython.longlong][::1], most: cython.double
):
    """Cut a tree of fronts into subtrees of at most `most` entries, small ones together.

    Returns the number of pieces, and that of each front (k,) int64; fronts above all pieces get the next number.
    """
    k: cython.Py_ssize_t = parent.shape[0]
    number = np.full(k, -1, np.int64)
    piece: cython.longlong[::1] = number
    below: cython.longlong[::1] = np.array(entries)
    count: cython.Py_ssize_t = 0
    held: cython.longlong = 0
    for b in range(k):
        if parent[b] >= 0:
            below[parent[b]] += below[b]
    for b in range(k - 1, -1, -1):
        if below[b] > most:
            continue
        if parent[b] >= 0 and piece[parent[b]] >= 0:
            piece[b] = piece[parent[b]]
            continue
        held += below[b]
        if count == 0 or held > most:
            count += 1
            held = below[b]
        piece[b] = count - 1
    for b in range(k):
        if piece[b] < 0:
            piece[b] = count
    return count, number
