"""Angles of half-edges around the vertices of an oriented manifold triangulation."""

import cython
import numpy as np


def polar_angles(
    angle: cython.double[::1], twin: cython.longlong[::1], first: cython.longlong[::1], outgoing: cython.double[::1]
):
    """Fill `outgoing` (3 m,) with the angle from the reference edge of the tail to each half-edge, counterclockwise.

    `angle` (3 m,) are the angles at the corners, `first` (n,) is one corner at each vertex, -1 if there is none. The
    reference edge of an inner vertex leaves from that corner. On the boundary it is the edge at which the faces begin.

    Returns the sum of the angles (n,), the number of corners that were visited (n,), and whether the faces close up
    around the vertex (n,).
    """
    n: cython.Py_ssize_t = first.shape[0]
    sums, counts, closes = np.zeros(n), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    total: cython.double[::1] = sums
    count: cython.longlong[::1] = counts
    closed: cython.uchar[::1] = closes
    most: cython.longlong = twin.shape[0]
    t: cython.longlong = -1
    with cython.nogil:
        for v in range(n):
            if first[v] < 0:
                continue
            start: cython.longlong = first[v]
            # Clockwise to the boundary, if there is one: across the half-edge that leaves from the corner.
            for _k in range(most):
                t = twin[start + 2 if start % 3 == 0 else start - 1]
                if t < 0:
                    break
                start = t + 2 if t % 3 == 0 else t - 1
                if start == first[v]:
                    break
            at: cython.longlong = start
            for _k in range(most):
                outgoing[at + 2 if at % 3 == 0 else at - 1] = total[v]
                total[v] += angle[at]
                count[v] += 1
                # Counterclockwise: across the half-edge that arrives at the corner.
                t = twin[at - 2 if at % 3 == 2 else at + 1]
                if t < 0:
                    break
                at = t - 2 if t % 3 == 2 else t + 1
                if at == start:
                    break
            closed[v] = t >= 0
    return sums, counts, closes.astype(bool)
