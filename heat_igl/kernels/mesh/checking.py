"""Bounds of a distance that take no search: paths along edges from above, straight lines from below."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, fabs, sqrt


@cython.final
@cython.cclass
class EdgePaths:
    """Paths along edges, whose ends (e, 2) int32 are among n vertices, and lengths (e,) float64.

    Once they are asked for, the edges of vertex v are ``incident[first[v] : first[v + 1]]``.
    """

    ends: cython.const[cython.int][:, ::1]
    length: cython.const[cython.double][::1]
    first: cython.longlong[::1]
    incident: cython.int[::1]

    def __init__(self, ends, length, n: cython.Py_ssize_t):
        self.ends, self.length = ends, length
        self.first, self.incident = np.zeros(n + 1, np.int64), np.empty(0, np.int32)

    def __reduce__(self):
        """What it was made of."""
        return EdgePaths, (np.asarray(self.ends), np.asarray(self.length), self.first.shape[0] - 1)

    def shorten(self, d: cython.double[::1], labels=None, share: cython.double = 0.0) -> None:
        """Lower `d` (n,) to the paths along edges, in place; `labels` (n,) are handed on with it.

        One pass over all edges, and then only over those of vertices that were lowered. With a `share`, the pass leaves
        edges alone on which the given distances are too long by less than that share of the length; whatever the order
        of the edges, the result is the same.
        """
        if not self.is_longer(d, share):
            return
        self.list_incident()
        n: cython.Py_ssize_t = d.shape[0]
        label: cython.longlong[::1] = np.empty(0, np.int64) if labels is None else labels
        # A circular buffer: no vertex waits twice, so n places suffice.
        waiting: cython.int[::1] = np.empty(n, np.int32)
        given: cython.const[cython.double][::1] = np.array(d) if share > 0 else d
        is_waiting: cython.uchar[::1] = np.zeros(n, np.uint8)
        begin: cython.Py_ssize_t = 0
        count: cython.Py_ssize_t = 0
        with cython.nogil:
            for e in range(self.length.shape[0]):
                # Nearly always false, and so cheaper than to ask which end is nearer.
                if fabs(given[self.ends[e, 0]] - given[self.ends[e, 1]]) > self.length[e] * (1 + share):
                    lowered = self.lower(d, label, e)
                    if lowered >= 0 and not is_waiting[lowered]:
                        is_waiting[lowered] = True
                        waiting[count] = lowered
                        count += 1
            while count > 0:
                v: cython.int = waiting[begin]
                is_waiting[v] = False
                begin = begin + 1 if begin + 1 < n else 0
                count -= 1
                for k in range(self.first[v], self.first[v + 1]):
                    lowered = self.lower(d, label, self.incident[k])
                    if lowered >= 0 and not is_waiting[lowered]:
                        is_waiting[lowered] = True
                        end: cython.Py_ssize_t = begin + count
                        waiting[end if end < n else end - n] = lowered
                        count += 1

    @cython.cfunc
    @cython.nogil
    def is_longer(self, d: cython.const[cython.double][::1], share: cython.double) -> cython.bint:
        """Whether a distance is longer than along an edge, by more than that share of it: mostly it is not."""
        for e in range(self.length.shape[0]):
            # Infinite at both ends gives nan, and false.
            is_steep: cython.bint = fabs(d[self.ends[e, 0]] - d[self.ends[e, 1]]) > self.length[e] * (1 + share)
            if is_steep and self.far_end(d, e, share) >= 0:
                return True
        return False

    @cython.cfunc
    def list_incident(self) -> cython.void:
        """List the edges by vertex, unless that is done."""
        with cython.critical_section(self):
            if self.incident.shape[0] > 0:
                return
            self.incident = np.empty(2 * self.ends.shape[0], np.int32)
            for e in range(self.ends.shape[0]):
                for c in range(2):
                    self.first[self.ends[e, c]] += 1
            for v in range(self.first.shape[0] - 1):
                self.first[v + 1] += self.first[v]
            # Now first[v] is where the edges of v end; filled from there back to where they begin.
            for e in range(self.ends.shape[0] - 1, -1, -1):
                for c in range(2):
                    self.first[self.ends[e, c]] -= 1
                    self.incident[self.first[self.ends[e, c]]] = e

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def lower(self, d: cython.double[::1], label: cython.longlong[::1], e: cython.Py_ssize_t) -> cython.int:
        """The end of edge e whose distance was lowered to the path along it; -1 if that is not shorter."""
        far: cython.int = self.far_end(d, e, 0.0)
        if far >= 0:
            near: cython.int = self.ends[e, 0] if self.ends[e, 1] == far else self.ends[e, 1]
            d[far] = d[near] + self.length[e]
            if label.shape[0] > 0:
                label[far] = label[near]
        return far

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def far_end(self, d: cython.const[cython.double][::1], e: cython.Py_ssize_t, share: cython.double) -> cython.int:
        """The end of edge e to which the path along it is shorter, by more than that share; -1 if there is none."""
        near: cython.int = self.ends[e, 0]
        far: cython.int = self.ends[e, 1]
        if d[far] < d[near]:
            near, far = far, near
        # Not by rounding, which would pass along many edges.
        return far if d[near] + self.length[e] * (1 + share) < d[far] * (1 - 1e-12) else -1


def glued_edges(
    F: cython.const[cython.longlong][:, ::1],
    length: cython.const[cython.double][::1],
    twin: cython.const[cython.longlong][::1],
):
    """Ends (e, 2) int32 and lengths (e,) of the edges of a triangulation, each once; of more than two faces, for each.

    As an `IntrinsicTriangulation` has them, with the lengths (3 m,) in one row.
    """
    e: cython.Py_ssize_t = 0
    with cython.nogil:
        for f in range(twin.shape[0]):
            e += twin[f] < 0 or f < twin[f]
    pairs, lengths = np.empty((e, 2), np.int32), np.empty(e)
    ends: cython.int[:, ::1] = pairs
    length_of: cython.double[::1] = lengths
    e = 0
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(3):
                if twin[3 * f + c] < 0 or 3 * f + c < twin[3 * f + c]:
                    ends[e, 0], ends[e, 1] = F[f, (c + 1) % 3], F[f, (c + 2) % 3]
                    length_of[e] = length[3 * f + c]
                    e += 1
    return pairs, lengths


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
