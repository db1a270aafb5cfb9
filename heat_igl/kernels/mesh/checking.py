"""How far distances leave the bounds that need no reference: edges from above, straight lines from below."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, fabs, sqrt


def largest_finite(distance: cython.const[cython.double][::1]) -> float:
    """The largest distance (n,) that is finite; 0 if there is none."""
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
    """The far and the near end of the first edge along which distance grows by more than the length of the edge.

    Both are -1 if there is none. Edges are those of triangles or tetrahedra F (m, 3) or (m, 4). Their lengths follow
    from positions V (n, 3); or, if V is (0, 3), they are the sides `l` (m, 3) of triangles, opposite each corner.
    Beyond the `cutoff` distances may be ``inf``, at any vertex; an excess up to `slack` is rounding.
    """
    n_corners: cython.int = F.shape[1]
    has_lengths: cython.bint = l.shape[0] > 0
    d: cython.double[4]
    x: cython.double[12]
    far: cython.longlong = -1
    near: cython.longlong = -1
    with cython.nogil:
        for f in range(F.shape[0]):
            for a in range(n_corners):
                d[a] = distance[F[f, a]]
                for b in range(0 if has_lengths else 3):
                    x[3 * a + b] = V[F[f, a], b]
            for a in range(n_corners - 1):
                for b in range(a + 1, n_corners):
                    if has_lengths:
                        squared = l[f, 3 - a - b] * l[f, 3 - a - b]
                    else:
                        squared = (
                            (x[3 * a] - x[3 * b]) * (x[3 * a] - x[3 * b])
                            + (x[3 * a + 1] - x[3 * b + 1]) * (x[3 * a + 1] - x[3 * b + 1])
                            + (x[3 * a + 2] - x[3 * b + 2]) * (x[3 * a + 2] - x[3 * b + 2])
                        )
                    difference: cython.double = fabs(d[a] - d[b]) - slack
                    # Neither inf nor NaN passes.
                    if difference <= 0 or difference * difference <= squared:
                        continue
                    if d[a] == INFINITY and d[b] == INFINITY:
                        continue
                    if max(d[a], d[b]) == INFINITY and not min(d[a], d[b]) + sqrt(squared) < cutoff - slack:
                        continue
                    if far < 0:
                        far = F[f, b] if d[a] < d[b] else F[f, a]
                        near = F[f, a] if d[a] < d[b] else F[f, b]
    return far, near


def straight_lines(
    positions: cython.const[cython.double][:, ::1],
    sources: cython.const[cython.double][:, ::1],
    offsets: cython.const[cython.double][::1],
):
    """Length (p,) of the shortest straight line from each position to a source, the source's offset added."""
    found = np.empty(positions.shape[0])
    shortest: cython.double[::1] = found
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


def wrong_rows(
    tables,
    position: cython.const[cython.double][:, ::1],
    source: cython.const[cython.int][::1],
    count: cython.const[cython.longlong][::1],
    found: cython.const[cython.int][::1],
    value: cython.const[cython.double][::1],
    limit: cython.const[cython.double][::1],
    distance: cython.double[::1],
    share: cython.double,
):
    """Mask (k,) of the answers that contradict edges or straight lines; each has the distances of some vertices.

    Answer i is measured from vertex ``source[i]`` and has ``count[i]`` vertices: they stand in `found` (r,), answer
    after answer, with their distances in `value` (r,). Up to ``limit[i]`` all vertices are there, the source too.
    `tables` are the triangles along whose edges there are paths, and `position` (n, 3) their vertices in the same unit.
    `distance` (n,) is working memory, ``inf`` before and after. An excess by this `share` of the largest distance is
    rounding.
    """
    marks = np.zeros(source.shape[0], np.uint8)
    is_wrong: cython.uchar[::1] = marks
    vertex: cython.const[cython.int][::1] = tables.edges.vertex
    length: cython.const[cython.double][::1] = tables.edges.length
    corner_of_vertex: cython.const[cython.int][::1] = tables.corner_of_vertex
    next_corner: cython.const[cython.int][::1] = tables.next_corner
    begin: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(source.shape[0]):
            s: cython.int = source[i]
            # A millionth of a millionth of the mean edge, which is the unit of the tables, is rounding too.
            slack: cython.double = 1e-12
            end: cython.Py_ssize_t = begin + count[i]
            for r in range(begin, end):
                slack = max(slack, share * value[r])
                distance[found[r]] = value[r]
            if limit[i] <= 0.0 and distance[s] == INFINITY:
                distance[s] = 0.0
            wrong: cython.bint = distance[s] != 0.0 or slack == INFINITY
            for r in range(begin, end + 1):
                v: cython.int = found[r] if r < end else s
                d: cython.double = distance[v] + slack
                x: cython.double = position[v, 0] - position[s, 0]
                y: cython.double = position[v, 1] - position[s, 1]
                z: cython.double = position[v, 2] - position[s, 2]
                wrong |= not (d >= 0.0 and x * x + y * y + z * z <= d * d)
                # The next vertex of each face: so every vertex is reached from one in each of its faces.
                corner: cython.int = corner_of_vertex[v]
                while corner >= 0:
                    c: cython.uint = cython.cast(cython.uint, corner) % 3
                    w: cython.int = vertex[corner + 1 if c < 2 else corner - 2]
                    reach: cython.double = d + length[corner + 2 if c == 0 else corner - 1]
                    if distance[w] > reach and (distance[w] < INFINITY or reach < limit[i] - slack):
                        wrong = True
                    corner = next_corner[corner]
            is_wrong[i] = wrong
            distance[s] = INFINITY
            for r in range(begin, end):
                distance[found[r]] = INFINITY
            begin = end
    return marks.view(bool)
