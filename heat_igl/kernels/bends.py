"""Kernel of bends: ways through tetrahedra that turn around edges of the body."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bends import GAIN, LEVEL, MISFIT, MOST_ROUNDS, SLACK, Bend
from cython.cimports.heat_igl.kernels.rays import MOST_STEPS, NUDGE, Ray
from cython.cimports.libc.math import INFINITY, fabs, sqrt

__all__ = ["bend_around"]

_BEND = np.dtype(
    [
        ("at", "f8", 5),
        ("tangent", "f8", 3),
        ("outward", "f8", 3),
        ("before", "f8", 3),
        ("length", "f8"),
        ("start", "f8"),
        ("along", "f8"),
        ("height", "f8"),
        ("a", "i4"),
        ("b", "i4"),
        ("fits", "i4"),
        ("has_before", "i4"),
    ],
    align=True,
)


def bend_around(
    edges: cython.const[cython.int][:, ::1],
    outward: cython.const[cython.double][:, ::1],
    corners: cython.const[cython.int][:, ::1],
    first: cython.const[cython.int][::1],
    incident: cython.const[cython.int][::1],
    positions: cython.const[cython.double][:, ::1],
    reach: cython.const[cython.double][::1],
    sources: cython.const[cython.int][::1],
    offset: cython.const[cython.double][::1],
    d: cython.double[::1],
    begin: cython.double[::1],
    label: cython.int[::1],
    way: cython.int[::1],
):
    """Lower `d` (n,) to ways that bend around edges of the body, and are straight lines in between.

    A shortest way bends at edges of the body with more than half a turn inside, and nowhere else. Along such an edge,
    distance is that from a point beside it, turned into one plane; behind the edge, the plane is turned again. So an
    edge whose ends know their distances is a source: vertices around it are searched as far as they see the edge,
    and its ways are the shortest.

    Parameters
    ----------
    edges : (e, 2) int32
        Edges of the body around which ways bend, roughly from near to far.
    outward : (e, 3) float64
        Direction out of the body at each, halfway between the two walls; zero where more than two meet.
    corners, first, incident, positions
        The body, as for `heat_igl.kernels.sight.look_around`.
    reach : (n,) float64
        Longest edge at each vertex.
    sources, offset : (k,) int32, (k,) float64
        Vertex of each source, and the value at which distance begins there.
    d, begin, label : (n,) float64, (n,) float64, (n,) int32
        Distances, the value at which the front that arrives seems to begin, and the source of each; changed.
    way : (n,) int32
        The edge around which the way to each vertex bends last, -1 on straight ways, -2 where it is not known; changed.

    Returns
    -------
    int
        Number of times that vertices were searched around an edge.
    """
    n, e = positions.shape[0], edges.shape[0]
    all_bends = np.zeros(e, _BEND)
    ends = np.asarray(edges)
    X = np.asarray(positions)[ends]
    all_bends["a"], all_bends["b"] = ends.T
    all_bends["length"] = np.linalg.norm(X[:, 1] - X[:, 0], axis=1)
    all_bends["tangent"] = (X[:, 1] - X[:, 0]) / all_bends["length"][:, None]
    all_bends["outward"] = outward
    all_bends["at"] = np.inf
    one = _Bends()
    one.ray = Ray(corners, first, incident, positions)
    one.bends = all_bends
    one.corners, one.first, one.incident, one.positions = corners, first, incident, positions
    one.reach, one.sources, one.offset = reach, sources, offset
    one.d, one.begin, one.label, one.way = d, begin, label, way
    one.seen, one.lit, one.queue = np.full(n, -1, np.int32), np.full(n, -1, np.int32), np.empty(n, np.int32)
    i: cython.int
    _rounds: cython.int
    with cython.nogil:
        for _rounds in range(MOST_ROUNDS):
            before: cython.int = one.n_searches
            for i in range(one.bends.shape[0]):
                if one.is_stale(i):
                    one.n_searches += 1
                    one.fit(i)
                    one.search(i)
            if one.n_searches == before:
                break
    return one.n_searches


@cython.final
@cython.cclass
class _Bends:
    """What is read and written, and of the way that was last asked for, where it bends.

    `x` (3,) is the point, `share` its place along the edge, and `beyond` by how much the way would miss the edge on a
    line through it.
    """

    ray: Ray
    bends: Bend[::1]
    corners: cython.const[cython.int][:, ::1]
    first: cython.const[cython.int][::1]
    incident: cython.const[cython.int][::1]
    positions: cython.const[cython.double][:, ::1]
    reach: cython.const[cython.double][::1]
    sources: cython.const[cython.int][::1]
    offset: cython.const[cython.double][::1]
    d: cython.double[::1]
    begin: cython.double[::1]
    label: cython.int[::1]
    way: cython.int[::1]
    seen: cython.int[::1]  # the last search that came to a vertex, and the last in which it saw the edge
    lit: cython.int[::1]
    queue: cython.int[::1]
    n_searches: cython.int
    x: cython.double[3]
    share: cython.double
    beyond: cython.double

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def is_stale(self, i: cython.int) -> cython.bint:
        """Whether the ends of an edge have distances, and others than when it was fitted."""
        bend = cython.address(self.bends[i])
        to_a: cython.double = self.d[bend.a]
        to_b: cython.double = self.d[bend.b]
        if to_a == INFINITY or to_b == INFINITY:
            return False
        return bend.at[0] > to_a * (1 + GAIN) or bend.at[4] > to_b * (1 + GAIN)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def fit(self, i: cython.int) -> cython.void:
        """Find distance along an edge from the ways to its ends."""
        bend = cython.address(self.bends[i])
        j: cython.int
        k: cython.int
        x: cython.double[3]
        to_a: cython.double = self.d[bend.a]
        to_b: cython.double = self.d[bend.b]
        # The way to one end continues along the edge unless it is hidden at the other end.
        a_reaches: cython.bint = self.value(bend.a, cython.address(self.positions[bend.b, 0])) >= to_b * (1 - GAIN)
        b_reaches: cython.bint = self.value(bend.b, cython.address(self.positions[bend.a, 0])) >= to_a * (1 - GAIN)
        bend.at[0], bend.at[4] = to_a, to_b
        for j in range(1, 4):
            for k in range(3):
                x[k] = self.positions[bend.a, k] + 0.25 * j * bend.length * bend.tangent[k]
            from_a: cython.double = self.value(bend.a, x)
            from_b: cython.double = self.value(bend.b, x)
            a_is_seen: cython.bint = a_reaches or self.is_lit_from(bend.a, i, x, 0.25 * j)
            b_is_seen: cython.bint = b_reaches or self.is_lit_from(bend.b, i, x, 0.25 * j)
            if a_is_seen and b_is_seen:
                bend.at[j] = min(from_a, from_b)
            elif a_is_seen:
                bend.at[j] = from_a
            elif b_is_seen:
                bend.at[j] = from_b
            else:
                bend.at[j] = max(from_a, from_b)
            if j == 2:
                self.value(bend.a, x)
                bend.has_before = self.way[bend.a] > -2
                for k in range(3):
                    bend.before[k] = self.x[k]
        self.lay_flat(i)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def is_lit_from(
        self, v: cython.int, i: cython.int, x: cython.pointer[cython.const[cython.double]], share: cython.double
    ) -> cython.bint:
        """Whether the source from which the way to v is straight sees a point of edge i."""
        if self.way[v] != -1:
            return False
        k: cython.int
        for k in range(3):
            self.x[k] = x[k]
        self.share = share
        return self.sees(i, self.sources[self.label[v]])

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def lay_flat(self, i: cython.int) -> cython.void:
        """Find the point beside an edge from which distance along it is measured, and whether there is one."""
        bend = cython.address(self.bends[i])
        size: cython.double = bend.length
        to_a: cython.double = bend.at[0]
        middle: cython.double = bend.at[2] - to_a
        to_b: cython.double = bend.at[4] - to_a
        turn: cython.double = to_b - 2 * middle
        way_a: cython.int = self.way[bend.a]
        if way_a == -1 and self.way[bend.b] == -1 and self.label[bend.a] == self.label[bend.b]:
            bend.start = self.offset[self.label[bend.a]] - to_a
        elif turn > LEVEL * size:
            bend.start = (to_b * to_b - 2 * middle * middle - 0.5 * size * size) / (2 * turn)
        elif way_a >= 0:
            bend.start = self.bends[way_a].start - to_a
        elif way_a == -1:
            bend.start = self.offset[self.label[bend.a]] - to_a
        else:
            bend.start = -size / LEVEL
        bend.start = max(bend.start, -size / LEVEL)
        radius: cython.double = -bend.start
        other: cython.double = to_b - bend.start
        bend.along = 0.5 * ((radius - other) * (radius + other) / size + size)
        squared: cython.double = radius * radius - bend.along * bend.along
        bend.fits = radius >= 0 and other >= 0 and squared >= 0
        bend.start += to_a
        if not bend.fits:
            return
        bend.height = sqrt(squared)
        j: cython.int
        for j in range(1, 4):
            off: cython.double = 0.25 * j * size - bend.along
            if fabs(bend.start + sqrt(off * off + squared) - bend.at[j]) > MISFIT * size:
                bend.fits = False

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def value(self, v: cython.int, x: cython.pointer[cython.const[cython.double]]) -> cython.double:
        """Distance at a point near vertex v, by the way to v; `x` becomes the point at which this way bends last."""
        if self.way[v] >= 0:
            return self.around(self.way[v], x)
        source: cython.int = v
        value: cython.double = self.d[v]
        if self.way[v] == -1:
            source, value = self.sources[self.label[v]], self.offset[self.label[v]]
        k: cython.int
        squared: cython.double = 0.0
        for k in range(3):
            self.x[k] = self.positions[source, k]
            squared += (x[k] - self.x[k]) * (x[k] - self.x[k])
        return value + sqrt(squared)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def around(self, i: cython.int, x: cython.pointer[cython.const[cython.double]]) -> cython.double:
        """Length of the way to a point that bends around an edge last; sets `x`, `share` and `beyond`."""
        bend = cython.address(self.bends[i])
        k: cython.int
        away: cython.double = 0.0
        along: cython.double = 0.0
        for k in range(3):
            off: cython.double = x[k] - self.positions[bend.a, k]
            away += off * off
            along += off * bend.tangent[k]
        squared: cython.double = max(away - along * along, 0.0)
        best: cython.double = INFINITY
        self.beyond = 0.0
        if bend.fits:
            height: cython.double = sqrt(squared)
            both: cython.double = height + bend.height
            self.share = bend.along
            if both > 0:
                self.share = (bend.along * height + along * bend.height) / both
            self.beyond = max(-self.share, self.share - bend.length, 0.0)
            self.share = min(max(self.share / bend.length, 0.0), 1.0)
            if 0 < self.share < 1:
                best = bend.start + sqrt((along - bend.along) * (along - bend.along) + both * both)
        if best == INFINITY:
            j: cython.int
            for j in range(5):
                if bend.fits and 0 < j < 4:
                    continue
                off = along - 0.25 * j * bend.length
                through: cython.double = bend.at[j] + sqrt(squared + off * off)
                if through < best:
                    best, self.share = through, 0.25 * j
        for k in range(3):
            self.x[k] = self.positions[bend.a, k] + self.share * bend.length * bend.tangent[k]
        return best

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def search(self, i: cython.int) -> cython.void:
        """Give the vertices around an edge their ways around it, as far as they see it and may need it."""
        bend = cython.address(self.bends[i])
        stamp: cython.int = self.n_searches
        self.seen[bend.a] = self.seen[bend.b] = self.lit[bend.a] = self.lit[bend.b] = stamp
        size: cython.int = self.push_around(bend.a, 0, stamp)
        size = self.push_around(bend.b, size, stamp)
        next_one: cython.int = 0
        while next_one < size:
            u: cython.int = self.queue[next_one]
            next_one += 1
            value: cython.double = self.around(i, cython.address(self.positions[u, 0]))
            old: cython.double = self.d[u]
            is_better: cython.bint = value < old * (1 - GAIN)
            # Farther along, ways are shorter around another edge.
            if not is_better and (self.beyond > self.reach[u] or value > old + SLACK * self.reach[u]):
                continue
            if not self.is_hidden_from_before(i, u) or not self.sees(i, u):
                continue
            self.lit[u] = stamp
            if is_better:
                self.d[u], self.way[u] = value, i
                self.begin[u] = value - self.away(u)
                self.label[u] = self.label[bend.a if self.share < 0.5 else bend.b]
            size = self.push_around(u, size, stamp)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def push_around(self, v: cython.int, size: cython.int, stamp: cython.int) -> cython.int:
        """Put the neighbours of v that the search has not come to at the end of the queue; returns its size."""
        k: cython.int
        c: cython.int
        for k in range(self.first[v], self.first[v + 1]):
            for c in range(4):
                u: cython.int = self.corners[self.incident[k] // 4, c]
                if self.seen[u] != stamp:
                    self.seen[u] = stamp
                    self.queue[size] = u
                    size += 1
        return size

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def away(self, v: cython.int) -> cython.double:
        """Distance of v from `x`."""
        k: cython.int
        squared: cython.double = 0.0
        for k in range(3):
            squared += (self.positions[v, k] - self.x[k]) * (self.positions[v, k] - self.x[k])
        return sqrt(squared)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def is_hidden_from_before(self, i: cython.int, v: cython.int) -> cython.bint:
        """Whether v lies behind the edge, or beside that at most as far as its longest edge.

        Seen along the edge, the line from v to the point from which the way comes passes outside.
        """
        bend = cython.address(self.bends[i])
        if not bend.has_before:
            return True
        before_out: cython.double = 0.0
        before_side: cython.double = 0.0
        out: cython.double = 0.0
        side: cython.double = 0.0
        is_known: cython.bint = False
        k: cython.int
        for k in range(3):
            j: cython.int = (k + 1) % 3
            m: cython.int = (k + 2) % 3
            across: cython.double = bend.tangent[j] * bend.outward[m] - bend.tangent[m] * bend.outward[j]
            y: cython.double = bend.before[k] - self.positions[bend.a, k]
            off: cython.double = self.positions[v, k] - self.positions[bend.a, k]
            before_out += y * bend.outward[k]
            before_side += y * across
            out += off * bend.outward[k]
            side += off * across
            is_known = is_known or bend.outward[k] != 0
        if not is_known:
            return True
        if before_side < 0:
            before_side, side = -before_side, -side
        near: cython.double = self.reach[v]
        out += near
        side = min(side - near, 0.0)
        return before_out * -side + out * before_side >= 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def has_end(self, t: cython.int, i: cython.int) -> cython.bint:
        """Whether tetrahedron t is at the point of edge i at `share`."""
        bend = cython.address(self.bends[i])
        has_a: cython.bint = self.share > 1 - NUDGE
        has_b: cython.bint = self.share < NUDGE
        c: cython.int
        for c in range(4):
            has_a = has_a or self.corners[t, c] == bend.a
            has_b = has_b or self.corners[t, c] == bend.b
        return has_a and has_b

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def sees(self, i: cython.int, v: cython.int) -> cython.bint:
        """Whether the line from v to `x` on edge i stays in the tetrahedra.

        It does once it passes between three vertices that see the edge.
        """
        k: cython.int
        _steps: cython.int
        for k in range(self.first[v], self.first[v + 1]):
            if self.has_end(self.incident[k] // 4, i):
                return True
        for k in range(self.first[v], self.first[v + 1]):
            if self.ray.begins(self.incident[k], self.x):
                self.ray.aim(v, self.incident[k] // 4, self.x, -1, NUDGE)
                if self.ray.enters(self.incident[k] // 4) and self.arrives(i):
                    return True
        return False

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def arrives(self, i: cython.int) -> cython.bint:
        """Whether the ray gets to edge i before it leaves the body."""
        stamp: cython.int = self.n_searches
        _steps: cython.int
        for _steps in range(MOST_STEPS):
            if self.lit[self.ray.a] == stamp and self.lit[self.ray.b] == stamp and self.lit[self.ray.c] == stamp:
                return True
            o: cython.int = self.ray.cross()
            if o < 0:
                return False
            if self.has_end(self.ray.t, i):
                return True
            if not self.ray.turn(o):
                return False
        return False
