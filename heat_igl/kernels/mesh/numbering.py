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
@cython.inline
@cython.nogil
def _meet(f: cython.int, place: cython.int[::1], face: cython.int[::1], n_met: cython.int) -> cython.int:
    """Number face f unless it has a number; returns how many have one."""
    if place[f] < 0:
        place[f], face[n_met] = n_met, f
        n_met += 1
    return n_met
