"""A k-d tree of points: a complete binary tree, all in arrays, and the nearest points of the points themselves."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, sqrt

__all__ = ["arrange", "nearest"]


def arrange(P: cython.const[cython.double][:, ::1], levels: cython.int):
    """Sort points into the leaves of a complete binary tree.

    Parameters
    ----------
    P : (n, 3) float64
        The points.
    levels : int
        Number of times that the points are halved, so the tree has ``2**levels`` leaves.

    Returns
    -------
    order : (n,) int32
        The points, leaf by leaf. Node i has the children 2 i + 1 and 2 i + 2, and each takes half of the points.
    sorted : (n, 3) float64
        ``P[order]``.
    box : (2**(levels + 1) - 1, 6) float64
        Least and greatest coordinates of the points of each node.
    """
    n: cython.Py_ssize_t = P.shape[0]
    numbers, positions = np.arange(n, dtype=np.int32), np.array(P)
    boxes = np.empty(((2 << levels) - 1, 6))
    order: cython.int[::1] = numbers
    at: cython.double[:, ::1] = positions
    box: cython.double[:, ::1] = boxes
    with cython.nogil:
        _divide(0, 0, n, levels, at, order, box)
    return numbers, positions, boxes


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _divide(
    node: cython.Py_ssize_t,
    begin: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
    levels: cython.int,
    P: cython.double[:, ::1],
    order: cython.int[::1],
    box: cython.double[:, ::1],
) -> cython.void:
    """The node of the points from `begin` to `end`, and all below it: halved across the longest side of the box."""
    i: cython.Py_ssize_t
    x: cython.int
    for x in range(3):
        box[node, x], box[node, 3 + x] = INFINITY, -INFINITY
    for i in range(begin, end):
        for x in range(3):
            box[node, x] = min(box[node, x], P[i, x])
            box[node, 3 + x] = max(box[node, 3 + x], P[i, x])
    if levels == 0:
        return
    axis: cython.int = 0
    for x in range(1, 3):
        if box[node, 3 + x] - box[node, x] > box[node, 3 + axis] - box[node, axis]:
            axis = x
    middle: cython.Py_ssize_t = (begin + end) // 2
    _select(P, order, begin, end, middle, axis)
    _divide(2 * node + 1, begin, middle, levels - 1, P, order, box)
    _divide(2 * node + 2, middle, end, levels - 1, P, order, box)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _select(
    P: cython.double[:, ::1],
    order: cython.int[::1],
    begin: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
    middle: cython.Py_ssize_t,
    axis: cython.int,
) -> cython.void:
    """Bring points with a smaller coordinate before `middle` and those with a larger one behind it: quickselect."""
    left: cython.Py_ssize_t = begin
    right: cython.Py_ssize_t = end - 1
    while left < right:
        pivot: cython.double = P[(left + right) // 2, axis]
        i: cython.Py_ssize_t = left
        j: cython.Py_ssize_t = right
        while i <= j:
            while P[i, axis] < pivot:
                i += 1
            while P[j, axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                P[i, 0], P[j, 0] = P[j, 0], P[i, 0]
                P[i, 1], P[j, 1] = P[j, 1], P[i, 1]
                P[i, 2], P[j, 2] = P[j, 2], P[i, 2]
                i += 1
                j -= 1
        if middle <= j:
            right = j
        elif middle >= i:
            left = i
        else:
            return


def nearest(
    P: cython.const[cython.double][:, ::1],
    box: cython.const[cython.double][:, ::1],
    chosen: cython.const[cython.int][::1],
    k: cython.Py_ssize_t,
):
    """The k nearest points of each of some points, each of which is the first of them.

    Parameters
    ----------
    P, box
        The sorted points and the boxes of `arrange`.
    chosen : (b,) int32
        Rows of `P`; the search is faster if successive ones are near to each other.
    k : int
        At most the number of points.

    Returns
    -------
    index : (b, k) int32
        Rows of `P`, by distance.
    square : (b, k) float64
        Squares of the distances.
    """
    b: cython.Py_ssize_t = chosen.shape[0]
    # Zeros: squares of the distances of points may underflow, and then none is below the limit.
    found, squares = np.zeros((b, k), np.int32), np.full((b, k), np.inf)
    index: cython.int[:, ::1] = found
    square: cython.double[:, ::1] = squares
    # For each node that waits: the first and the last point, and the distance.
    waiting: cython.Py_ssize_t[:, ::1] = np.empty((64, 3), np.intp)
    away: cython.double[::1] = np.empty(64)
    row: cython.Py_ssize_t
    with cython.nogil:
        for row in range(b):
            limit: cython.double = INFINITY
            if row > 0:
                # All k neighbours of the point before are at most so far away.
                limit = sqrt(square[row - 1, k - 1]) + sqrt(_square(P, chosen[row], chosen[row - 1]))
                limit *= 1.000001 * limit
            _search(P, box, chosen[row], limit, index[row], square[row], waiting, away)
    return found, squares


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _square(P: cython.const[cython.double][:, ::1], i: cython.Py_ssize_t, j: cython.Py_ssize_t) -> cython.double:
    x: cython.double = P[i, 0] - P[j, 0]
    y: cython.double = P[i, 1] - P[j, 1]
    z: cython.double = P[i, 2] - P[j, 2]
    return x * x + y * y + z * z


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _search(
    P: cython.const[cython.double][:, ::1],
    box: cython.const[cython.double][:, ::1],
    i: cython.Py_ssize_t,
    limit: cython.double,
    index: cython.int[::1],
    square: cython.double[::1],
    waiting: cython.Py_ssize_t[:, ::1],
    away: cython.double[::1],
) -> cython.void:
    """Fill one row of `nearest` from points at squared distances below `limit`: depth first, the nearer child first."""
    first_leaf: cython.Py_ssize_t = box.shape[0] // 2
    j: cython.Py_ssize_t
    top: cython.int = 1
    waiting[0, 0], waiting[0, 1], waiting[0, 2], away[0] = 0, 0, P.shape[0], 0.0
    while top > 0:
        top -= 1
        node: cython.Py_ssize_t = waiting[top, 0]
        begin: cython.Py_ssize_t = waiting[top, 1]
        end: cython.Py_ssize_t = waiting[top, 2]
        if away[top] >= limit:
            continue
        if node >= first_leaf:
            for j in range(begin, end):
                distance: cython.double = _square(P, i, j)
                if distance < limit:
                    limit = _insert(index, square, j, distance, limit)
            continue
        middle: cython.Py_ssize_t = (begin + end) // 2
        lower: cython.double = _outside(box, 2 * node + 1, P, i)
        upper: cython.double = _outside(box, 2 * node + 2, P, i)
        if lower <= upper:
            waiting[top, 0], waiting[top, 1], waiting[top, 2], away[top] = 2 * node + 2, middle, end, upper
            top += 1
            waiting[top, 0], waiting[top, 1], waiting[top, 2], away[top] = 2 * node + 1, begin, middle, lower
        else:
            waiting[top, 0], waiting[top, 1], waiting[top, 2], away[top] = 2 * node + 1, begin, middle, lower
            top += 1
            waiting[top, 0], waiting[top, 1], waiting[top, 2], away[top] = 2 * node + 2, middle, end, upper
        top += 1


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _insert(
    index: cython.int[::1],
    square: cython.double[::1],
    j: cython.Py_ssize_t,
    distance: cython.double,
    limit: cython.double,
) -> cython.double:
    """Put point j among the nearest ones, and return the squared distance that the next must stay below."""
    place: cython.Py_ssize_t = square.shape[0] - 1
    while place > 0 and square[place - 1] > distance:
        square[place], index[place] = square[place - 1], index[place - 1]
        place -= 1
    square[place], index[place] = distance, cython.cast(cython.int, j)
    return min(limit, square[square.shape[0] - 1])


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _outside(
    box: cython.const[cython.double][:, ::1],
    node: cython.Py_ssize_t,
    P: cython.const[cython.double][:, ::1],
    i: cython.Py_ssize_t,
) -> cython.double:
    """Squared distance of point i from the box of a node."""
    total: cython.double = 0.0
    x: cython.int
    for x in range(3):
        beyond: cython.double = max(max(box[node, x] - P[i, x], P[i, x] - box[node, 3 + x]), 0.0)
        total += beyond * beyond
    return total
