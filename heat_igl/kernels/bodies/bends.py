"""Kernel of bends: ways through tetrahedra that turn around edges of the body."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.rays import GAIN, NUDGE, Body, Line, Ray
from cython.cimports.libc.math import INFINITY, fabs, sqrt

# Share of the longest edge at a vertex by which a way to it may be too long, and the search still goes on behind it.
_SLACK = cython.declare(cython.double, 0.2)
# Share of that edge by which a vertex may lie below the plane of a wall and still be on it.
_LEVEL = cython.declare(cython.double, 1e-6)
# Share of an edge by which the fitted distance may be wrong at its quarters.
_MISFIT = cython.declare(cython.double, 1e-3)
# Change of the slope along an edge below which a front is straight there.
_STRAIGHT_FRONT = cython.declare(cython.double, 1e-7)
# Rounds over the edges around which ways bend.
_MOST_ROUNDS = cython.declare(cython.int, 50)


def bend_around(
    edges: cython.const[cython.int][:, ::1],
    outward: cython.const[cython.double][:, ::1],
    wall: cython.const[cython.double][::1],
    body: Body,
    beside: cython.double,
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

    The edges (e, 2) int32 are those of the `body` around which ways bend, roughly from near to far. `outward` (e, 3) is
    the direction out of the body at each, halfway between the two walls, zero where more than two meet, and `wall` (e,)
    the cosine of the angle between that direction and the walls. A vertex may lie `beside` the part of the body that an
    edge hides, by this share of its longest edge, and the search still goes on behind it: a larger one finds more of
    what is hidden in coarse bodies, and takes time. `way` (n,) int32 is the edge around which the way to each vertex
    bends last, -1 on straight ways, -2 where it is not known. The other arguments are those of `sight.look_around`;
    `d`, `begin`, `label` and `way` are changed.

    Returns the number of times that vertices were searched around an edge.
    """
    n, e = body.positions.shape[0], edges.shape[0]
    ends = np.asarray(body.positions)[np.asarray(edges)]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    one = _Bends(body, sources, offset, d, begin, label)
    one.edges, one.outward, one.wall, one.beside, one.way = edges, outward, wall, beside, way
    one.length, one.tangent = lengths, (ends[:, 1] - ends[:, 0]) / lengths[:, None]
    one.at, one.before, one.has_before = np.full((e, 5), np.inf), np.zeros((e, 3)), np.zeros(e, np.uint8)
    one.start, one.along, one.height, one.fits = np.zeros(e), np.zeros(e), np.zeros(e), np.zeros(e, np.uint8)
    one.seen, one.lit, one.queue = np.full(n, -1, np.int32), np.full(n, -1, np.int32), np.empty(n, np.int32)
    one.line.lit = one.reverse.lit = cython.address(one.lit[0])
    one.reverse.stamp = -2
    with cython.nogil:
        for _rounds in range(_MOST_ROUNDS):
            before: cython.int = one.stamp
            for i in range(e):
                if one.is_stale(i):
                    one.stamp, one.sought = one.stamp + 1, i
                    one.fit(i)
                    one.search(i)
            if one.stamp == before:
                break
    return one.stamp


@cython.final
@cython.cclass
class _Bends(Ray):
    """Edges of a body around which ways bend, the ways, and the search around an edge.

    Distance along an edge that `fits` is ``start + |(x - along, height)|``, x along the edge; at its ends, the quarters
    and the middle it is `at`. `before` is the point from which the way comes to the middle, if it `has_before`.

    Of the way that was last asked for, `bend` (3,) is the point at which it bends last, `share` the place of this point
    along the edge, and `beyond` by how much the way would miss the edge on a line through it.

    Of the search around the edge `sought`, `stamp` is the number; `seen` (n,) has the last search that came to each
    vertex, and `lit` (n,) the last in which it saw the edge. `line` goes to the edge, and `reverse` from it.
    """

    edges: cython.const[cython.int][:, ::1]
    outward: cython.const[cython.double][:, ::1]
    wall: cython.const[cython.double][::1]
    length: cython.double[::1]
    tangent: cython.double[:, ::1]
    at: cython.double[:, ::1]
    before: cython.double[:, ::1]
    has_before: cython.uchar[::1]
    start: cython.double[::1]
    along: cython.double[::1]
    height: cython.double[::1]
    fits: cython.uchar[::1]
    way: cython.int[::1]
    bend: cython.double[3]
    share: cython.double
    beyond: cython.double
    sought: cython.int
    stamp: cython.int
    seen: cython.int[::1]
    lit: cython.int[::1]
    queue: cython.int[::1]
    beside: cython.double
    line: Line
    reverse: Line

    @cython.cfunc
    @cython.nogil
    def is_stale(self, i: cython.int) -> cython.bint:
        """Whether the ends of an edge have distances, and others than when it was fitted."""
        to_a: cython.double = self.d[self.edges[i, 0]]
        to_b: cython.double = self.d[self.edges[i, 1]]
        if to_a == INFINITY or to_b == INFINITY:
            return False
        return self.at[i, 0] > to_a * (1 + GAIN) or self.at[i, 4] > to_b * (1 + GAIN)

    @cython.cfunc
    @cython.nogil
    def fit(self, i: cython.int) -> cython.void:
        """Find distance along an edge from the ways to its ends."""
        x: cython.double[3]
        a: cython.int = self.edges[i, 0]
        b: cython.int = self.edges[i, 1]
        to_a: cython.double = self.d[a]
        to_b: cython.double = self.d[b]
        # The way to one end continues along the edge unless it is hidden at the other end.
        a_reaches: cython.bint = self.value(a, cython.address(self.body.positions[b, 0])) >= to_b * (1 - GAIN)
        b_reaches: cython.bint = self.value(b, cython.address(self.body.positions[a, 0])) >= to_a * (1 - GAIN)
        self.at[i, 0], self.at[i, 4] = to_a, to_b
        for j in range(1, 4):
            for k in range(3):
                x[k] = self.body.positions[a, k] + 0.25 * j * self.length[i] * self.tangent[i, k]
            from_a: cython.double = self.value(a, x)
            from_b: cython.double = self.value(b, x)
            a_is_seen: cython.bint = a_reaches or self.is_lit_from(a, x, 0.25 * j)
            b_is_seen: cython.bint = b_reaches or self.is_lit_from(b, x, 0.25 * j)
            if a_is_seen and b_is_seen:
                self.at[i, j] = min(from_a, from_b)
            elif a_is_seen:
                self.at[i, j] = from_a
            elif b_is_seen:
                self.at[i, j] = from_b
            else:
                self.at[i, j] = max(from_a, from_b)
            if j == 2:
                self.value(a, x)
                self.has_before[i] = self.way[a] > -2
                for k in range(3):
                    self.before[i, k] = self.bend[k]
        self.lay_flat(i, a, b)

    @cython.cfunc
    @cython.nogil
    def lay_flat(self, i: cython.int, a: cython.int, b: cython.int) -> cython.void:
        """Find the point beside an edge from which distance along it is measured, and whether there is one."""
        size: cython.double = self.length[i]
        to_a: cython.double = self.at[i, 0]
        middle: cython.double = self.at[i, 2] - to_a
        to_b: cython.double = self.at[i, 4] - to_a
        turn: cython.double = to_b - 2 * middle
        way_a: cython.int = self.way[a]
        if way_a == -1 and self.way[b] == -1 and self.label[a] == self.label[b]:
            self.start[i] = self.offset[self.label[a]] - to_a
        elif turn > _STRAIGHT_FRONT * size:
            self.start[i] = (to_b * to_b - 2 * middle * middle - 0.5 * size * size) / (2 * turn)
        elif way_a >= 0:
            self.start[i] = self.start[way_a] - to_a
        elif way_a == -1:
            self.start[i] = self.offset[self.label[a]] - to_a
        else:
            self.start[i] = -size / _STRAIGHT_FRONT
        self.start[i] = max(self.start[i], -size / _STRAIGHT_FRONT)
        radius: cython.double = -self.start[i]
        other: cython.double = to_b - self.start[i]
        self.along[i] = 0.5 * ((radius - other) * (radius + other) / size + size)
        squared: cython.double = radius * radius - self.along[i] * self.along[i]
        self.fits[i] = radius >= 0 and other >= 0 and squared >= 0
        self.start[i] += to_a
        if not self.fits[i]:
            return
        self.height[i] = sqrt(squared)
        for j in range(1, 4):
            off: cython.double = 0.25 * j * size - self.along[i]
            if fabs(self.start[i] + sqrt(off * off + squared) - self.at[i, j]) > _MISFIT * size:
                self.fits[i] = False

    @cython.cfunc
    @cython.nogil
    def value(self, v: cython.int, x: cython.pointer[cython.const[cython.double]]) -> cython.double:
        """Distance at a point near vertex v, by the way to v; `bend` becomes the point at which this way bends last."""
        if self.way[v] >= 0:
            return self.around(self.way[v], x)
        source: cython.int = v
        value: cython.double = self.d[v]
        if self.way[v] == -1:
            source, value = self.sources[self.label[v]], self.offset[self.label[v]]
        squared: cython.double = 0.0
        for k in range(3):
            self.bend[k] = self.body.positions[source, k]
            squared += (x[k] - self.bend[k]) * (x[k] - self.bend[k])
        return value + sqrt(squared)

    @cython.cfunc
    @cython.nogil
    def around(self, i: cython.int, x: cython.pointer[cython.const[cython.double]]) -> cython.double:
        """Length of the way to a point that bends around an edge last; sets `bend`, `share` and `beyond`."""
        away: cython.double = 0.0
        along: cython.double = 0.0
        for k in range(3):
            off: cython.double = x[k] - self.body.positions[self.edges[i, 0], k]
            away += off * off
            along += off * self.tangent[i, k]
        squared: cython.double = max(away - along * along, 0.0)
        best: cython.double = INFINITY
        self.beyond = 0.0
        if self.fits[i]:
            height: cython.double = sqrt(squared)
            both: cython.double = height + self.height[i]
            self.share = self.along[i]
            if both > 0:
                self.share = (self.along[i] * height + along * self.height[i]) / both
            self.beyond = max(-self.share, self.share - self.length[i], 0.0)
            self.share = min(max(self.share / self.length[i], 0.0), 1.0)
            if 0 < self.share < 1:
                best = self.start[i] + sqrt((along - self.along[i]) * (along - self.along[i]) + both * both)
        if best == INFINITY:
            for j in range(5):
                if self.fits[i] and 0 < j < 4:
                    continue
                off = along - 0.25 * j * self.length[i]
                through: cython.double = self.at[i, j] + sqrt(squared + off * off)
                if through < best:
                    best, self.share = through, 0.25 * j
        for k in range(3):
            self.bend[k] = self.body.positions[self.edges[i, 0], k] + self.share * self.length[i] * self.tangent[i, k]
        return best

    @cython.cfunc
    @cython.nogil
    def is_lit_from(
        self, v: cython.int, x: cython.pointer[cython.const[cython.double]], share: cython.double
    ) -> cython.bint:
        """Whether the source from which the way to v is straight sees a point of the edge."""
        if self.way[v] != -1:
            return False
        self.share = share
        self.aim_at_edge(x)
        source: cython.int = self.sources[self.label[v]]
        return self.is_near(cython.address(self.line), source) or self.follows(cython.address(self.line), source)

    @cython.cfunc
    @cython.nogil
    def aim_at_edge(self, x: cython.pointer[cython.const[cython.double]]) -> cython.void:
        """Make a point of the edge `sought`, at `share`, the goal of `line`."""
        self.line.goal, self.line.stamp = x, self.stamp
        self.line.goal_a = self.edges[self.sought, 1 if self.share > 1 - NUDGE else 0]
        self.line.goal_b = self.edges[self.sought, 0 if self.share < NUDGE else 1]

    @cython.cfunc
    @cython.nogil
    def is_seen_by(self, v: cython.int) -> cython.bint:
        """Whether the line from v to the `bend` on the edge `sought`, at `share`, stays in the tetrahedra.

        To a vertex, it is followed from both ends until they meet: most lines that are hidden are so near an end.
        """
        self.aim_at_edge(self.bend)
        line: cython.pointer[Line] = cython.address(self.line)
        reverse: cython.pointer[Line] = cython.address(self.reverse)
        a: cython.int = line.goal_a
        if self.is_near(line, v):
            return True
        if a != line.goal_b:
            return self.follows(line, v)
        reverse.goal, reverse.goal_a, reverse.goal_b = cython.address(self.body.positions[v, 0]), v, v
        back: cython.int = self.cone(reverse, a)
        if back < 0:
            return self.begins(reverse, a, 0) >= 0 and self.follows(line, v)
        begin: cython.int = self.cone(line, v)
        if begin < 0:
            return self.follows(line, v)
        return self.enters(line, begin, -1, -1) and self.enters(reverse, back, -1, -1) and self.meets(line, reverse)

    @cython.cfunc
    @cython.nogil
    def search(self, i: cython.int) -> cython.void:
        """Give the vertices around an edge their ways around it, as far as they see it and may need it."""
        stamp: cython.int = self.stamp
        a: cython.int = self.edges[i, 0]
        b: cython.int = self.edges[i, 1]
        self.seen[a] = self.seen[b] = self.lit[a] = self.lit[b] = stamp
        size: cython.int = self.push_around(a, 0, stamp)
        size = self.push_around(b, size, stamp)
        next_one: cython.int = 0
        while next_one < size:
            u: cython.int = self.queue[next_one]
            next_one += 1
            value: cython.double = self.around(i, cython.address(self.body.positions[u, 0]))
            old: cython.double = self.d[u]
            is_better: cython.bint = value < old * (1 - GAIN)
            # Farther along, ways are shorter around another edge.
            if not is_better and (self.beyond > self.body.reach[u] or value > old + _SLACK * self.body.reach[u]):
                continue
            if not self.is_hidden_from_before(i, u):
                continue
            # A vertex that gains nothing may lie between those that do.
            if is_better:
                if not self.is_seen_by(u):
                    continue
                self.lit[u] = stamp
                self.d[u], self.way[u] = value, i
                self.begin[u] = value - self.away(u, self.bend)
                self.label[u] = self.label[a if self.share < 0.5 else b]
            size = self.push_around(u, size, stamp)

    @cython.cfunc
    @cython.nogil
    def push_around(self, v: cython.int, size: cython.int, stamp: cython.int) -> cython.int:
        """Put the neighbours of v that the search has not come to at the end of the queue; returns its size."""
        for k in range(self.body.first_neighbour[v], self.body.first_neighbour[v + 1]):
            u: cython.int = self.body.neighbours[k]
            if self.seen[u] != stamp:
                self.seen[u] = stamp
                self.queue[size] = u
                size += 1
        return size

    @cython.cfunc
    @cython.nogil
    def is_hidden_from_before(self, i: cython.int, v: cython.int) -> cython.bint:
        """Whether v lies behind the edge, or beside that at most so far as was allowed.

        Seen along the edge, the line from v to the point from which the way comes passes outside, and v is not below
        the plane of the wall behind the edge. No line to the edge needs those below: each triangle that it passes
        through has a corner on the other side of the plane, and such corners are neighbours from one to the next.
        """
        if self.outward[i, 0] == 0 and self.outward[i, 1] == 0 and self.outward[i, 2] == 0:
            return True
        before_out: cython.double = 0.0
        before_side: cython.double = 0.0
        out: cython.double = 0.0
        side: cython.double = 0.0
        for k in range(3):
            j: cython.int = (k + 1) % 3
            m: cython.int = (k + 2) % 3
            across: cython.double = self.tangent[i, j] * self.outward[i, m] - self.tangent[i, m] * self.outward[i, j]
            y: cython.double = self.before[i, k] - self.body.positions[self.edges[i, 0], k]
            off: cython.double = self.body.positions[v, k] - self.body.positions[self.edges[i, 0], k]
            before_out += y * self.outward[i, k]
            before_side += y * across
            out += off * self.outward[i, k]
            side += off * across
        near: cython.double = self.beside * self.body.reach[v]
        below: cython.double = out - self.wall[i] * sqrt(out * out + side * side)
        if below > _LEVEL * self.body.reach[v]:
            return False
        if not self.has_before[i]:
            return True
        if before_side < 0:
            before_side, side = -before_side, -side
        behind: cython.double = out * before_side - side * before_out
        return side <= near and behind >= -near * sqrt(before_out * before_out + before_side * before_side)
