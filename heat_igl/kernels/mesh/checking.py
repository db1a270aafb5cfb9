"""Bounds of a distance that take no search: paths along edges from above, straight lines from below."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, fabs, sqrt


@cython.final
@cython.cclass
class EdgePaths:
    """Paths along edges, whose ends (e, 2) int32 are among n vertices, and lengths (e,) float64.

    Edges from vertex v lead to ``other[first[v] : first[v + 1]]``, over the lengths `along` in the same places.
    """

    ends: cython.const[cython.int][:, ::1]
    length: cython.const[cython.double][::1]
    first: cython.longlong[::1]
    other: cython.int[::1]
    along: cython.double[::1]

    def __init__(self, ends, length, n: cython.Py_ssize_t):
        self.ends, self.length = ends, length
        self.first = np.zeros(n + 1, np.int64)
        self.other, self.along = np.empty(2 * len(ends), np.int32), np.empty(2 * len(ends))
        with cython.nogil:
            for e in range(self.ends.shape[0]):
                for c in range(2):
                    self.first[self.ends[e, c]] += 1
            for v in range(n):
                self.first[v + 1] += self.first[v]
            # Now first[v] is where the edges of v end; filled from there back to where they begin.
            for e in range(self.ends.shape[0] - 1, -1, -1):
                for c in range(2):
                    self.first[self.ends[e, c]] -= 1
                    k: cython.longlong = self.first[self.ends[e, c]]
                    self.other[k], self.along[k] = self.ends[e, 1 - c], self.length[e]

    def __reduce__(self):
        """What it was made of."""
        return EdgePaths, (np.asarray(self.ends), np.asarray(self.length), self.first.shape[0] - 1)

    def joined(
        self,
        F: cython.const[cython.longlong][:, ::1],
        length: cython.const[cython.double][::1],
        twin: cython.const[cython.longlong][::1],
    ) -> EdgePaths:
        """These, and the edges of a triangulation that are not among them: that have other ends, or another length.

        As an `IntrinsicTriangulation` has them, with the lengths (3 m,) in one row.
        """
        pairs, lengths = np.empty((twin.shape[0], 2), np.int32), np.empty(twin.shape[0])
        ends: cython.int[:, ::1] = pairs
        length_of: cython.double[::1] = lengths
        n_new: cython.Py_ssize_t = 0
        with cython.nogil:
            for h in range(twin.shape[0]):
                if 0 <= twin[h] < h:
                    continue
                tail: cython.int = F[h // 3, (h + 1) % 3]
                head: cython.int = F[h // 3, (h + 2) % 3]
                for k in range(self.first[tail], self.first[tail + 1]):
                    if self.other[k] == head and self.along[k] == length[h]:
                        break
                else:
                    ends[n_new, 0], ends[n_new, 1], length_of[n_new] = tail, head, length[h]
                    n_new += 1
        ends_of_both = np.concatenate([self.ends, pairs[:n_new]])
        return EdgePaths(ends_of_both, np.concatenate([self.length, lengths[:n_new]]), self.first.shape[0] - 1)

    def around(self, vertices: cython.const[cython.longlong][::1]):
        """Edges from some vertices: which of these (s,), the other end (s,), and the length (s,)."""
        k: cython.Py_ssize_t = 0
        for i in range(vertices.shape[0]):
            k += self.first[vertices[i] + 1] - self.first[vertices[i]]
        position, end, long = np.empty(k, np.int64), np.empty(k, np.int64), np.empty(k)
        which: cython.longlong[::1] = position
        other: cython.longlong[::1] = end
        length: cython.double[::1] = long
        k = 0
        for i in range(vertices.shape[0]):
            for j in range(self.first[vertices[i]], self.first[vertices[i] + 1]):
                which[k], other[k], length[k] = i, self.other[j], self.along[j]
                k += 1
        return position, end, long

    def steepness(self, d: cython.const[cython.double][::1]) -> tuple[float, int]:
        """By how much distances `d` (n,) change along edges beyond their lengths, as a share of the sum of lengths.

        Then an end of the edge with the largest excess, -1 if there is none. Edges with an infinite end are left out.
        """
        total: cython.double = 0.0
        excess: cython.double = 0.0
        largest: cython.double = 0.0
        steepest: cython.int = -1
        for e in range(self.length.shape[0]):
            difference: cython.double = fabs(d[self.ends[e, 0]] - d[self.ends[e, 1]])
            if difference < INFINITY:
                total += self.length[e]
                excess += max(difference - self.length[e], 0.0)
                if difference - self.length[e] > largest:
                    largest, steepest = difference - self.length[e], self.ends[e, 0]
        return excess / total if total > 0 else 0.0, steepest

    def shorten(self, d: cython.double[::1], labels=None, share: cython.double = 0.0) -> None:
        """Lower `d` (n,) to the paths along edges, in place; `labels` (n,) are handed on with it.

        One pass over all edges, and then over those of vertices that were lowered. With a `share`, the pass leaves
        edges alone on which the given distances are too long by less than that share of the length; whatever the order
        of the edges, the result is the same.
        """
        n: cython.Py_ssize_t = d.shape[0]
        found, reach = np.empty(self.length.shape[0], np.int32), np.empty(self.length.shape[0])
        steep: cython.int[::1] = found
        nearest: cython.double[::1] = reach
        n_steep: cython.Py_ssize_t = 0
        with cython.nogil:
            for e in range(self.length.shape[0]):
                near: cython.double = min(d[self.ends[e, 0]], d[self.ends[e, 1]])
                far: cython.double = max(d[self.ends[e, 0]], d[self.ends[e, 1]])
                if is_longer(near, far, self.length[e] * (1 + share)):
                    steep[n_steep], nearest[n_steep] = e, near
                    n_steep += 1
        if n_steep == 0:
            return
        # From near to far, vertices are lowered half as often.
        steep = found[reach[:n_steep].argsort(kind="stable")]
        label: cython.p_longlong = cython.NULL
        if labels is not None:
            label_of: cython.longlong[::1] = labels
            label = cython.address(label_of[0])
        # A circular buffer: no vertex waits twice, so n places suffice.
        waiting: cython.int[::1] = np.empty(n, np.int32)
        is_waiting: cython.uchar[::1] = np.zeros(n, np.uint8)
        begin: cython.Py_ssize_t = 0
        count: cython.Py_ssize_t = 0
        with cython.nogil:
            for e in range(n_steep):
                k: cython.Py_ssize_t = steep[e]
                lowered = lower(cython.address(d[0]), label, self.ends[k, 0], self.ends[k, 1], self.length[k])
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
                    # Mostly not, and no processor foresees which end is nearer; infinite at both ends gives nan.
                    if not fabs(d[v] - d[self.other[k]]) > self.along[k]:
                        continue
                    lowered = lower(cython.address(d[0]), label, v, self.other[k], self.along[k])
                    if lowered >= 0 and not is_waiting[lowered]:
                        is_waiting[lowered] = True
                        end: cython.Py_ssize_t = begin + count
                        waiting[end if end < n else end - n] = lowered
                        count += 1


@cython.cfunc
@cython.nogil
def lower(d: cython.p_double, label: cython.p_longlong, v: cython.int, w: cython.int, way: cython.double) -> cython.int:
    """The end of an edge of the length `way` that was lowered to the path along it; -1 if that is not shorter."""
    near: cython.int = v if d[v] < d[w] else w
    far: cython.int = w if near == v else v
    if not is_longer(d[near], d[far], way):
        return -1
    d[far] = d[near] + way
    if label:
        label[far] = label[near]
    return far


@cython.cfunc
@cython.nogil
def is_longer(near: cython.double, far: cython.double, length: cython.double) -> cython.bint:
    """Whether the farther of two distances is longer than the way over the nearer one."""
    # Not by rounding, which would pass along many edges.
    return near + length < far * (1 - 1e-12)


def largest_finite(distance: cython.const[cython.double][::1]) -> float:
    """The largest distance (n,) that is finite; 0 if there is none."""
    largest: cython.double = 0.0
    with cython.nogil:
        for i in range(distance.shape[0]):
            if largest < distance[i] < INFINITY:
                largest = distance[i]
    return largest


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
            if d[0] == INFINITY and d[1] == INFINITY and d[2] == INFINITY and d[n_corners - 1] == INFINITY:
                continue
            for a in range(n_corners):
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


def shortfall(
    distance: cython.const[cython.double][::1],
    vertices: cython.const[cython.longlong][::1],
    step: cython.Py_ssize_t,
    V: cython.const[cython.double][:, ::1],
    places: cython.const[cython.double][:, ::1],
    offsets: cython.const[cython.double][::1],
) -> tuple[float, float, int, float]:
    """How far distances are below the straight lines from the nearest place, at every `step`-th of some vertices.

    In the mean, as shares of the lines; at most; where that is, -1 for nowhere; and the largest distance that was met.
    Lines begin at `offsets` (k,) in the `places` (k, 3), and distances count from the least offset.
    """
    start: cython.double = np.min(offsets)
    total: cython.double = 0.0
    most: cython.double = 0.0
    farthest: cython.double = 0.0
    count: cython.Py_ssize_t = 0
    shortest: cython.longlong = -1
    with cython.nogil:
        for k in range((vertices.shape[0] + step - 1) // step):
            v: cython.longlong = vertices[k * step]
            if not distance[v] < INFINITY:
                continue
            line: cython.double = INFINITY
            for s in range(places.shape[0]):
                x: cython.double = V[v, 0] - places[s, 0]
                y: cython.double = V[v, 1] - places[s, 1]
                z: cython.double = V[v, 2] - places[s, 2]
                line = min(line, sqrt(x * x + y * y + z * z) + offsets[s])
            if line > start:
                count += 1
                farthest = max(farthest, distance[v] - start)
                missing: cython.double = max(line - distance[v], 0.0)
                total += missing / (line - start)
                if missing > most:
                    most, shortest = missing, v
    return total / max(count, 1), most, shortest, farthest


def raise_to_lines(
    distance: cython.double[::1],
    V: cython.const[cython.double][:, ::1],
    places: cython.const[cython.double][:, ::1],
    offsets: cython.const[cython.double][::1],
    share: cython.double,
) -> None:
    """Raise distances (n,) to those lines of `shortfall`, less a `share` of them that is rounding, in place."""
    start: cython.double = np.min(offsets)
    s: cython.Py_ssize_t = 0
    with cython.nogil:
        for v in range(distance.shape[0]):
            line: cython.double = INFINITY
            # Mostly above the line from the place that the vertex before is above of, without a square root.
            for _ in range(places.shape[0]):
                x: cython.double = V[v, 0] - places[s, 0]
                y: cython.double = V[v, 1] - places[s, 1]
                z: cython.double = V[v, 2] - places[s, 2]
                squared: cython.double = x * x + y * y + z * z
                reach: cython.double = distance[v] - offsets[s]
                if reach >= 0 and squared <= reach * reach:
                    break
                line = min(line, sqrt(squared) + offsets[s])
                s = s + 1 if s + 1 < places.shape[0] else 0
            else:
                line -= share * (line - start)
                if line > distance[v]:
                    distance[v] = line


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
