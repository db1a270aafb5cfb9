"""The order in which a sweep visits the vertices of a triangulation, found while their distances are."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.sweep.band_queue import clear, put, take
from cython.cimports.libc.math import INFINITY

_WAITING = np.dtype([("vertex", "i4"), ("following", "i4")])


@cython.final
@cython.cclass
class VisitOrder:
    """The order of Dijkstra's algorithm, with distances that a sweep lowers: next comes the nearest along an edge.

    The first `n_ordered` entries of `order` are known, and vertices beyond them have rank n. The neighbours of the
    first `n_passed` are in the queue `ahead`, by their `key`, the distance along an edge. Vertices in a band of one
    width may come in any order, so that they need no heap.

    Parameters
    ----------
    t : SpokeTable
        The triangulation.
    d : (n,) float64
        Distances, which are changed outside; the order begins with those that are finite.
    width : float
        Of the bands.
    """

    def __init__(self, t, d, width):
        n = len(d)
        self.t, self.d = t, d
        self.order, self.rank = np.empty(n, np.int32), np.full(n, n, np.int32)
        # Each vertex is put once, and from each neighbour at most once more.
        self.key, self.waiting = np.full(n, np.inf), np.empty(self.t.spoke.shape[0] + n, _WAITING)
        self.n_ordered = self.n_passed = 0
        self.put_known(width)

    def put_known(self, width: cython.double) -> cython.void:
        """Begin with the vertices whose distance is known."""
        clear(cython.address(self.ahead), cython.address(self.waiting[0]), width)
        for v in range(self.d.shape[0]):
            if self.d[v] < INFINITY:
                self.key[v] = self.d[v]
                put(cython.address(self.ahead), v, self.d[v])

    def advance(self, i: cython.Py_ssize_t, count: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """Go on until it is known which `count` vertices come from rank i on, or all are met; returns `n_ordered`."""
        while self.n_passed + 1 < i:
            self.reach_neighbours()
        while self.n_ordered < i + count:
            v: cython.int = take(cython.address(self.ahead), cython.address(self.key[0]))
            if v < 0:
                if self.n_ordered > i or self.n_passed == i:
                    break
                self.reach_neighbours()
            elif self.rank[v] == self.order.shape[0]:
                self.order[self.n_ordered] = v
                self.rank[v] = self.n_ordered
                self.n_ordered += 1
        return self.n_ordered

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def reach_neighbours(self) -> cython.void:
        """Put the neighbours of the next vertex that was passed into the queue."""
        v: cython.int = self.order[self.n_passed]
        self.n_passed += 1
        for k in range(self.t.first[v], self.t.first[v + 1]):
            s = cython.address(self.t.spoke[k])
            key: cython.double = self.d[v] + s.length
            if key < self.key[s.neighbour]:
                self.key[s.neighbour] = key
                put(cython.address(self.ahead), s.neighbour, key)
