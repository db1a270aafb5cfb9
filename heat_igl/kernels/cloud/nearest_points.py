"""Nearest points, by a binary tree of boxes over points that are sorted so that near ones are near in memory."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.cloud.nearest_points import IN_A_BOX, PARTS, ROOM, ROUNDED_UP, ROUNDING, TINY
from cython.cimports.libc.math import INFINITY, fabs, sqrt


def tree_of_boxes(P: cython.const[cython.double][:, ::1]):
    """The boxes (2 m, 6) around the sorted points P (n, 3): middles, and halves of the sides.

    Box b < m holds boxes 2 b and 2 b + 1, and box m + i points from `IN_A_BOX` i on; box 1 holds all, and 0 is none.
    """
    n: cython.Py_ssize_t = P.shape[0]
    m: cython.Py_ssize_t = (n + IN_A_BOX - 1) // IN_A_BOX
    found = np.full((2 * m, 6), np.inf)
    box: cython.double[:, ::1] = found
    with cython.nogil:
        for b in range(2 * m):
            box[b, 3], box[b, 4], box[b, 5] = -INFINITY, -INFINITY, -INFINITY
        for j in range(n):
            b = m + j // IN_A_BOX
            for x in range(3):
                box[b, x], box[b, 3 + x] = min(box[b, x], P[j, x]), max(box[b, 3 + x], P[j, x])
        for b in range(2 * m - 1, 1, -1):
            for x in range(3):
                box[b // 2, x] = min(box[b // 2, x], box[b, x])
                box[b // 2, 3 + x] = max(box[b // 2, 3 + x], box[b, 3 + x])
        for b in range(1, 2 * m):
            for x in range(3):
                low: cython.double = box[b, x]
                high: cython.double = box[b, 3 + x]
                box[b, x] = 0.5 * low + 0.5 * high
                # A point on a side of its box is in it, whatever the rounding of the middle.
                box[b, 3 + x] = 0.5 * high - 0.5 * low + ROUNDING * (fabs(low) + fabs(high))
    return found


def nearest_points(
    P: cython.const[cython.double][:, ::1],
    boxes: cython.const[cython.double][:, ::1],
    places: cython.const[cython.double][:, ::1],
    k: cython.Py_ssize_t,
):
    """The k points nearest to each of some places (b, 3), by distance, and the distance (b,) of the last.

    There are k or more points P (n, 3), with their `tree_of_boxes`. The points found for one place bound the distance
    for the next: the search is fastest for places that are sorted like the points. Returns indices (b, k) int32.
    """
    found, distances = np.empty((places.shape[0], k), np.int32), np.empty(places.shape[0])
    index: cython.int[:, ::1] = found
    distance: cython.double[::1] = distances
    square: cython.double[:, ::1] = np.empty((2, 4 * k + 2 * IN_A_BOX))
    # Row 0 has the points nearest to the place before, and at first any.
    point: cython.int[:, ::1] = np.tile(np.arange(4 * k + 2 * IN_A_BOX, dtype=np.int32), (2, 1))
    with cython.nogil:
        for i in range(places.shape[0]):
            bound: cython.double = 0.0
            for j in range(k):
                bound = max(bound, _squared_distance(P, point[0, j], places, i))
            _search(P, boxes, places, i, k, ROUNDED_UP * bound + TINY, square, point)
            for j in range(k):
                index[i, j] = point[0, j]
            distance[i] = sqrt(square[0, k - 1])
    return found, distances


@cython.cfunc
@cython.nogil
def _search(
    P: cython.const[cython.double][:, ::1],
    boxes: cython.const[cython.double][:, ::1],
    places: cython.const[cython.double][:, ::1],
    i: cython.Py_ssize_t,
    k: cython.Py_ssize_t,
    bound: cython.double,
    square: cython.double[:, ::1],
    point: cython.int[:, ::1],
) -> cython.Py_ssize_t:
    """Put the points nearest to place i into row 0 of `point`, those at squared distances up to `bound`; how many."""
    box: cython.Py_ssize_t[ROOM]
    away: cython.double[ROOM]
    m: cython.Py_ssize_t = boxes.shape[0] // 2
    size: cython.Py_ssize_t = 0
    waiting: cython.Py_ssize_t = 1
    box[0], away[0] = 1, 0.0
    while waiting > 0:
        waiting -= 1
        b: cython.Py_ssize_t = box[waiting]
        nearest: cython.double = away[waiting]
        while b < m and nearest <= bound:
            first: cython.double = _away(boxes, 2 * b, places, i)
            second: cython.double = _away(boxes, 2 * b + 1, places, i)
            # The nearer of both is searched first.
            nearer: cython.Py_ssize_t = 2 * b if first <= second else 2 * b + 1
            box[waiting], away[waiting] = 4 * b + 1 - nearer, max(first, second)
            waiting += away[waiting] <= bound
            b, nearest = nearer, min(first, second)
        if nearest > bound:
            continue
        for j in range(IN_A_BOX * (b - m), min(IN_A_BOX * (b - m + 1), P.shape[0])):
            distance: cython.double = _squared_distance(P, j, places, i)
            square[0, size], point[0, size] = distance, cython.cast(cython.int, j)
            size += distance <= bound
        if size > 2 * k:
            size = _sort(square, point, size, k, bound)
            bound = square[0, k - 1]
    return _sort(square, point, size, k, bound)


@cython.cfunc
@cython.nogil
def _sort(
    square: cython.double[:, ::1],
    point: cython.int[:, ::1],
    size: cython.Py_ssize_t,
    k: cython.Py_ssize_t,
    bound: cython.double,
) -> cython.Py_ssize_t:
    """Sort the points in row 0 by squared distance, which is `bound` at most; how many are left, at most k."""
    begin: cython.Py_ssize_t[ROOM]
    # On a surface as many points are in each part, and sorting costs the same for each.
    scale: cython.double = PARTS / bound if bound > TINY else 0.0
    for part in range(ROOM):
        begin[part] = 0
    for j in range(size):
        begin[cython.cast(cython.int, scale * square[0, j]) + 1] += 1
    for part in range(1, PARTS + 1):
        begin[part] += begin[part - 1]
    for j in range(size):
        part = cython.cast(cython.int, scale * square[0, j])
        square[1, begin[part]], point[1, begin[part]] = square[0, j], point[0, j]
        begin[part] += 1
    # Those behind the part that has the last of k are left out.
    part = 0
    while begin[part] < min(size, k):
        part += 1
    for j in range(begin[part]):
        at: cython.Py_ssize_t = j
        while at > 0 and square[0, at - 1] > square[1, j]:
            square[0, at], point[0, at] = square[0, at - 1], point[0, at - 1]
            at -= 1
        square[0, at], point[0, at] = square[1, j], point[1, j]
    return min(size, k)


@cython.cfunc
@cython.inline
@cython.nogil
def _away(
    boxes: cython.const[cython.double][:, ::1],
    b: cython.Py_ssize_t,
    places: cython.const[cython.double][:, ::1],
    i: cython.Py_ssize_t,
) -> cython.double:
    """Squared distance of place i from box b."""
    x: cython.double = fabs(places[i, 0] - boxes[b, 0]) - boxes[b, 3]
    y: cython.double = fabs(places[i, 1] - boxes[b, 1]) - boxes[b, 4]
    z: cython.double = fabs(places[i, 2] - boxes[b, 2]) - boxes[b, 5]
    # Twice the positive parts, without a branch.
    x, y, z = x + fabs(x), y + fabs(y), z + fabs(z)
    return 0.25 * (x * x + y * y + z * z)


@cython.cfunc
@cython.inline
@cython.nogil
def _squared_distance(
    P: cython.const[cython.double][:, ::1],
    i: cython.Py_ssize_t,
    Q: cython.const[cython.double][:, ::1],
    j: cython.Py_ssize_t,
) -> cython.double:
    dx: cython.double = P[i, 0] - Q[j, 0]
    dy: cython.double = P[i, 1] - Q[j, 1]
    dz: cython.double = P[i, 2] - Q[j, 2]
    return dx * dx + dy * dy + dz * dz
