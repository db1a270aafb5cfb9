"""Vertices and faces numbered breadth-first, so that neighbours lie near each other in memory."""

import cython
import numpy as np


def n_near(twin: cython.int[::1], reach: cython.int) -> int:
    """How many half-edges (3 m,) are glued to one whose number differs from theirs by less than `reach`."""
    n: cython.int = 0
    with cython.nogil:
        for h in range(twin.shape[0]):
            n += (twin[h] >= 0) & (-reach < twin[h] - h) & (twin[h] - h < reach)
    return n


def breadth_first(edges, n: cython.int, start: cython.int):
    """Number vertices and faces in the order in which a breadth-first search over the faces meets them.

    The data of a front is then contiguous in memory. The search begins at face `start`; each further component begins
    at the first face that is left. `edges` are `HalfEdges` on n vertices, of which those of no face come last.

    Returns the fields of `HalfEdges` by the new numbers, the new number (n,) of each vertex, and the old number (m,) of
    each face, whose corners stay in place.
    """
    m: cython.int = len(edges.twin) // 3
    vertices, twins, rings = np.empty(3 * m, np.int32), np.empty(3 * m, np.int32), np.empty(3 * m, np.int32)
    alignment, lengths = np.empty(3 * m, np.uint8), np.empty(3 * m)
    numbers, faces = np.full(n, -1, np.int32), np.empty(m, np.int32)
    search: _Numbering = _Numbering()
    search.vertex, search.twin, search.aligned, search.length = edges.vertex, edges.twin, edges.aligned, edges.length
    search.new_vertex, search.new_twin, search.new_aligned, search.new_length = vertices, twins, alignment, lengths
    search.number, search.face, search.place = numbers, faces, np.full(m, -1, np.int32)
    old_ring: cython.const[cython.int][::1] = edges.ring
    new_ring: cython.int[::1] = rings
    with cython.nogil:
        search.go_on_from(start)
        for first in range(m):
            search.go_on_from(first)
        for v in range(n):
            if search.number[v] < 0:
                search.number[v] = search.n_numbered
                search.n_numbered += 1
        for h in range(3 * m):
            new_ring[h] = h
            if search.has_many:
                t: cython.int = old_ring[3 * search.face[h // 3] + h % 3]
                new_ring[h] = 3 * search.place[t // 3] + t % 3
    return vertices, twins, rings, alignment, lengths, numbers, faces


@cython.final
@cython.cclass
class _Numbering:
    """Input and results of a breadth-first search over the faces."""

    vertex: cython.const[cython.int][::1]
    twin: cython.const[cython.int][::1]
    aligned: cython.const[cython.uchar][::1]
    length: cython.const[cython.double][::1]
    new_vertex: cython.int[::1]
    new_twin: cython.int[::1]
    new_aligned: cython.uchar[::1]
    new_length: cython.double[::1]
    number: cython.int[::1]
    face: cython.int[::1]
    place: cython.int[::1]  # new number of each face
    n_met: cython.int
    n_done: cython.int
    n_numbered: cython.int
    has_many: cython.bint  # whether more than two faces meet at an edge

    @cython.cfunc
    @cython.nogil
    def go_on_from(self, first: cython.int) -> cython.void:
        """Number the faces of the component of this one, unless it has a number."""
        self.meet(first)
        while self.n_done < self.n_met:
            h: cython.int = 3 * self.face[self.n_done]
            g: cython.int = 3 * self.n_done
            for c in range(3):
                v: cython.int = self.vertex[h + c]
                if self.number[v] < 0:
                    self.number[v] = self.n_numbered
                    self.n_numbered += 1
                self.new_vertex[g + c] = self.number[v]
                self.new_length[g + c] = self.length[h + c]
                self.new_aligned[g + c] = self.aligned[h + c]
                t: cython.int = self.twin[h + c]
                if t >= 0:
                    self.meet(t // 3)
                    t = 3 * self.place[t // 3] + t % 3
                self.has_many |= t == -2
                self.new_twin[g + c] = t
            self.n_done += 1

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def meet(self, f: cython.int) -> cython.void:
        if self.place[f] < 0:
            self.place[f] = self.n_met
            self.face[self.n_met] = f
            self.n_met += 1
