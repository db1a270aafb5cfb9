"""Triangles by their edge lengths, made from positions: glued along the edges that they share, and numbered.

Half-edge ``3 f + c`` is the side of face f opposite its corner c, and that corner has the same number.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge
from cython.cimports.libc.math import INFINITY, sqrt


def glue(F: cython.const[cython.longlong][:, ::1], V: cython.const[cython.double][:, ::1], scale: cython.double):
    """The fields of `heat_igl.intrinsic.HalfEdges` of faces F (m, 3), glued along the edges that they share.

    No face has the same vertex twice. Lengths are those between positions V (n, 3), times `scale`.
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
    sides: cython.int[:, ::1] = np.empty((3 * m, 2), np.int32)
    begin: cython.int[::1] = np.zeros(n + 1, np.int32)
    seen: cython.int[::1] = np.zeros(n, np.int32)
    upper: cython.int
    i: cython.int = 0
    h: cython.int
    with cython.nogil:
        # Half-edges sorted by the lower end, each with the upper one; in the end, ``begin[v]`` is where those of v end.
        for f in range(m):
            vertex[3 * f], vertex[3 * f + 1], vertex[3 * f + 2] = F[f, 0], F[f, 1], F[f, 2]
            a, b, c = vertex[3 * f], vertex[3 * f + 1], vertex[3 * f + 2]
            begin[min(b, c) + 1] += 1
            begin[min(c, a) + 1] += 1
            begin[min(a, b) + 1] += 1
        for v in range(n):
            begin[v + 1] += begin[v]
        for f in range(m):
            a, b, c = vertex[3 * f], vertex[3 * f + 1], vertex[3 * f + 2]
            at: cython.int = begin[min(b, c)]
            begin[min(b, c)] = at + 1
            sides[at, 0], sides[at, 1] = 3 * f, max(b, c)
            at = begin[min(c, a)]
            begin[min(c, a)] = at + 1
            sides[at, 0], sides[at, 1] = 3 * f + 1, max(c, a)
            at = begin[min(a, b)]
            begin[min(a, b)] = at + 1
            sides[at, 0], sides[at, 1] = 3 * f + 2, max(a, b)
        # Those that have both ends in common are glued.
        for lower in range(n):
            first: cython.int = i
            while i < begin[lower]:
                h, upper = sides[i, 0], sides[i, 1]
                p: cython.int = seen[upper]
                if not (first <= p < i and sides[p, 1] == upper):
                    # The first half-edge of this edge.
                    seen[upper] = i
                    i += 1
                    x: cython.double = scale * (V[upper, 0] - V[lower, 0])
                    y: cython.double = scale * (V[upper, 1] - V[lower, 1])
                    z: cython.double = scale * (V[upper, 2] - V[lower, 2])
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
                    q: cython.int = twin[p]
                    aligned[p] = aligned[q] = True
                    twin[p] = twin[q] = -2
                    ring[p], ring[q] = q, p
                twin[h] = -2
                ring[h] = ring[p]
                ring[p] = h
    return vertices, twins, rings, alignment, lengths


def has_needles(length: cython.const[cython.double][::1], margin: cython.double) -> bool:
    """Whether in some face two sides (3 m,) exceed the third by less than `margin` times the longest side of all."""
    least: cython.double = INFINITY
    longest_of_all: cython.double = 0.0
    with cython.nogil:
        for h in range(0, length.shape[0], 3):
            total: cython.double = length[h] + length[h + 1] + length[h + 2]
            longest: cython.double = max(max(length[h], length[h + 1]), length[h + 2])
            longest_of_all = max(longest_of_all, longest)
            least = min(least, total - 2.0 * longest)
    return least < margin * longest_of_all


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
    vertex: cython.const[cython.int][::1] = edges.vertex
    twin: cython.const[cython.int][::1] = edges.twin
    ring: cython.const[cython.int][::1] = edges.ring
    aligned: cython.const[cython.uchar][::1] = edges.aligned
    length: cython.const[cython.double][::1] = edges.length
    new_vertex: cython.int[::1] = vertices
    new_twin: cython.int[::1] = twins
    new_ring: cython.int[::1] = rings
    new_aligned: cython.uchar[::1] = alignment
    new_length: cython.double[::1] = lengths
    number: cython.int[::1] = numbers
    face: cython.int[::1] = faces
    place: cython.int[::1] = np.full(m, -1, np.int32)  # new number of each face
    n_met: cython.int = 0
    n_done: cython.int = 0
    n_numbered: cython.int = 0
    has_many: cython.bint = False  # whether more than two faces meet at an edge
    with cython.nogil:
        for first in range(-1, m):
            f: cython.int = first if first >= 0 else start
            n_met = _meet(f, place, face, n_met)
            while n_done < n_met:
                h: cython.int = 3 * face[n_done]
                g: cython.int = 3 * n_done
                for c in range(3):
                    v: cython.int = vertex[h + c]
                    if number[v] < 0:
                        number[v] = n_numbered
                        n_numbered += 1
                    new_vertex[g + c], new_length[g + c], new_aligned[g + c] = number[v], length[h + c], aligned[h + c]
                    t: cython.int = twin[h + c]
                    if t >= 0:
                        n_met = _meet(t // 3, place, face, n_met)
                        t = 3 * place[t // 3] + t % 3
                    has_many |= t == -2
                    new_twin[g + c] = t
                n_done += 1
        for v in range(n):
            if number[v] < 0:
                number[v] = n_numbered
                n_numbered += 1
        for h in range(3 * m):
            new_ring[h] = h
            if has_many:
                t = ring[3 * face[h // 3] + h % 3]
                new_ring[h] = 3 * place[t // 3] + t % 3
    return vertices, twins, rings, alignment, lengths, numbers, faces


@cython.cfunc
@cython.nogil
def _meet(f: cython.int, place: cython.int[::1], face: cython.int[::1], n_met: cython.int) -> cython.int:
    """Number face f unless it has a number; returns how many have one."""
    if place[f] < 0:
        place[f], face[n_met] = n_met, f
        n_met += 1
    return n_met
