"""Fill gaps of a triangulated point cloud: ears are clipped from the loops of boundary edges in space."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, sqrt

from heat_igl.kernels.mesh.incidence import corners_by_vertex


def torn_points(
    F: cython.const[cython.int][:, ::1],
    nearest: cython.const[cython.int][:, ::1],
    is_part: cython.const[cython.uchar][::1],
    edges_away: cython.Py_ssize_t,
):
    """The first points of those rows of `nearest` (k, j) of which another point is more than `edges_away` edges away.

    Next to another sheet, thin parts are torn there. Other points outside all parts (`is_part` (n,)) are ignored.
    """
    n: cython.Py_ssize_t = is_part.shape[0]
    torn = np.zeros(nearest.shape[0], np.bool_)
    is_torn: cython.uchar[::1] = torn.view(np.uint8)
    corners_at = corners_by_vertex(F, n)
    first: cython.const[cython.int][::1] = corners_at[0]
    incident: cython.const[cython.int][::1] = corners_at[1]
    # The last row whose search reached each point, and the points that the search of this row reached.
    row_of: cython.int[::1] = np.full(n, -1, np.int32)
    reached: cython.int[::1] = np.empty(n + 1, np.int32)
    with cython.nogil:
        for row in range(nearest.shape[0]):
            reached[0], row_of[nearest[row, 0]] = nearest[row, 0], row
            begin: cython.Py_ssize_t = 0
            end: cython.Py_ssize_t = 1
            for step in range(edges_away + 1):
                is_torn[row] = 0
                for j in range(1, nearest.shape[1]):
                    is_torn[row] |= row_of[nearest[row, j]] != row and is_part[nearest[row, j]]
                if not is_torn[row] or step == edges_away:
                    break
                last: cython.Py_ssize_t = end
                for at in range(begin, last):
                    for place in range(first[reached[at]], first[reached[at] + 1]):
                        for c in range(3):
                            v: cython.int = F[incident[place] // 3, c]
                            # Without a branch: either is true at random.
                            reached[end] = v
                            end += row_of[v] != row
                            row_of[v] = row
                begin = last
    return np.asarray(nearest)[torn, 0]


def filling_triangles(
    P: cython.const[cython.double][:, ::1],
    F: cython.const[cython.int][:, ::1],
    twin: cython.const[cython.int][::1],
    is_gap: cython.const[cython.uchar][::1],
    largest: cython.const[cython.double][::1],
    most_bent: cython.double,
    most_folded: cython.double,
):
    """Triangles between the fans of a point, and in the loops of boundary edges.

    The ear with the smallest circumcircle is clipped from a loop repeatedly, as long as an ear is admissible: this
    fills small gaps, and notches of holes and of the boundary. Ears that join two fans of a point come first, whatever
    their size, in ascending order of the third side. Ears that fold back, as in creases, or whose third side is longer
    than the largest admissible circumradius, come last, and are kept only if they close the loop; but beside a sparser
    part, where another side of the ear is longer, that of its end there counts.

    F (m, 3) int32 are all triangles at the points of gaps, of the points P (n, 3), and `twin` (3 m,) int32 the
    half-edges glued to their half-edges ``3 f + c``, opposite to corner c, negative on the boundary. `is_gap` (n,)
    tells which points are ends of boundary edges; `largest` (n,) is the largest admissible circumradius of triangles at
    each point. `most_bent` and `most_folded` are the largest admissible cosines of the dihedral angle to a neighbour (1
    for triangles folded onto each other): of ears that are clipped first, and of ears that close a loop.

    Returns the triangles (t, 3) int32, and whether each is in a loop that was filled completely, and joins no fans.
    """
    gaps = _Gaps()
    gaps.P, gaps.F, gaps.twin, gaps.is_gap, gaps.largest = P, F, twin, is_gap, largest
    gaps.most_bent, gaps.most_folded = most_bent, most_folded
    n_sides: cython.Py_ssize_t = twin.shape[0]
    k: cython.Py_ssize_t = np.count_nonzero(np.asarray(twin) < 0)
    found, whole = np.empty((k, 3), np.int32), np.empty(k, np.bool_)
    gaps.triangles, gaps.is_whole, gaps.count = found, whole.view(np.uint8), 0
    gaps.partner, gaps.seen = np.full(2 * n_sides, -1, np.int32), np.zeros(n_sides, np.uint8)
    gaps.joints, gaps.head = np.zeros(P.shape[0], np.int32), np.full(P.shape[0], -1, np.int32)
    gaps.ring, gaps.fans, gaps.cost = np.empty((2, k), np.int32), np.empty((3, k), np.int32), np.empty(k)
    gaps.link = np.empty((n_sides + k, 2), np.int32)
    with cython.nogil:
        gaps.find_loops()
        for h in range(n_sides):
            if twin[h] < h and is_gap[gaps.at_end(2 * h)] and is_gap[gaps.at_end(2 * h + 1)]:
                gaps.enter(h, gaps.at_end(2 * h), gaps.at_end(2 * h + 1))
        for h in range(n_sides):
            if gaps.partner[2 * h] >= 0 and not gaps.seen[h]:
                begin: cython.Py_ssize_t = gaps.count
                size: cython.Py_ssize_t = gaps.loop(h)
                gaps.fill(size)
                if gaps.count - begin < size - 2:
                    gaps.is_whole[begin : gaps.count] = 0
    return found[: gaps.count], whole[: gaps.count]


@cython.final
@cython.cclass
class _Gaps:
    """Arrays that `filling_triangles` reads and writes; the first `count` of its `triangles` are found.

    `partner` (2 s,) is the end at which a loop continues after end 2 h + d of the boundary side h (d = 0 at its tail);
    -1 if nowhere. `joints` (n,) is the number of fans at each point minus one, decreased by each triangle between two
    fans. Edges are in linked lists from `head` (n,) on, each at the end with the lower index.
    """

    def at_end(self, end):
        """The point at end 2 h + d of side h."""
        h: cython.Py_ssize_t = end // 2
        return self.F[h // 3, (h % 3 + 1 + end % 2) % 3]

    def find_loops(self):
        """Find the partner of each end of a boundary side: in the same fan, or in the next if its point has several.

        `joints` takes the number of further fans. `head` is restored.
        """
        for end in range(self.partner.shape[0]):
            v: cython.int = self.at_end(end)
            side: cython.int = end // 2
            if self.twin[side] >= 0 or not (self.is_gap[v] and self.is_gap[self.at_end(end ^ 1)]):
                continue
            at: cython.int = end
            while True:
                # Go to the other side of the triangle at the same point, and to the same edge in the neighbour.
                side = 3 * (at // 6) + (at // 2 % 3 + 2 - at % 2) % 3
                at = 2 * side + 1 - at % 2
                if self.twin[side] < 0:
                    break
                at = 2 * self.twin[side]
                at += self.at_end(at) != v
            self.partner[end] = at
            if end % 2 == 0 and at % 2 == 1:
                # An open fan, whose boundary runs through the point. The fans of a point are linked.
                self.joints[v] += self.head[v] >= 0
                self.link[end // 2, 0], self.head[v] = self.head[v], end
        for v in range(self.head.shape[0]):
            k: cython.Py_ssize_t = 0
            while self.head[v] >= 0:
                self.fans[0, k], self.fans[1, k], self.fans[2, k] = self.head[v], self.partner[self.head[v]], k
                self.head[v] = self.link[self.head[v] // 2, 0]
                k += 1
            if k > 1:
                self.in_one_round(k)

    def in_one_round(self, k):
        """Join k fans of a point into one cycle by setting `partner`, the nearest ends first.

        Rows of `fans` are the two ends of each fan and the chain to which the fan belongs.
        """
        first: cython.Py_ssize_t = 0
        second: cython.Py_ssize_t = 0
        for left in range(k, 0, -1):
            shortest: cython.double = INFINITY
            for i in range(k):
                for j in range(k):
                    is_free: cython.bint = self.fans[0, i] >= 0 and self.fans[1, j] >= 0
                    if is_free and (left == 1 or self.fans[2, i] != self.fans[2, j]):
                        square: cython.double = self.square(
                            self.at_end(self.fans[0, i] ^ 1), self.at_end(self.fans[1, j] ^ 1)
                        )
                        if square < shortest:
                            shortest, first, second = square, i, j
            self.partner[self.fans[0, first]] = self.fans[1, second]
            self.partner[self.fans[1, second]] = self.fans[0, first]
            self.fans[0, first] = self.fans[1, second] = -1
            chain: cython.int = self.fans[2, second]
            for i in range(k):
                if self.fans[2, i] == chain:
                    self.fans[2, i] = self.fans[2, first]

    def square(self, a, b):
        """Squared distance of two points."""
        x: cython.double = self.P[b, 0] - self.P[a, 0]
        y: cython.double = self.P[b, 1] - self.P[a, 1]
        z: cython.double = self.P[b, 2] - self.P[a, 2]
        return x * x + y * y + z * z

    def loop(self, start):
        """Collect the points of the loop from a boundary side on, and the opposite corners; how many, 0 if not closed.

        The loop runs against the orientation of the first side's triangle, so new triangles are oriented like those
        around.
        """
        size: cython.Py_ssize_t = 0
        at: cython.Py_ssize_t = 2 * start + 1
        while not self.seen[at // 2]:
            h: cython.Py_ssize_t = at // 2
            self.seen[h] = 1
            self.ring[POINT, size], self.ring[BEYOND, size] = self.at_end(at), self.F[h // 3, h % 3]
            size += 1
            at = self.partner[at ^ 1]
        return size if at == 2 * start + 1 else 0

    def fill(self, size):
        """Clip admissible ears from a ring of points. The third side of each is added as an edge."""
        flat: cython.Py_ssize_t = -1
        for i in range(size):
            self.cost[i] = self.ear(size, i, flat)
        while size > 2:
            best: cython.Py_ssize_t = 0
            for i in range(1, size):
                if self.cost[i] < self.cost[best]:
                    best = i
            if self.cost[best] == INFINITY:
                if flat >= 0:
                    # The folded ears do not close the loop: remove them and their edges.
                    while self.count > flat:
                        self.count -= 1
                        a: cython.int = min(self.triangles[self.count, 0], self.triangles[self.count, 2])
                        self.head[a] = self.link[self.twin.shape[0] + self.count, 1]
                    return
                flat = self.count
                for i in range(size):
                    self.cost[i] = self.ear(size, i, flat)
                continue
            before: cython.Py_ssize_t = size - 1 if best == 0 else best - 1
            after: cython.Py_ssize_t = 0 if best == size - 1 else best + 1
            point: cython.int = self.ring[POINT, best]
            # Since its cost was computed, its third side may be an edge now, or all fans there may be joined.
            is_edge: cython.bint = size > 3 and self.is_edge(self.ring[POINT, before], self.ring[POINT, after])
            if is_edge or (self.cost[best] < 0.0 and self.joints[point] == 0):
                self.cost[best] = self.ear(size, best, flat)
                continue
            self.is_whole[self.count] = self.cost[best] >= 0.0
            self.joints[point] -= self.joints[point] > 0
            self.triangles[self.count, 0], self.triangles[self.count, 1] = self.ring[POINT, before], point
            self.triangles[self.count, 2] = self.ring[POINT, after]
            self.enter(self.twin.shape[0] + self.count, self.ring[POINT, before], self.ring[POINT, after])
            self.count += 1
            self.ring[BEYOND, before] = point
            size -= 1
            for i in range(best, size):
                self.ring[POINT, i], self.ring[BEYOND, i] = self.ring[POINT, i + 1], self.ring[BEYOND, i + 1]
                self.cost[i] = self.cost[i + 1]
            # The ears of the two neighbours have changed.
            for i in range(best - 1, best + 1):
                j: cython.Py_ssize_t = (i + size) % size
                self.cost[j] = self.ear(size, j, flat)
            if size == 3:  # one triangle is left
                self.cost[0] = self.cost[1] = self.cost[2] = self.ear(size, 0, flat)

    def ear(self, size, i, flat):
        """Circumradius of the ear at point i of a ring; infinite if the ear is not admissible.

        Negative if the ear joins two fans: minus the inverse square of the third side, so shorter sides come first. As
        long as `flat` is negative, the loop may stay open.
        """
        before: cython.Py_ssize_t = size - 1 if i == 0 else i - 1
        after: cython.Py_ssize_t = 0 if i == size - 1 else i + 1
        a: cython.int = self.ring[POINT, before]
        b: cython.int = self.ring[POINT, i]
        c: cython.int = self.ring[POINT, after]
        if a in (b, c) or b == c or (size > 3 and self.is_edge(a, c)):
            return INFINITY
        square: cython.double = self.square(a, c)
        if self.joints[b] > 0:
            return -1.0 / square if square > 0.0 else -INFINITY
        radius: cython.double = _circumradius(self.P, a, b, c)
        most: cython.double = min(self.largest[a], min(self.largest[b], self.largest[c]))
        longest: cython.double = most
        if max(self.square(a, b), self.square(b, c)) > most * most:
            longest = max(self.largest[a], self.largest[c])
        # The last triangle adds no edge, and closes the gap even if its corners are collinear.
        if size > 3 and (radius >= most or (flat < 0 and square > longest * longest)):
            return INFINITY
        folded: cython.double = max(
            self.fold(a, b, c, self.ring[BEYOND, before]), self.fold(b, c, a, self.ring[BEYOND, i])
        )
        if size == 3:
            folded = max(folded, self.fold(c, a, b, self.ring[BEYOND, after]))
        return INFINITY if folded > (self.most_bent if flat < 0 else self.most_folded) else radius

    def enter(self, e, a, b):
        """Add edge e to the lists."""
        self.link[e, 0], self.link[e, 1] = max(a, b), self.head[min(a, b)]
        self.head[min(a, b)] = cython.cast(cython.int, e)

    def is_edge(self, a, b):
        """Whether two points are the ends of an edge."""
        e: cython.int = self.head[min(a, b)]
        while e >= 0 and self.link[e, 0] != max(a, b):
            e = self.link[e, 1]
        return e >= 0

    def fold(self, a, b, c, d):
        """Cosine of the angle at edge ab between the triangles with corners c and d: 1 if folded onto each other."""
        P = self.P
        square: cython.double = self.square(a, b)
        of_c: cython.double = 0.0
        of_d: cython.double = 0.0
        for x in range(3):
            of_c += (P[c, x] - P[a, x]) * (P[b, x] - P[a, x])
            of_d += (P[d, x] - P[a, x]) * (P[b, x] - P[a, x])
        size_c: cython.double = 0.0
        size_d: cython.double = 0.0
        alike: cython.double = 0.0
        for x in range(3):
            along: cython.double = (P[b, x] - P[a, x]) / square if square > 0.0 else 0.0
            across_c: cython.double = P[c, x] - P[a, x] - of_c * along
            across_d: cython.double = P[d, x] - P[a, x] - of_d * along
            size_c += across_c * across_c
            size_d += across_d * across_d
            alike += across_c * across_d
        size: cython.double = sqrt(size_c) * sqrt(size_d)
        return alike / size if size > 0.0 else -1.0


def _circumradius(P, a, b, c):
    """Radius of the circle through three points: the same number in whatever order they are given."""
    first: cython.Py_ssize_t = min(a, min(b, c))
    last: cython.Py_ssize_t = max(a, max(b, c))
    middle: cython.Py_ssize_t = a + b + c - first - last
    x: cython.double = P[middle, 0] - P[first, 0]
    y: cython.double = P[middle, 1] - P[first, 1]
    z: cython.double = P[middle, 2] - P[first, 2]
    u: cython.double = P[last, 0] - P[first, 0]
    v: cython.double = P[last, 1] - P[first, 1]
    w: cython.double = P[last, 2] - P[first, 2]
    dx: cython.double = P[last, 0] - P[middle, 0]
    dy: cython.double = P[last, 1] - P[middle, 1]
    dz: cython.double = P[last, 2] - P[middle, 2]
    product: cython.double = sqrt(x * x + y * y + z * z) * sqrt(dx * dx + dy * dy + dz * dz)
    product *= sqrt(u * u + v * v + w * w)
    p: cython.double = y * w - z * v
    q: cython.double = z * u - x * w
    r: cython.double = x * v - y * u
    across: cython.double = sqrt(p * p + q * q + r * r)
    # The circle through collinear points is larger than any other.
    return 0.5 * product / across if across > 0.0 else 1e300
