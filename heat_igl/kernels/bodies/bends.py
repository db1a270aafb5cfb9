"""Kernel of bends: ways through tetrahedra that turn around edges of the body."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.bends import LEVEL, MOST_ROUNDS, SLACK
from cython.cimports.heat_igl.kernels.bodies.bent_ways import GAIN
from cython.cimports.heat_igl.kernels.bodies.bodies import Body
from cython.cimports.heat_igl.kernels.bodies.fitted_bends import FittedBends
from cython.cimports.heat_igl.kernels.bodies.rays import Ray
from cython.cimports.libc.math import sqrt

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
        ("wall", "f8"),
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

    Parameters
    ----------
    edges : (e, 2) int32
        Edges of the body around which ways bend, roughly from near to far.
    outward : (e, 3) float64
        Direction out of the body at each, halfway between the two walls; zero where more than two meet.
    wall : (e,) float64
        Cosine of the angle between that direction and the walls.
    body : Body
        Tetrahedra.
    beside : float
        Share of the longest edge at a vertex by which it may lie beside the part of the body that an edge hides, and
        the search still goes on behind it: a larger one finds more of what is hidden in coarse bodies, and takes time.
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
    n, e = body.positions.shape[0], edges.shape[0]
    all_bends = np.zeros(e, _BEND)
    ends = np.asarray(edges)
    X = np.asarray(body.positions)[ends]
    all_bends["a"], all_bends["b"] = ends.T
    all_bends["length"] = np.linalg.norm(X[:, 1] - X[:, 0], axis=1)
    all_bends["tangent"] = (X[:, 1] - X[:, 0]) / all_bends["length"][:, None]
    all_bends["outward"], all_bends["wall"] = outward, wall
    all_bends["at"] = np.inf
    one = _Search()
    one.ray = Ray(body)
    one.bends = all_bends
    one.corners, one.first, one.incident, one.positions = body.corners, body.first, body.incident, body.positions
    one.first_neighbour, one.neighbours, one.reach = body.first_neighbour, body.neighbours, body.reach
    one.beside, one.sources, one.offset = beside, sources, offset
    one.d, one.begin, one.label, one.way = d, begin, label, way
    one.seen, one.lit, one.queue = np.full(n, -1, np.int32), np.full(n, -1, np.int32), np.empty(n, np.int32)
    with cython.nogil:
        for _rounds in range(MOST_ROUNDS):
            before: cython.int = one.stamp
            for i in range(one.bends.shape[0]):
                if one.is_stale(i):
                    one.stamp += 1
                    one.fit(i)
                    one.search(i)
            if one.stamp == before:
                break
    return one.stamp


@cython.final
@cython.cclass
class _Search(FittedBends):
    """The vertices around an edge that is searched: `seen` (n,) has the last search that came to each.

    `is_below` tells whether the vertex that was last looked at is hidden by the wall behind the edge.
    """

    first_neighbour: cython.const[cython.int][::1]
    neighbours: cython.const[cython.int][::1]
    reach: cython.const[cython.double][::1]
    seen: cython.int[::1]
    queue: cython.int[::1]
    beside: cython.double
    is_below: cython.bint

    @cython.cfunc
    @cython.nogil
    def search(self, i: cython.int) -> cython.void:
        """Give the vertices around an edge their ways around it, as far as they see it and may need it."""
        bend = cython.address(self.bends[i])
        stamp: cython.int = self.stamp
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
            if not self.is_hidden_from_before(i, u):
                continue
            # A vertex that gains nothing, or sees nothing of the edge, may lie between those that do.
            if is_better and not self.is_below:
                if not self.sees(i, u):
                    continue
                self.lit[u] = stamp
                self.d[u], self.way[u] = value, i
                self.begin[u] = value - self.away(u)
                self.label[u] = self.label[bend.a if self.share < 0.5 else bend.b]
            size = self.push_around(u, size, stamp)

    @cython.cfunc
    @cython.nogil
    def push_around(self, v: cython.int, size: cython.int, stamp: cython.int) -> cython.int:
        """Put the neighbours of v that the search has not come to at the end of the queue; returns its size."""
        for k in range(self.first_neighbour[v], self.first_neighbour[v + 1]):
            u: cython.int = self.neighbours[k]
            if self.seen[u] != stamp:
                self.seen[u] = stamp
                self.queue[size] = u
                size += 1
        return size

    @cython.cfunc
    @cython.nogil
    def is_hidden_from_before(self, i: cython.int, v: cython.int) -> cython.bint:
        """Whether v lies behind the edge, or beside that at most so far as was allowed; sets `is_below`.

        Seen along the edge, the line from v to the point from which the way comes passes outside, and v is not below
        the plane of the wall behind the edge.
        """
        bend = cython.address(self.bends[i])
        self.is_below = False
        if bend.outward[0] == 0 and bend.outward[1] == 0 and bend.outward[2] == 0:
            return True
        before_out: cython.double = 0.0
        before_side: cython.double = 0.0
        out: cython.double = 0.0
        side: cython.double = 0.0
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
        near: cython.double = self.beside * self.reach[v]
        below: cython.double = out - bend.wall * sqrt(out * out + side * side)
        self.is_below = below > LEVEL * self.reach[v]
        if below > near:
            return False
        if not bend.has_before:
            return True
        if before_side < 0:
            before_side, side = -before_side, -side
        behind: cython.double = out * before_side - side * before_out
        return side <= near and behind >= -near * sqrt(before_out * before_out + before_side * before_side)
