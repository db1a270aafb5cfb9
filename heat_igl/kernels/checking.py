"""How far distances leave the bounds that need no reference: straight lines from below, edges from above."""

import cython
import numpy as np
from cython.cimports.libc.math import fabs, isfinite, sqrt

__all__ = ["edge_excess", "line_shortfall", "straight_lines"]


def edge_excess(
    distance: cython.double[::1],
    i: cython.longlong[::1],
    j: cython.longlong[::1],
    length: cython.double[::1],
):
    """By how much differences along edges exceed the lengths of the edges.

    Parameters
    ----------
    distance : (n,) float64
        Distances; edges with one that is not finite are left out.
    i, j, length : (e,) int64, (e,) int64, (e,) float64
        Edges, each with the vertices at the ends.

    Returns
    -------
    total, excess : float
        Sum of the lengths, and of the excess of the differences over them.
    worst : int
        Edge with the largest excess; -1 if there is none.
    """
    k: cython.Py_ssize_t
    worst: cython.Py_ssize_t = -1
    total: cython.double = 0.0
    excess: cython.double = 0.0
    largest: cython.double = 0.0
    with cython.nogil:
        for k in range(i.shape[0]):
            difference: cython.double = fabs(distance[i[k]] - distance[j[k]])
            if not isfinite(difference):
                continue
            total += length[k]
            if difference > length[k]:
                excess += difference - length[k]
                if difference - length[k] > largest:
                    largest = difference - length[k]
                    worst = k
    return total, excess, worst


def straight_lines(
    positions: cython.const[cython.double][:, ::1],
    sources: cython.const[cython.double][:, ::1],
    offsets: cython.const[cython.double][::1],
):
    """Length (p,) of the shortest straight line from each position to a source, the source's offset added."""
    found = np.empty(positions.shape[0])
    shortest: cython.double[::1] = found
    k: cython.Py_ssize_t
    s: cython.Py_ssize_t
    with cython.nogil:
        for k in range(positions.shape[0]):
            least: cython.double = 1e308
            for s in range(sources.shape[0]):
                x: cython.double = positions[k, 0] - sources[s, 0]
                y: cython.double = positions[k, 1] - sources[s, 1]
                z: cython.double = positions[k, 2] - sources[s, 2]
                line: cython.double = sqrt(x * x + y * y + z * z) + offsets[s]
                if line < least:
                    least = line
            shortest[k] = least
    return found


def line_shortfall(
    distance: cython.double[::1], vertex: cython.longlong[::1], line: cython.double[::1], start: cython.double
):
    """By how much distances fall short of straight lines.

    Parameters
    ----------
    distance : (n,) float64
        Distances; those that are not finite are left out.
    vertex, line : (p,) int64, (p,) float64
        Vertices, and the straight line from each to the nearest source.
    start : float
        The smallest value that distance begins at: all are taken from there.

    Returns
    -------
    count : int
        Vertices looked at.
    shortfall : float
        Sum of ``(line - distance) / (line - start)`` over the vertices at which it is positive.
    largest : float
        Largest ``line - distance``.
    farthest : float
        Largest distance.
    worst : int
        Position in `vertex` of the largest; -1 if no distance falls short.
    """
    k: cython.Py_ssize_t
    worst: cython.Py_ssize_t = -1
    count: cython.longlong = 0
    total: cython.double = 0.0
    largest: cython.double = 0.0
    farthest: cython.double = 0.0
    with cython.nogil:
        for k in range(vertex.shape[0]):
            d: cython.double = distance[vertex[k]]
            if not isfinite(d) or line[k] <= start:
                continue
            count += 1
            farthest = max(farthest, d - start)
            if d < line[k]:
                total += (line[k] - d) / (line[k] - start)
                if line[k] - d > largest:
                    largest = line[k] - d
                    worst = k
    return count, total, largest, farthest, worst
