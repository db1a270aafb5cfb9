"""Tetrahedra of a body, and what lies beside each of them and around each vertex."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.bodies import UNKNOWN
from cython.cimports.libc.math import sqrt


@cython.final
@cython.cclass
class Body:
    """A body of tetrahedra in space.

    `behind` (m, 4) is the tetrahedron behind the side opposite each corner, -1 on the boundary; the neighbours of
    vertex v are at ``first_neighbour[v]`` to ``first_neighbour[v + 1]`` of `neighbours`, and `reach` (n,) is the
    longest edge at each vertex.

    Parameters
    ----------
    corners : (m, 4) int32
        Tetrahedra.
    first, incident : (n + 1,) int32, (4 m,) int32
        Corners ``4 * tetrahedron + corner`` that meet in vertex v, at ``first[v]`` to ``first[v + 1]`` of `incident`.
    positions : (n, 3) float64
        Of the vertices.
    """

    def __init__(
        self,
        corners: cython.const[cython.int][:, ::1],
        first: cython.const[cython.int][::1],
        incident: cython.const[cython.int][::1],
        positions: cython.const[cython.double][:, ::1],
    ):
        self._arrays = tuple(map(np.asarray, (corners, first, incident, positions)))
        self.corners, self.first, self.incident, self.positions = corners, first, incident, positions
        n: cython.Py_ssize_t = positions.shape[0]
        m: cython.Py_ssize_t = corners.shape[0]
        self.behind, self.reach = np.full((m, 4), UNKNOWN, np.int32), np.zeros(n)
        counts, all_marks = np.zeros(n + 1, np.int32), np.full(n, -1, np.int32)
        n_around: cython.int[::1] = counts
        mark: cython.int[::1] = all_marks
        one_list: cython.int[::1] = np.empty(n, np.int32)
        with cython.nogil:
            for i in range(4 * m):
                if self.behind[i // 4, i % 4] == UNKNOWN:
                    self.behind[i // 4, i % 4] = self.across(i // 4, i % 4)
            for i in range(n):
                n_around[i + 1] = self.list_around(i, mark, one_list, 0)
        all_marks[:] = -1
        self.first_neighbour = np.cumsum(counts, dtype=np.int32)
        self.neighbours = np.empty(int(self.first_neighbour[n]), np.int32)
        with cython.nogil:
            for i in range(n):
                self.list_around(i, mark, self.neighbours, self.first_neighbour[i])
                self.reach[i] = self.longest_edge(i)

    def __reduce__(self):
        """What it was made of."""
        return Body, self._arrays

    def sides_behind(self):
        """`behind`, as an array."""
        return np.asarray(self.behind)

    def edges(self):
        """The ends (e, 2) int32 of each edge, the smaller one first."""
        first, head = np.asarray(self.first_neighbour), np.asarray(self.neighbours)
        tail = np.repeat(np.arange(len(first) - 1, dtype=np.int32), np.diff(first))
        return np.stack([tail, head], axis=1)[tail < head]

    def across(self, t: cython.int, o: cython.int) -> cython.int:
        """The first other tetrahedron at the side of t opposite corner o, or -1; that one is told as well."""
        a: cython.int = self.corners[t, (o + 1) % 4]
        b: cython.int = self.corners[t, (o + 2) % 4]
        c: cython.int = self.corners[t, (o + 3) % 4]
        for k in range(self.first[a], self.first[a + 1]):
            other: cython.int = self.incident[k] // 4
            if other != t:
                n_shared: cython.int = 0
                beside: cython.int = 0
                for i in range(4):
                    u: cython.int = self.corners[other, i]
                    if u in (a, b, c):
                        n_shared += 1
                    else:
                        beside = i
                if n_shared == 3:
                    # The first other one of that is t, unless an earlier one has been there.
                    if self.behind[other, beside] == UNKNOWN:
                        self.behind[other, beside] = t
                    return other
        return -1

    def list_around(self, v: cython.int, mark: cython.int[::1], into: cython.int[::1], at: cython.int) -> cython.int:
        """Write the neighbours of v down from a place on; returns the place behind them."""
        mark[v] = v
        for k in range(self.first[v], self.first[v + 1]):
            for c in range(4):
                u: cython.int = self.corners[self.incident[k] // 4, c]
                if mark[u] != v:
                    mark[u] = v
                    into[at] = u
                    at += 1
        return at

    def longest_edge(self, v: cython.int) -> cython.double:
        """The distance of v from its farthest neighbour."""
        longest: cython.double = 0.0
        for k in range(self.first_neighbour[v], self.first_neighbour[v + 1]):
            squared: cython.double = 0.0
            for i in range(3):
                off: cython.double = self.positions[self.neighbours[k], i] - self.positions[v, i]
                squared += off * off
            longest = max(longest, squared)
        return sqrt(longest)
