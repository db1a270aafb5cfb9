"""Delaunay flips of triangles known by their edge lengths, without a history.

Half-edge ``3 f + c`` is the side of face f opposite its corner c, and that corner has the same number.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge, twice_area
from cython.cimports.libc.math import sqrt


def _move(ring: cython.int[::1], old: cython.int, new: cython.int) -> cython.void:
    """Let another half-edge take the place of one that stands among those of an edge of more than two faces."""
    h: cython.int = old
    while ring[h] != old:
        h = ring[h]
    ring[h] = new
    ring[new] = ring[old]
    ring[old] = old


def flip(edges, tolerance: cython.double, most: cython.longlong) -> int:
    """Flip edges of a `HalfEdges` in place until it is intrinsic Delaunay (Fisher et al. 2007); how many were flipped.

    All glued faces must run along their edge in opposite directions. An edge is flipped if the cotangents opposite
    it sum to less than `-tolerance`, and by more than their rounding.
    """
    flips = _Flips()
    flips.vertex, flips.twin, flips.ring, flips.length = edges.vertex, edges.twin, edges.ring, edges.length
    twin: cython.int[::1] = edges.twin
    length: cython.double[::1] = edges.length
    flips.area = np.empty(twin.shape[0] // 3)
    flips.waiting, flips.is_waiting = np.empty(twin.shape[0], np.int32), np.zeros(twin.shape[0], np.uint8)
    flips.is_obtuse = np.empty(twin.shape[0], np.uint8)
    n_flips: cython.longlong = 0
    f: cython.int
    first: cython.int
    with cython.nogil:
        for f in range(twin.shape[0] // 3):
            flips.area[f] = twice_area(length[3 * f], length[3 * f + 1], length[3 * f + 2])
            flips.compare(3 * f)
        for first in range(twin.shape[0]):
            # Without a branch for each test: which half-edge of an edge comes first is as good as random.
            beyond: cython.int = max(first, twin[first])
            if (twin[first] < first) | (flips.is_obtuse[first] == 0) & (flips.is_obtuse[beyond] == 0):
                continue
            flips.waiting[0], flips.is_waiting[first] = first, True
            flips.n_waiting = 1
            while flips.n_waiting > 0:
                flips.n_waiting -= 1
                h: cython.int = flips.waiting[flips.n_waiting]
                flips.is_waiting[h] = False
                if n_flips < most and flips.improves(h, tolerance):
                    flips.flip(h)
                    n_flips += 1
    return n_flips


@cython.final
@cython.cclass
class _Flips:
    """A triangulation of which edges are being flipped, and the edges that wait to be looked at again."""

    def compare(self, h: cython.int) -> cython.void:
        """Which angles of a face are obtuse, that begins with half-edge h: the terms are those of `improves`."""
        a: cython.double = self.length[h] * self.length[h]
        b: cython.double = self.length[h + 1] * self.length[h + 1]
        c: cython.double = self.length[h + 2] * self.length[h + 2]
        self.is_obtuse[h] = b + c < a
        self.is_obtuse[h + 1] = c + a < b
        self.is_obtuse[h + 2] = a + b < c

    def wait(self, h: cython.int) -> cython.void:
        """Let the edge of half-edge h wait, unless it does already or has one face."""
        if self.twin[h] > h:
            h = self.twin[h]
        if self.twin[h] >= 0 and not self.is_waiting[h]:
            self.is_waiting[h] = True
            self.waiting[self.n_waiting] = h
            self.n_waiting += 1

    def improves(self, h: cython.int, tolerance: cython.double) -> cython.bint:
        """Whether the edge of half-edge h is to be flipped; keeps the measures of the new faces."""
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
        if x >= -y - 2.0 * tolerance * self.area[f] * self.area[g]:
            return False
        x = 0.5 * ((pa - bp) * (pa + bp) - (aq - qb) * (aq + qb)) / ab
        y = (self.area[f] + self.area[g]) / ab
        self.diagonal = sqrt(x * x + y * y)
        self.area_of_f = twice_area(pa, aq, self.diagonal)
        self.area_of_g = twice_area(qb, bp, self.diagonal)
        return self.area_of_f > 0.0 and self.area_of_g > 0.0

    def flip(self, h: cython.int) -> cython.void:
        """Flip the edge of half-edge h, and let the four edges around it wait."""
        t: cython.int = self.twin[h]
        after_h: cython.int = next_half_edge(h)
        after_t: cython.int = next_half_edge(t)
        # f = (p, a, b) and g = (q, b, a) become f = (p, a, q) and g = (q, b, p), in the same places.
        self.vertex[previous_half_edge(h)] = self.vertex[t]
        self.vertex[previous_half_edge(t)] = self.vertex[h]
        self.area[h // 3], self.area[t // 3] = self.area_of_f, self.area_of_g
        # aq moves to the place of h, bp to that of t; each may be glued to the other.
        of_aq: cython.int = t if self.twin[after_t] == after_h else self.twin[after_t]
        of_bp: cython.int = h if self.twin[after_h] == after_t else self.twin[after_h]
        self.length[h], self.length[t] = self.length[after_t], self.length[after_h]
        self.length[after_h] = self.length[after_t] = self.diagonal
        self.twin[after_h], self.twin[after_t] = after_t, after_h
        self.glue(after_t, h, of_aq)
        self.glue(after_h, t, of_bp)
        self.compare(h - h % 3)
        self.compare(t - t % 3)
        self.wait(h)
        self.wait(previous_half_edge(h))
        self.wait(t)
        self.wait(previous_half_edge(t))

    def glue(self, old: cython.int, new: cython.int, twin: cython.int) -> cython.void:
        """Give half-edge `new` what half-edge `old` was glued to."""
        self.twin[new] = twin
        if twin >= 0:
            self.twin[twin] = new
        elif twin == -2:
            _move(self.ring, old, new)
