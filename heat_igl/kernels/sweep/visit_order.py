"""The order in which a sweep visits the vertices of a triangulation, found while their distances are."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, floor

_WAITING = np.dtype([("vertex", "i4"), ("following", "i4")])


@cython.final
@cython.cclass
class VisitOrder:
    """The order of Dijkstra's algorithm, with distances that a sweep lowers: next comes the nearest along an edge.

    The first `n_ordered` entries of `order` are known, and vertices beyond them have rank n. The neighbours of the
    first `n_passed` wait by their `key`, the distance along an edge: in a ring of queues, from `head` to `tail`, one
    for each band of distance, the current one `band`. Keys beyond the last band of the ring wait in that one, and are
    put again when it comes. A vertex may wait several times, and those of a band may come in any order, so that they
    need no heap: it is that in which they were put.

    The distances d (n,) are changed outside; the order begins with those that are finite.
    """

    def __init__(self, spokes, d, width):
        n = len(d)
        self.first, self.spoke, self.d = spokes.first, spokes.spoke, d
        self.order, self.rank = np.empty(n, np.int32), np.full(n, n, np.int32)
        # Each vertex is put once, and from each neighbour at most once more.
        self.key, self.place = np.full(n, np.inf), np.empty(self.spoke.shape[0] + n, _WAITING)
        self.per_length = 1.0 / width
        for i in range(BANDS):
            self.head[i] = -1
        for v in range(self.d.shape[0]):
            if self.d[v] < INFINITY:
                self.put(v, self.d[v])

    def advance(self, i, count):
        """Go on until it is known which `count` vertices come from rank i on, or all are met; returns `n_ordered`."""
        while self.n_passed + 1 < i:
            self.reach_neighbours()
        while self.n_ordered < i + count:
            v: cython.int = self.take()
            if v < 0:
                if self.n_ordered > i or self.n_passed == i:
                    break
                self.reach_neighbours()
            elif self.rank[v] == self.order.shape[0]:
                self.order[self.n_ordered] = v
                self.rank[v] = self.n_ordered
                self.n_ordered += 1
        return self.n_ordered

    def reach_neighbours(self):
        """Put the neighbours of the next vertex that was passed into the ring."""
        v: cython.int = self.order[self.n_passed]
        self.n_passed += 1
        for k in range(self.first[v], self.first[v + 1]):
            s = cython.address(self.spoke[k])
            key: cython.double = self.d[v] + s.length
            if key < self.key[s.neighbour]:
                self.put(s.neighbour, key)

    def put(self, v, key):
        """Let a vertex wait at a distance."""
        self.key[v] = key
        self.place[self.n_places].vertex = v
        self.append(self.n_places)
        self.n_places += 1
        self.n_waiting += 1

    def take(self):
        """Take a vertex of the nearest band; -1 if none is left."""
        n_passed: cython.int = 0
        while self.n_waiting > 0:
            slot: cython.int = cython.cast(cython.longlong, self.band) & (BANDS - 1)
            place: cython.int = self.head[slot]
            if place < 0:
                self.band += 1.0
                n_passed += 1
                if n_passed == BANDS:
                    n_passed = 0
                    self.leap()
                continue
            self.head[slot] = self.place[place].following
            if self.key[self.place[place].vertex] * self.per_length >= self.band + 1.0:
                self.append(place)
                continue
            self.n_waiting -= 1
            return self.place[place].vertex
        return -1

    def leap(self):
        """Go on to the nearest band in which a vertex waits: all of them are far ahead."""
        left: cython.int = -1
        nearest: cython.double = INFINITY
        for slot in range(BANDS):
            place: cython.int = self.head[slot]
            self.head[slot] = -1
            while place >= 0:
                following: cython.int = self.place[place].following
                nearest = min(nearest, self.key[self.place[place].vertex])
                self.place[place].following = left
                left = place
                place = following
        self.band = floor(nearest * self.per_length)
        while left >= 0:
            following = self.place[left].following
            self.append(left)
            left = following

    def append(self, place):
        """Add a place to the queue of its band, or of the last one of the ring."""
        key: cython.double = self.key[self.place[place].vertex]
        band: cython.double = min(max(key * self.per_length, self.band), self.band + (BANDS - 1))
        slot: cython.int = cython.cast(cython.longlong, band) & (BANDS - 1)
        self.place[place].following = -1
        if self.head[slot] < 0:
            self.head[slot] = place
        else:
            self.place[self.tail[slot]].following = place
        self.tail[slot] = place
