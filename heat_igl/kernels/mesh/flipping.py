"""Delaunay flips of triangles known by their edge lengths.

Half-edge ``3 f + c`` is the side of face f opposite its corner c, and that corner has the same number.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.triangles import area, next_half_edge, previous_half_edge
from cython.cimports.libc.math import sqrt


def _move(ring, old, new):
    """Let another half-edge take the place of one that stands among those of an edge of more than two faces."""
    h: cython.int = old
    while ring[h] != old:
        h = ring[h]
    ring[h] = new
    ring[new] = ring[old]
    ring[old] = old


def flip(edges, tolerance: cython.double, most: cython.longlong, records: cython.bint = False):
    """Flip edges of a `HalfEdges` in place until it is intrinsic Delaunay (Fisher et al. 2007).

    All glued faces must run along their edge in opposite directions. An edge is flipped if the cotangents opposite
    it sum to less than `-tolerance`, and by more than their rounding. Returns the moves, as `Flips.moves` does.
    """
    flips = Flips(edges.vertex, edges.twin, edges.ring, edges.length, tolerance, records)
    twin: cython.int[::1] = edges.twin
    n_flips: cython.longlong = 0
    with cython.nogil:
        for f in range(twin.shape[0] // 3):
            flips.measure(f)
        for first in range(twin.shape[0]):
            # Without a branch for each test: which half-edge of an edge comes first is as good as random.
            beyond: cython.int = max(first, twin[first])
            if (twin[first] < first) | (flips.is_obtuse[first] == 0) & (flips.is_obtuse[beyond] == 0):
                continue
            flips.waiting[0], flips.is_waiting[first] = first, True
            flips.n_waiting = 1
            h: cython.int = flips.next()
            while h >= 0 and n_flips < most:
                flips.flip(h)
                n_flips += 1
                h = flips.next()
    return flips.moves()


@cython.final
@cython.cclass
class Flips:
    """A triangulation of which edges are being flipped, and the edges that wait to be looked at again."""

    def __init__(self, vertex, twin, ring, length, tolerance, records):
        """Work on these arrays, as `HalfEdges` has them; faces are to be measured first."""
        size = len(twin)
        self.vertex, self.twin, self.ring, self.length, self.tolerance = vertex, twin, ring, length, tolerance
        self.area, self.is_obtuse = np.empty(size // 3), np.empty(size, np.uint8)
        self.waiting, self.is_waiting, self.n_waiting = np.empty(size, np.int32), np.zeros(size, np.uint8), 0
        self.records, self.n_moves = records, 0
        room = 64 if records else 0
        self.kind, self.numbers = np.empty((room, 3), np.int64), np.zeros((room, 5))

    def moves(self):
        """The moves (k, 3) and their numbers (k, 5), as `Moved` has them; none if they are not recorded."""
        return np.array(self.kind[: self.n_moves]), np.array(self.numbers[: self.n_moves])

    def measure(self, f):
        """The area of a face, and which angles are obtuse: the terms are those of `improves`."""
        h: cython.int = 3 * f
        self.area[f] = 2.0 * area(self.length[h], self.length[h + 1], self.length[h + 2])
        a: cython.double = self.length[h] * self.length[h]
        b: cython.double = self.length[h + 1] * self.length[h + 1]
        c: cython.double = self.length[h + 2] * self.length[h + 2]
        self.is_obtuse[h] = b + c < a
        self.is_obtuse[h + 1] = c + a < b
        self.is_obtuse[h + 2] = a + b < c

    def wait(self, h):
        """Let the edge of half-edge h wait, unless it does already or has one face."""
        if self.twin[h] > h:
            h = self.twin[h]
        if self.twin[h] >= 0 and not self.is_waiting[h]:
            self.is_waiting[h] = True
            self.waiting[self.n_waiting] = h
            self.n_waiting += 1

    def next(self):
        """The next waiting half-edge whose edge is to be flipped; -1 if there is none."""
        while self.n_waiting > 0:
            self.n_waiting -= 1
            h: cython.int = self.waiting[self.n_waiting]
            self.is_waiting[h] = False
            if self.improves(h):
                return h
        return -1

    def improves(self, h):
        """Whether the edge of half-edge h is to be flipped; keeps the length of the new one."""
        t: cython.int = self.twin[h]
        if t < 0:
            return False
        f: cython.int = h // 3
        g: cython.int = t // 3
        if f == g:
            return False
        ab: cython.double = self.length[h]
        bp: cython.double = self.length[next_half_edge(h)]
        pa: cython.double = self.length[previous_half_edge(h)]
        aq: cython.double = self.length[next_half_edge(t)]
        qb: cython.double = self.length[previous_half_edge(t)]
        p: cython.double = bp * bp + pa * pa
        q: cython.double = aq * aq + qb * qb
        # The cotangents, both multiplied by twice the areas.
        x: cython.double = (p - ab * ab) * self.area[g] + (q - ab * ab) * self.area[f]
        if x >= 0.0:
            return False
        y: cython.double = 1e-12 * ((p + ab * ab) * self.area[g] + (q + ab * ab) * self.area[f])
        if x >= -y - 2.0 * self.tolerance * self.area[f] * self.area[g]:
            return False
        x = 0.5 * ((pa - bp) * (pa + bp) - (aq - qb) * (aq + qb)) / ab
        y = (self.area[f] + self.area[g]) / ab
        self.diagonal = sqrt(x * x + y * y)
        return area(pa, aq, self.diagonal) > 0.0 and area(qb, bp, self.diagonal) > 0.0

    def flip(self, h):
        """Flip the edge of half-edge h, and let the four edges around it wait."""
        t: cython.int = self.twin[h]
        after_h: cython.int = next_half_edge(h)
        after_t: cython.int = next_half_edge(t)
        if self.records:
            i: cython.int = self.append_move(FLIP, h, t)
            self.numbers[i, 0] = self.length[h]
            self.numbers[i, 1], self.numbers[i, 2] = self.length[previous_half_edge(h)], self.length[after_h]
            self.numbers[i, 3], self.numbers[i, 4] = self.length[after_t], self.length[previous_half_edge(t)]
        # f = (p, a, b) and g = (q, b, a) become f = (p, a, q) and g = (q, b, p), in the same places.
        self.vertex[previous_half_edge(h)] = self.vertex[t]
        self.vertex[previous_half_edge(t)] = self.vertex[h]
        # aq moves to the place of h, bp to that of t; each may be glued to the other.
        of_aq: cython.int = t if self.twin[after_t] == after_h else self.twin[after_t]
        of_bp: cython.int = h if self.twin[after_h] == after_t else self.twin[after_h]
        self.length[h], self.length[t] = self.length[after_t], self.length[after_h]
        self.length[after_h] = self.length[after_t] = self.diagonal
        self.twin[after_h], self.twin[after_t] = after_t, after_h
        self.glue(after_t, h, of_aq)
        self.glue(after_h, t, of_bp)
        self.measure(h // 3)
        self.measure(t // 3)
        self.wait(h)
        self.wait(previous_half_edge(h))
        self.wait(t)
        self.wait(previous_half_edge(t))
        return 0

    def glue(self, old, new, twin):
        """Give half-edge `new` what half-edge `old` was glued to."""
        self.twin[new] = twin
        if twin >= 0:
            self.twin[twin] = new
        elif twin == -2:
            _move(self.ring, old, new)

    def append_move(self, kind, h, mate):
        """Append a move and return the row of it; the caller fills in the numbers."""
        if self.n_moves == self.kind.shape[0]:
            with cython.gil:  # twice the room
                self.kind = np.concatenate([self.kind, self.kind])
                self.numbers = np.concatenate([self.numbers, np.zeros_like(self.numbers)])
        i: cython.int = self.n_moves
        self.kind[i, 0], self.kind[i, 1], self.kind[i, 2] = kind, h, mate
        self.n_moves += 1
        return i
