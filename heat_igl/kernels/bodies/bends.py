"""Kernel of bends: ways through tetrahedra that turn around edges of the body."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.bends import Met, Offer
from cython.cimports.heat_igl.kernels.bodies.edge_distances import EdgeDistances
from cython.cimports.heat_igl.kernels.bodies.rays import GAIN, Body, Line
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.libc.math import INFINITY
from cython.cimports.libc.stdlib import free, realloc

from heat_igl.kernels.signals import raise_caught

# Share of the longest edge at a vertex by which a way that is passed on is longer than straight, or by a neighbour.
# Half of it makes 27 vertices longer by .2 to 1 %, nothing 3845 by up to 14 %; twice as much 17 shorter by .2 to .5 %.
_SLACK = cython.declare(cython.double, 0.02)
# Times that distance along an edge is told from that before, 6 at most so far, and that in bits.
_MOST_FITS = cython.declare(cython.int, 63)
_FIT_BITS = cython.declare(cython.int, 6)
# No edge.
_NONE = cython.declare(cython.int, -3)


def bend_around(
    edges: cython.const[cython.int][:, ::1],
    outward: cython.const[cython.double][:, ::1],
    wall: cython.const[cython.double][::1],
    body: Body,
    sources: cython.const[cython.int][::1],
    offset: cython.const[cython.double][::1],
    d: cython.double[::1],
    label: cython.int[::1],
    way: cython.int[::1],
):
    """Lower `d` (n,) to ways that bend around edges of the body, and are straight lines in between.

    A shortest way bends at edges of the body with more than half a turn inside, and nowhere else. Along such an edge,
    distance is that from a point beside it, turned into one plane; behind the edge, the plane is turned again. So an
    edge whose ends know their distances is a source. It is a candidate for the vertices around it, and for the
    neighbours of those to which the way around it is the shortest, unless a neighbour leads to them on a shorter way.
    Where vertices are left without a way, the ends of edges next to them become sources as well: an edge from a vertex
    to itself, as the end may be seen where the place at which a way would bend is hidden.

    Vertices wait in the order of their first candidates. When the line to the first edge has been followed, edges that
    share an end with it become candidates, and if it is hidden, those at the triangle that hides it.

    The edges (e, 2) int32 are those of the `body` around which ways bend, and then those ends. `outward` (k, 3) is the
    direction out of the body at each of the former, halfway between the two walls, zero where more than two meet, and
    `wall` (k,) the cosine of the angle between that direction and the walls. `way` (n,) int32 is the edge around which
    the way to each vertex bends last, -1 on straight ways, -2 where it is not known. The other arguments are those of
    `sight.look_around`; `d`, `label` and `way` are changed.
    """
    n, e = body.positions.shape[0], edges.shape[0]
    one = Bends(body, sources, offset, d, label, edges, outward, wall, way)
    one.fit_of = np.arange(e, dtype=np.int32) << _FIT_BITS
    one.newest, one.met = np.full((2, n), _NONE, np.int32)
    one.waiting, one.bound = PriorityQueue(n), np.array(d)
    # Ways to the middle of an edge bend around edges that are nearer.
    order: cython.const[cython.int][::1] = np.argsort(np.asarray(d)[edges].max(axis=1), kind="stable").astype(np.int32)
    n_asked: cython.Py_ssize_t = 0
    while True:
        with cython.nogil:
            for i in range(e):
                if one.is_source(order[i]):
                    one.begin_around(order[i])
            while one.waiting.count > 0 and not one.failed:
                n_asked += 1
                if n_asked % ASK == 0 and is_interrupted():
                    break
                one.ask(one.waiting.first())
        raise_caught()
        if one.failed:
            raise MemoryError("no memory for the ways around edges of the body")
        n_left: cython.Py_ssize_t = 0
        with cython.nogil:
            for v in range(n):
                n_left += one.wake_at(v)
        if n_left == 0:
            break
        if one.waiting.count == 0:
            before = np.array(d)
            body.along_edges(d, label)
            np.asarray(way)[np.asarray(d) < before] = -2


@cython.final
@cython.cclass
class Bends(EdgeDistances):
    """Ways around edges, and the edges that are candidates for them.

    `fit_of` (e,) is the number of each edge, followed by `_FIT_BITS` that count how often it has been fitted. The edges
    that are candidates for a vertex are a list of `offers` whose first one is the `newest` (n,). Each has `fit_of` its
    edge when it was made, the value of the way, `INFINITY` once the line has been followed, and whether it is a guess:
    it shares an end with an edge that was hidden. All edges that were offered to a vertex are in `lists` that begin at
    `met` (n,); there is room for `most_offers` and `most_lists`. No way to a vertex is longer than its `bound`.
    """

    def __dealloc__(self):
        free(self.offers)
        free(self.lists)

    def begin_around(self, i):
        """Make an edge whose ends have shorter distances a candidate for those around them."""
        to_a: cython.double = self.d[self.edges[i, 0]]
        to_b: cython.double = self.d[self.edges[i, 1]]
        is_new: cython.bint = self.edge[i].at[0] > to_a * (1 + GAIN) or self.edge[i].at[4] > to_b * (1 + GAIN)
        if is_new and max(to_a, to_b) < INFINITY:
            self.begin(i, False)

    def is_source(self, i):
        """Whether an edge is one from the beginning, or has been woken."""
        u: cython.int = self.edges[i, 0]
        return u != self.edges[i, 1] or self.last_at_end[u] == self.first_at_end[u + 1]

    def wake_at(self, v):
        """Let v and the ends of its way's edge be candidates for neighbours left without a way; returns how many."""
        way: cython.int = self.way[v]
        n_left: cython.int = 0
        if self.d[v] < INFINITY:
            for m in range(self.body.first_neighbour[v], self.body.first_neighbour[v + 1]):
                if self.d[self.body.neighbours[m]] == INFINITY:
                    n_left += 1
                    self.wake(v, self.body.neighbours[m])
                    for c in range(2 if way >= 0 else 0):
                        self.wake(self.edges[way, c], self.body.neighbours[m])
        return n_left

    def wake(self, u, v):
        """Make the edge from an end of edges to itself, if u is one, a candidate for v."""
        k: cython.int = self.first_at_end[u + 1]
        if k > self.first_at_end[u] and self.edges[self.at_end[k - 1], 0] == self.edges[self.at_end[k - 1], 1]:
            if self.last_at_end[u] < k:
                self.last_at_end[u] = k
                self.begin(self.at_end[k - 1], False)
            self.offer(self.at_end[k - 1], v, 0.0)

    def begin(self, i, follows):
        """Fit an edge, anew after one whose ways do not hold, and make it a candidate for those around it."""
        self.fit(i, follows)
        j: cython.int = self.refuted
        if j >= 0:
            self.refuted = _NONE
            self.begin(j, True)
            self.begin(i, follows)
            return
        if self.fit_of[i] & _MOST_FITS < _MOST_FITS:
            self.fit_of[i] += 1
        self.offer_around(i, self.edges[i, 0])
        self.offer_around(i, self.edges[i, 1])

    def begin_at(self, v):
        """Begin around the edges that end at v, in the order of the other ends: ways lead from edge to edge."""
        last: cython.double = -1.0
        while last < INFINITY:
            nearest: cython.double = INFINITY
            for k in range(self.first_at_end[v], self.last_at_end[v]):
                other: cython.double = self.d[self.edges[self.at_end[k], 0] + self.edges[self.at_end[k], 1] - v]
                if last < other < nearest:
                    nearest = other
            for k in range(self.first_at_end[v], self.last_at_end[v]):
                if self.d[self.edges[self.at_end[k], 0] + self.edges[self.at_end[k], 1] - v] == nearest:
                    self.begin_around(self.at_end[k])
            last = nearest

    def offer_around(self, i, u):
        """Make an edge a candidate for the neighbours of u, none of which is farther than along an edge from u."""
        for m in range(self.body.first_neighbour[u], self.body.first_neighbour[u + 1]):
            v: cython.int = self.body.neighbours[m]
            if self.way[v] != -1 and self.bound[v] > self.d[u]:
                self.bound[v] = min(self.bound[v], self.d[u] + self.body.apart(v, u))
            self.offer(i, v, 0.0)

    def offer_at(self, a, v, least):
        """Make the edges that end at a candidates for v."""
        for k in range(self.first_at_end[a], self.last_at_end[a]):
            self.offer(self.at_end[k], v, least)

    def offer(self, i, v, least):
        """Make an edge a candidate for v, which waits, if the way around it would be shorter and v has not met it."""
        here: cython.pointer[cython.const[cython.double]] = cython.address(self.body.positions[v, 0])
        most: cython.double = self.most(v)
        if self.edge[i].least >= most or self.has_met(v, self.fit_of[i]):
            return
        value: cython.double = self.around(i, here, most)
        if value < least or value >= most or self.lacks_room():
            return
        k: cython.int = self.met[v]
        if k < 0 or self.lists[k].count == 14:
            k = self.n_lists
            for m in range(14):
                self.lists[k].fits[m] = _NONE
            self.lists[k].count, self.lists[k].next = 0, self.met[v]
            self.met[v], self.n_lists = k, self.n_lists + 1
        self.lists[k].fits[self.lists[k].count] = self.fit_of[i]
        self.lists[k].count += 1
        if v in (self.edges[i, 0], self.edges[i, 1]) or not self.is_hidden_from_before(i, here, self.body.reach[v]):
            return
        one: cython.pointer[Offer] = cython.address(self.offers[self.n_offers])
        one.fit, one.next, one.is_guess, one.value = self.fit_of[i], self.newest[v], self.is_guess, value
        self.newest[v], self.n_offers = self.n_offers, self.n_offers + 1
        self.waiting.set_key(v, max(self.waiting.key[v], 1 / value))

    def has_met(self, v, fit):
        """Whether an edge has been offered to v since it was fitted last."""
        k: cython.int = self.met[v]
        while k >= 0:
            found: cython.int = 0
            for m in range(14):
                found |= self.lists[k].fits[m] == fit
            if found:
                return True
            k = self.lists[k].next
        return False

    def lacks_room(self):
        """Whether there is no memory for one more offer and one more list."""
        if self.n_offers == self.most_offers:
            self.most_offers = 2 * self.most_offers + 8 * self.d.shape[0]
            found: cython.p_void = realloc(self.offers, self.most_offers * cython.sizeof(Offer))
            self.failed = found == cython.NULL
            if not self.failed:
                self.offers = cython.cast(cython.pointer[Offer], found)
        if self.n_lists == self.most_lists and not self.failed:
            self.most_lists = 2 * self.most_lists + 2 * self.d.shape[0]
            found = realloc(self.lists, self.most_lists * cython.sizeof(Met))
            self.failed = found == cython.NULL
            if not self.failed:
                self.lists = cython.cast(cython.pointer[Met], found)
        return self.failed

    def most(self, v):
        """What a way to v is to be shorter than; a vertex that sees a source passes on edges that are no better."""
        if self.way[v] == -1:
            return self.d[v] + _SLACK * self.body.reach[v]
        return min(self.d[v] * (1 - GAIN), self.bound[v] + _SLACK * self.body.reach[v])

    def shortest(self, v):
        """The candidate of v around which the way is the shortest, of equal ones the oldest; those that are done go."""
        least: cython.double = INFINITY
        best: cython.int = _NONE
        link: cython.pointer[cython.int] = cython.address(self.newest[v])
        while link[0] >= 0:
            one: cython.pointer[Offer] = cython.address(self.offers[link[0]])
            if one.fit != self.fit_of[one.fit >> _FIT_BITS] or one.value >= self.most(v):
                link[0] = one.next
                continue
            if one.value <= least * (1 + GAIN):
                best, least = link[0], one.value
            link = cython.address(one.next)
        self.waiting.set_key(v, 1 / least)
        return best

    def ask(self, v):
        """Give v the way around its first candidate if the line is clear, and offer the edge to the neighbours.

        Edges that share an end with it may give shorter ways, if it is clear, and are asked for at once. If it is
        hidden, they wait with those at the triangle that hides it; guesses that are hidden do not lead to nearer ones.
        """
        line: cython.pointer[Line] = cython.address(self.line)
        is_found: cython.bint = False
        k: cython.int = self.shortest(v)
        while k >= 0 and self.offers[k].value < self.d[v] * (1 - GAIN):
            i: cython.int = self.offers[k].fit >> _FIT_BITS
            value: cython.double = self.offers[k].value
            least: cython.double = value if self.offers[k].is_guess else 0.0
            self.offers[k].value = INFINITY
            self.look_back(i, cython.address(self.body.positions[v, 0]))
            label: cython.int = self.label_at(i)
            is_clear: cython.bint = self.follows(line, v)
            if is_clear and not self.holds(i):
                self.begin(i, True)
                self.offer(i, v, 0.0)
            else:
                if is_clear:
                    is_found = True
                    self.d[v], self.way[v], self.label[v] = value, i, label
                else:
                    for c in range(1, 4):
                        self.offer_at(self.body.cells[line.t, (line.out + c) & 3], v, 0.0)
                self.is_guess = not is_clear
                self.offer_at(self.edges[i, 0], v, 0.0 if is_clear else least)
                self.offer_at(self.edges[i, 1], v, 0.0 if is_clear else least)
                self.is_guess = False
            k = self.shortest(v)
            if not is_found:
                return
        if is_found:
            self.offer_around(self.way[v], v)
            self.begin_at(v)
        elif k >= 0:
            self.offers[k].value = INFINITY
            self.offer_around(self.offers[k].fit >> _FIT_BITS, v)
        self.shortest(v)
