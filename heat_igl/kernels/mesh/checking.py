"""How far distances leave the bounds that need no reference: edges from above, straight lines from below."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, fabs, isfinite, sqrt

__all__ = ["below_line", "edge_excess", "largest_finite", "line_shortfall", "steepest_edge", "straight_lines"]


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


def largest_finite(distance: cython.const[cython.double][::1]) -> float:
    """The largest distance (n,) that is finite; 0 if there is none."""
    i: cython.Py_ssize_t
    largest: cython.double = 0.0
    with cython.nogil:
        for i in range(distance.shape[0]):
            if largest < distance[i] < INFINITY:
                largest = distance[i]
    return largest


def below_line(
    distance: cython.const[cython.double][::1],
    V: cython.const[cython.double][:, ::1],
    step: cython.Py_ssize_t,
    places: cython.const[cython.double][:, ::1],
    offsets: cython.const[cython.double][::1],
    slack: cython.double,
) -> int:
    """The first of every `step`-th vertices that is below the straight lines from all places; -1 if there is none.

    Lines begin at `offsets` (k,) in the `places` (k, 3); distances below them by `slack` count as rounding.
    """
    k: cython.Py_ssize_t
    s: cython.Py_ssize_t
    found: cython.Py_ssize_t = -1
    with cython.nogil:
        for k in range((distance.shape[0] + step - 1) // step):
            i: cython.Py_ssize_t = k * step
            for s in range(places.shape[0]):
                x: cython.double = V[i, 0] - places[s, 0]
                y: cython.double = V[i, 1] - places[s, 1]
                z: cython.double = V[i, 2] - places[s, 2]
                reach: cython.double = distance[i] + slack - offsets[s]
                if reach >= 0 and x * x + y * y + z * z <= reach * reach:
                    break
            else:
                found = i
                break
    return found


def steepest_edge(
    distance: cython.const[cython.double][::1],
    F: cython.const[cython.longlong][:, ::1],
    V: cython.const[cython.double][:, ::1],
    l: cython.const[cython.double][:, ::1],
    cutoff: cython.double,
    slack: cython.double,
):
    """An end of the first edge of simplices along which distance grows by more than the length of the edge.

    Parameters
    ----------
    distance : (n,) float64
        Distances.
    F : (m, 3) or (m, 4) int64
        Triangles or tetrahedra.
    V : (n, 3) float64
        Positions, from which lengths follow; (0, 3) if `l` has them.
    l : (m, 3) float64
        Lengths of the sides of triangles, each opposite its corner; (0, 3) if V has them.
    cutoff : float
        Beyond it distances may be ``inf``, at any vertex.
    slack : float
        An excess that is rounding.

    Returns
    -------
    far, near : int
        Both ends of the edge; -1 if there is none.
    """
    n_corners: cython.int = F.shape[1]
    has_lengths: cython.bint = l.shape[0] > 0
    f: cython.Py_ssize_t
    a: cython.int
    b: cython.int
    i: cython.longlong
    j: cython.longlong
    far: cython.longlong = -1
    near: cython.longlong = -1
    squared: cython.double
    difference: cython.double
    with cython.nogil:
        for f in range(F.shape[0]):
            for a in range(n_corners - 1):
                i = F[f, a]
                for b in range(a + 1, n_corners):
                    j = F[f, b]
                    if has_lengths:
                        squared = l[f, 3 - a - b] * l[f, 3 - a - b]
                    else:
                        x: cython.double = V[i, 0] - V[j, 0]
                        y: cython.double = V[i, 1] - V[j, 1]
                        z: cython.double = V[i, 2] - V[j, 2]
                        squared = x * x + y * y + z * z
                    difference = fabs(distance[i] - distance[j]) - slack
                    # Neither inf nor NaN passes.
                    if difference <= 0 or difference * difference <= squared:
                        continue
                    if distance[i] == INFINITY and distance[j] == INFINITY:
                        continue
                    far, near = (j, i) if distance[i] < distance[j] else (i, j)
                    if distance[far] == INFINITY and not distance[near] + sqrt(squared) < cutoff - slack:
                        far, near = -1, -1
                        continue
                    break
                if far >= 0:
                    break
            if far >= 0:
                break
    return far, near


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
    distance: cython.const[cython.double][::1],
    vertex: cython.const[cython.longlong][::1],
    line: cython.const[cython.double][::1],
    start: cython.double,
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
