"""Triangles by their edge lengths, made from positions: gluing, Delaunay flips without a history, numbering by a front.

Half-edge ``3 f + c`` is the side of face f opposite its corner c, and that corner has the same number. This is for a
mesh that is asked once; `heat_igl.intrinsic` does the same with numpy, and keeps the history of its flips.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.triangles import next_half_edge, previous_half_edge
from cython.cimports.libc.math import INFINITY, sqrt

__all__ = ["breadth_first", "flip", "glue", "has_needles", "n_near"]


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _double_area(a: cython.double, b: cython.double, c: cython.double) -> cython.double:
    """Twice the area by the sides: Heron's formula as a product of differences, which needles need."""
    s: cython.double = 0.5 * (a + b + c)
    product: cython.double = s * (s - a) * (s - b) * (s - c)
    return 2.0 * sqrt(product) if product > 0.0 else 0.0


def glue(F: cython.const[cython.longlong][:, ::1], V: cython.const[cython.double][:, ::1], scale: cython.double):
    """Glue faces along the edges that they share.

    Parameters
    ----------
    F : (m, 3) int64
        Vertices of each face, no face with the same vertex twice.
    V : (n, 3) float64
        Positions.
    scale : float
        Lengths are multiplied by this.

    Returns
    -------
    vertex, twin, ring : (3 m,) int32
        Vertex of each corner. The half-edge glued to each: -1 on the boundary, -2 where more than two faces meet. There
        the next half-edge of the same edge, elsewhere the half-edge itself.
    aligned : (3 m,) uint8
        Whether the faces at a glued half-edge run along it in opposite directions.
    length : (3 m,) float64
        Of each half-edge, of glued ones the same.
    n_across : int
        Half-edges that are not aligned.
    """
    m: cython.int = F.shape[0]
    n: cython.int = V.shape[0]
    vertices, twins, rings = np.empty(3 * m, np.int32), np.empty(3 * m, np.int32), np.empty(3 * m, np.int32)
    alignment, lengths = np.ones(3 * m, np.uint8), np.empty(3 * m)
    vertex: cython.int[::1] = vertices
    twin: cython.int[::1] = twins
    ring: cython.int[::1] = rings
    aligned: cython.uchar[::1] = alignment
    length: cython.double[::1] = lengths
    h: cython.int
    sides: cython.int[:, ::1] = np.empty((3 * m, 2), np.int32)
    begin: cython.int[::1] = np.zeros(n + 1, np.int32)
    seen: cython.int[::1] = np.zeros(n, np.int32)
    n_across: cython.int = 0
    with cython.nogil:
        _by_lower_end(F, vertex, sides, begin)
        _glue_sides(V, scale, sides, begin, seen, vertex, twin, ring, aligned, length)
        n_across = 3 * m
        for h in range(3 * m):
            n_across -= aligned[h]
    return vertices, twins, rings, alignment, lengths, n_across


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _by_lower_end(
    F: cython.const[cython.longlong][:, ::1],
    vertex: cython.int[::1],
    sides: cython.int[:, ::1],
    begin: cython.int[::1],
) -> cython.void:
    """Copy the faces, and put their half-edges, each with the upper end, in the order of the lower end.

    `begin` (n + 1,), which must come full of 0, takes where the half-edges of each lower end begin, moved by one vertex:
    those of v end at ``begin[v]``.
    """
    f: cython.int
    i: cython.int
    at: cython.int
    a: cython.int
    b: cython.int
    c: cython.int
    for f in range(F.shape[0]):
        a, b, c = cython.cast(cython.int, F[f, 0]), cython.cast(cython.int, F[f, 1]), cython.cast(cython.int, F[f, 2])
        vertex[3 * f], vertex[3 * f + 1], vertex[3 * f + 2] = a, b, c
        begin[min(b, c) + 1] += 1
        begin[min(c, a) + 1] += 1
        begin[min(a, b) + 1] += 1
    for i in range(begin.shape[0] - 1):
        begin[i + 1] += begin[i]
    for f in range(F.shape[0]):
        a, b, c = vertex[3 * f], vertex[3 * f + 1], vertex[3 * f + 2]
        at = begin[min(b, c)]
        begin[min(b, c)] = at + 1
        sides[at, 0], sides[at, 1] = 3 * f, max(b, c)
        at = begin[min(c, a)]
        begin[min(c, a)] = at + 1
        sides[at, 0], sides[at, 1] = 3 * f + 1, max(c, a)
        at = begin[min(a, b)]
        begin[min(a, b)] = at + 1
        sides[at, 0], sides[at, 1] = 3 * f + 2, max(a, b)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _glue_sides(
    V: cython.const[cython.double][:, ::1],
    scale: cython.double,
    sides: cython.int[:, ::1],
    end: cython.int[::1],
    seen: cython.int[::1],
    vertex: cython.int[::1],
    twin: cython.int[::1],
    ring: cython.int[::1],
    aligned: cython.uchar[::1],
    length: cython.double[::1],
) -> cython.void:
    """Glue half-edges that have both ends in common, and measure them. `seen` (n,) is working space, full of 0."""
    lower: cython.int
    upper: cython.int
    first: cython.int
    i: cython.int = 0
    h: cython.int
    p: cython.int
    q: cython.int
    x: cython.double
    y: cython.double
    z: cython.double
    for lower in range(V.shape[0]):
        first = i
        while i < end[lower]:
            h, upper = sides[i, 0], sides[i, 1]
            p = seen[upper]
            if not (first <= p < i and sides[p, 1] == upper):
                # The first half-edge of this edge.
                seen[upper] = i
                i += 1
                x, y, z = V[upper, 0] - V[lower, 0], V[upper, 1] - V[lower, 1], V[upper, 2] - V[lower, 2]
                x, y, z = scale * x, scale * y, scale * z
                length[h] = sqrt(x * x + y * y + z * z)
                twin[h], ring[h] = -1, h
                continue
            i += 1
            p = sides[p, 0]
            length[h] = length[p]
            ring[h] = h
            if twin[p] == -1:
                twin[p], twin[h] = h, p
                if vertex[next_half_edge(p)] == vertex[next_half_edge(h)]:
                    aligned[p] = aligned[h] = False
                continue
            if twin[p] >= 0:
                q = twin[p]
                aligned[p] = aligned[q] = True
                twin[p] = twin[q] = -2
                ring[p], ring[q] = q, p
            twin[h] = -2
            ring[h] = ring[p]
            ring[p] = h


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _move(ring: cython.int[::1], old: cython.int, new: cython.int) -> cython.void:
    """Let another half-edge take the place of one that stands among those of an edge of more than two faces."""
    h: cython.int = old
    while ring[h] != old:
        h = ring[h]
    ring[h] = new
    ring[new] = ring[old]
    ring[old] = old


def n_near(twin: cython.int[::1], reach: cython.int) -> int:
    """How many half-edges (3 m,) are glued to one whose number differs from theirs by less than `reach`."""
    h: cython.int
    n: cython.int = 0
    with cython.nogil:
        for h in range(twin.shape[0]):
            n += (twin[h] >= 0) & (-reach < twin[h] - h) & (twin[h] - h < reach)
    return n


def has_needles(length: cython.double[::1], margin: cython.double) -> bool:
    """Whether in some face two sides (3 m,) exceed the third by less than `margin` times the longest side of all."""
    h: cython.Py_ssize_t
    total: cython.double
    longest: cython.double
    least: cython.double = INFINITY
    longest_of_all: cython.double = 0.0
    with cython.nogil:
        for h in range(0, length.shape[0], 3):
            total = length[h] + length[h + 1] + length[h + 2]
            longest = max(max(length[h], length[h + 1]), length[h + 2])
            longest_of_all = max(longest_of_all, longest)
            least = min(least, total - 2.0 * longest)
    return least < margin * longest_of_all


def flip(
    vertex: cython.int[::1],
    twin: cython.int[::1],
    ring: cython.int[::1],
    length: cython.double[::1],
    tolerance: cython.double,
    most: cython.longlong,
) -> int:
    """Flip edges in place until the triangulation is intrinsic Delaunay (Fisher et al. 2007); how many were flipped.

    All glued faces must run along their edge in opposite directions. An edge is flipped if the cotangents opposite
    it sum to less than `-tolerance`, and by more than their rounding.
    """
    flips = _Flips()
    flips.vertex, flips.twin, flips.ring, flips.length = vertex, twin, ring, length
    flips.area = np.empty(twin.shape[0] // 3)
    flips.waiting, flips.is_waiting = np.empty(twin.shape[0], np.int32), np.zeros(twin.shape[0], np.uint8)
    flips.is_obtuse = np.empty(twin.shape[0], np.uint8)
    n_flips: cython.longlong = 0
    f: cython.int
    h: cython.int
    first: cython.int
    beyond: cython.int
    with cython.nogil:
        for f in range(twin.shape[0] // 3):
            flips.area[f] = _double_area(length[3 * f], length[3 * f + 1], length[3 * f + 2])
            flips.compare(3 * f)
        for first in range(twin.shape[0]):
            # Without a branch for each test: which half-edge of an edge comes first is as good as random.
            beyond = max(first, twin[first])
            if (twin[first] < first) | (flips.is_obtuse[first] == 0) & (flips.is_obtuse[beyond] == 0):
                continue
            flips.waiting[0], flips.is_waiting[first] = first, True
            flips.n_waiting = 1
            while flips.n_waiting > 0:
                flips.n_waiting -= 1
                h = flips.waiting[flips.n_waiting]
                flips.is_waiting[h] = False
                if n_flips < most and flips.improves(h, tolerance):
                    flips.flip(h)
                    n_flips += 1
    return n_flips


@cython.final
@cython.cclass
class _Flips:
    """A triangulation of which edges are being flipped, and the edges that wait to be looked at again."""

    vertex: cython.int[::1]
    twin: cython.int[::1]
    ring: cython.int[::1]
    length: cython.double[::1]
    area: cython.double[::1]  # twice that of each face
    is_obtuse: cython.uchar[::1]  # the angle opposite each half-edge; between two that are not, no edge is flipped
    waiting: cython.int[::1]
    is_waiting: cython.uchar[::1]
    n_waiting: cython.int
    # Of the flip that was found to improve: the new edge, and twice the areas of both new faces.
    diagonal: cython.double
    area_of_f: cython.double
    area_of_g: cython.double

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def compare(self, h: cython.int) -> cython.void:
        """Which angles of a face are obtuse, that begins with half-edge h: the terms are those of `improves`."""
        a: cython.double = self.length[h] * self.length[h]
        b: cython.double = self.length[h + 1] * self.length[h + 1]
        c: cython.double = self.length[h + 2] * self.length[h + 2]
        self.is_obtuse[h] = b + c < a
        self.is_obtuse[h + 1] = c + a < b
        self.is_obtuse[h + 2] = a + b < c

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def wait(self, h: cython.int) -> cython.void:
        """Let the edge of half-edge h wait, unless it does already or has one face."""
        if self.twin[h] > h:
            h = self.twin[h]
        if self.twin[h] >= 0 and not self.is_waiting[h]:
            self.is_waiting[h] = True
            self.waiting[self.n_waiting] = h
            self.n_waiting += 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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
        self.area_of_f = _double_area(pa, aq, self.diagonal)
        self.area_of_g = _double_area(qb, bp, self.diagonal)
        return self.area_of_f > 0.0 and self.area_of_g > 0.0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def glue(self, old: cython.int, new: cython.int, twin: cython.int) -> cython.void:
        """Give half-edge `new` what half-edge `old` was glued to."""
        self.twin[new] = twin
        if twin >= 0:
            self.twin[twin] = new
        elif twin == -2:
            _move(self.ring, old, new)


def breadth_first(
    vertex: cython.int[::1],
    twin: cython.int[::1],
    ring: cython.int[::1],
    aligned: cython.uchar[::1],
    length: cython.double[::1],
    n: cython.int,
    start: cython.int,
):
    """Number vertices and faces in the order in which a front over the faces meets them, from face `start` on.

    What a front touches together then lies together in memory.

    Returns
    -------
    vertex, twin, ring, aligned, length
        By the new numbers.
    number : (n,) int32
        New number of each vertex.
    face : (m,) int32
        Old number of each face; corners stay in place.
    """
    m: cython.int = twin.shape[0] // 3
    # Each on its own, so that what is not needed any more can be let go of.
    vertices, twins, rings = np.empty(3 * m, np.int32), np.empty(3 * m, np.int32), np.empty(3 * m, np.int32)
    alignment, lengths = np.empty(3 * m, np.uint8), np.empty(3 * m)
    numbers, faces = np.full(n, -1, np.int32), np.empty(m, np.int32)
    new_vertex: cython.int[::1] = vertices
    new_twin: cython.int[::1] = twins
    new_ring: cython.int[::1] = rings
    new_aligned: cython.uchar[::1] = alignment
    new_length: cython.double[::1] = lengths
    number: cython.int[::1] = numbers
    face: cython.int[::1] = faces
    place: cython.int[::1] = np.full(m, -1, np.int32)
    n_met: cython.int = 0
    n_done: cython.int = 0
    n_numbered: cython.int = 0
    has_many: cython.bint = False
    first: cython.int
    c: cython.int
    f: cython.int
    h: cython.int
    t: cython.int
    v: cython.int
    with cython.nogil:
        for first in range(-1, m):
            f = start if first < 0 else first
            if place[f] >= 0:
                continue
            place[f] = n_met
            face[n_met] = f
            n_met += 1
            while n_done < n_met:
                h = 3 * face[n_done]
                for c in range(3):
                    v = vertex[h + c]
                    if number[v] < 0:
                        number[v] = n_numbered
                        n_numbered += 1
                    new_vertex[3 * n_done + c] = number[v]
                    new_length[3 * n_done + c] = length[h + c]
                    new_aligned[3 * n_done + c] = aligned[h + c]
                    t = twin[h + c]
                    if t >= 0:
                        f = t // 3
                        if place[f] < 0:
                            place[f] = n_met
                            face[n_met] = f
                            n_met += 1
                        t = 3 * place[f] + t % 3
                    has_many |= t == -2
                    new_twin[3 * n_done + c] = t
                    new_ring[3 * n_done + c] = 3 * n_done + c
                n_done += 1
        for v in range(n):
            if number[v] < 0:
                number[v] = n_numbered
                n_numbered += 1
        if has_many:
            for h in range(3 * m):
                t = ring[3 * face[h // 3] + h % 3]
                new_ring[h] = 3 * place[t // 3] + t % 3
    return vertices, twins, rings, alignment, lengths, numbers, faces
