"""Triangles by their edge lengths, made from positions: gluing, Delaunay flips without a history, numbering by a front.

Half-edge ``3 f + c`` is the side of face f opposite its corner c, and that corner has the same number. This is for a
mesh that is asked once; `heat_igl.intrinsic` does the same with numpy, and keeps the history of its flips.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.triangles import next_half_edge, previous_half_edge
from cython.cimports.libc.math import sqrt

__all__ = ["breadth_first", "flip", "glue"]


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
    vertices, twins, rings = np.empty((3, 3 * m), np.int32)
    alignment, lengths = np.ones(3 * m, np.uint8), np.empty(3 * m)
    vertex: cython.int[::1] = vertices
    twin: cython.int[::1] = twins
    ring: cython.int[::1] = rings
    aligned: cython.uchar[::1] = alignment
    length: cython.double[::1] = lengths
    begin: cython.int[::1] = np.zeros(n + 1, np.int32)
    by_lower: cython.int[::1] = np.empty(3 * m, np.int32)
    seen: cython.int[::1] = np.empty(n, np.int32)
    seen_from: cython.int[::1] = np.full(n, -1, np.int32)
    f: cython.int
    c: cython.int
    h: cython.int
    p: cython.int
    q: cython.int
    i: cython.int
    tail: cython.int
    head: cython.int
    lower: cython.int
    upper: cython.int
    n_across: cython.int = 0
    x: cython.double
    y: cython.double
    z: cython.double
    with cython.nogil:
        for f in range(m):
            for c in range(3):
                vertex[3 * f + c] = F[f, c]
        for h in range(3 * m):
            tail, head = vertex[next_half_edge(h)], vertex[previous_half_edge(h)]
            begin[(tail if tail < head else head) + 1] += 1
        for i in range(n):
            begin[i + 1] += begin[i]
        for h in range(3 * m):
            tail, head = vertex[next_half_edge(h)], vertex[previous_half_edge(h)]
            lower = tail if tail < head else head
            by_lower[begin[lower]] = h
            begin[lower] += 1
        # Now begin[v] is where the half-edges whose lower vertex is v end.
        i = 0
        for lower in range(n):
            while i < begin[lower]:
                h = by_lower[i]
                i += 1
                tail, head = vertex[next_half_edge(h)], vertex[previous_half_edge(h)]
                upper = head if tail == lower else tail
                ring[h] = h
                if seen_from[upper] != lower:
                    seen_from[upper] = lower
                    seen[upper] = h
                    twin[h] = -1
                    x = V[tail, 0] - V[head, 0]
                    y = V[tail, 1] - V[head, 1]
                    z = V[tail, 2] - V[head, 2]
                    x, y, z = scale * x, scale * y, scale * z
                    length[h] = sqrt(x * x + y * y + z * z)
                    continue
                p = seen[upper]
                length[h] = length[p]
                if twin[p] == -1:
                    twin[p], twin[h] = h, p
                    if vertex[next_half_edge(p)] == tail:
                        aligned[p] = aligned[h] = False
                        n_across += 2
                    continue
                if twin[p] >= 0:
                    q = twin[p]
                    n_across -= 0 if aligned[p] else 2
                    aligned[p] = aligned[q] = True
                    twin[p] = twin[q] = -2
                    ring[p], ring[q] = q, p
                twin[h] = -2
                ring[h] = ring[p]
                ring[p] = h
    return vertices, twins, rings, alignment, lengths, n_across


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


def flip(
    vertex: cython.int[::1],
    twin: cython.int[::1],
    ring: cython.int[::1],
    length: cython.double[::1],
    tolerance: cython.double,
    most: cython.longlong,
) -> int:
    """Flip edges in place until the triangulation is intrinsic Delaunay (Fisher et al. 2007); how many were flipped.

    All glued faces must run along their edge in opposite directions. An edge is flipped where the cotangents opposite
    it sum to less than `-tolerance`, and by more than their rounding.
    """
    m: cython.int = twin.shape[0] // 3
    area: cython.double[::1] = np.empty(m)
    waiting: cython.int[::1] = np.empty(3 * m, np.int32)
    is_waiting: cython.uchar[::1] = np.zeros(3 * m, np.uint8)
    n_waiting: cython.int = 0
    n_flips: cython.longlong = 0
    f: cython.int
    g: cython.int
    h: cython.int
    t: cython.int
    k: cython.int
    i: cython.int
    first: cython.int
    ab: cython.double
    bp: cython.double
    pa: cython.double
    aq: cython.double
    qb: cython.double
    pq: cython.double
    p: cython.double
    q: cython.double
    x: cython.double
    y: cython.double
    around: cython.int[4]
    with cython.nogil:
        for f in range(m):
            area[f] = _double_area(length[3 * f], length[3 * f + 1], length[3 * f + 2])
        for first in range(3 * m):
            if twin[first] < first:
                continue
            waiting[0] = first
            n_waiting = 1
            is_waiting[first] = True
            while n_waiting > 0:
                n_waiting -= 1
                h = waiting[n_waiting]
                is_waiting[h] = False
                t = twin[h]
                if t < 0:
                    continue
                f, g = h // 3, t // 3
                if f == g:
                    continue
                ab, bp, pa = length[h], length[next_half_edge(h)], length[previous_half_edge(h)]
                aq, qb = length[next_half_edge(t)], length[previous_half_edge(t)]
                p, q = bp * bp + pa * pa, aq * aq + qb * qb
                # The cotangents, both multiplied by twice the areas.
                x = (p - ab * ab) * area[g] + (q - ab * ab) * area[f]
                if x >= 0.0 or n_flips >= most:
                    continue
                y = 1e-12 * ((p + ab * ab) * area[g] + (q + ab * ab) * area[f])
                if x >= -y - 2.0 * tolerance * area[f] * area[g]:
                    continue
                # f = (p, a, b) and g = (q, b, a) become f = (p, a, q) and g = (q, b, p), in the same places.
                x = 0.5 * ((pa - bp) * (pa + bp) - (aq - qb) * (aq + qb)) / ab
                y = (area[f] + area[g]) / ab
                pq = sqrt(x * x + y * y)
                x, y = _double_area(pa, aq, pq), _double_area(qb, bp, pq)
                if x <= 0.0 or y <= 0.0:
                    continue
                n_flips += 1
                area[f], area[g] = x, y
                vertex[previous_half_edge(h)] = vertex[t]
                vertex[previous_half_edge(t)] = vertex[h]
                k, i = twin[next_half_edge(t)], twin[next_half_edge(h)]
                # aq moves to the place of h, bp to that of t; each may be glued to the other.
                if k == next_half_edge(h):
                    k = t
                if i == next_half_edge(t):
                    i = h
                length[h], length[t] = aq, bp
                length[next_half_edge(h)] = length[next_half_edge(t)] = pq
                twin[next_half_edge(h)], twin[next_half_edge(t)] = next_half_edge(t), next_half_edge(h)
                twin[h] = k
                if k >= 0:
                    twin[k] = h
                elif k == -2:
                    _move(ring, next_half_edge(t), h)
                twin[t] = i
                if i >= 0:
                    twin[i] = t
                elif i == -2:
                    _move(ring, next_half_edge(h), t)
                around[0], around[1], around[2], around[3] = h, previous_half_edge(h), t, previous_half_edge(t)
                for i in range(4):
                    k = around[i]
                    if twin[k] > k:
                        k = twin[k]
                    if twin[k] >= 0 and not is_waiting[k]:
                        is_waiting[k] = True
                        waiting[n_waiting] = k
                        n_waiting += 1
    return n_flips


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
    vertices, twins, rings = np.empty((3, 3 * m), np.int32)
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
    first: cython.int
    c: cython.int
    f: cython.int
    i: cython.int
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
                    if t >= 0 and place[t // 3] < 0:
                        place[t // 3] = n_met
                        face[n_met] = t // 3
                        n_met += 1
                n_done += 1
        for v in range(n):
            if number[v] < 0:
                number[v] = n_numbered
                n_numbered += 1
        for i in range(m):
            for c in range(3):
                h = 3 * face[i] + c
                t = twin[h]
                new_twin[3 * i + c] = 3 * place[t // 3] + t % 3 if t >= 0 else t
                t = ring[h]
                new_ring[3 * i + c] = 3 * place[t // 3] + t % 3
    return vertices, twins, rings, alignment, lengths, numbers, faces
