"""Tables of spokes for sweeps over a triangulation."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.signals import is_interrupted
from cython.cimports.libc.math import M_PI, NAN, atan2, fabs, sqrt

from heat_igl.kernels.signals import raise_caught

_CORNER = np.dtype([("x", "f8"), ("y", "f8"), ("cosine", "f8"), ("sine", "f8")])


def first_spokes(edges, n: cython.int):
    """First spoke (n + 1,) int32 of each vertex: one per corner, and one more at the end of an open fan."""
    vertex: cython.const[cython.int][::1] = edges.vertex
    twin: cython.const[cython.int][::1] = edges.twin
    array = np.zeros(n + 1, np.int32)
    first: cython.int[::1] = array
    with cython.nogil:
        # Twice as many: an open fan has two outer sides.
        for h in range(twin.shape[0]):
            first[vertex[h] + 1] += 2 + (twin[next_half_edge(h)] < 0) + (twin[previous_half_edge(h)] < 0)
        for v in range(n):
            first[v + 1] = first[v] + first[v + 1] // 2
    return array


def fill(edges, first: cython.const[cython.int][::1], spoke: Spoke[::1]):
    """Fill the spokes; returns the total angle (k,) of each fan, and whether each vertex (n,) is flat.

    A vertex is flat if the first fan of it has no curvature, or is open; or if it has none. Around a vertex, faces that
    run the other way than the first of the fan are seen turned over, so the surface needs no orientation.
    """
    vertex: cython.const[cython.int][::1] = edges.vertex
    twin: cython.const[cython.int][::1] = edges.twin
    aligned: cython.const[cython.uchar][::1] = edges.aligned
    length: cython.const[cython.double][::1] = edges.length
    total_array, flat_array = np.empty(twin.shape[0]), np.ones(first.shape[0] - 1, np.uint8)
    is_flat: cython.uchar[::1] = flat_array
    total: cython.double[::1] = total_array
    corner: Corner[::1] = np.empty(twin.shape[0], _CORNER)
    # The corner to the left of each spoke, twice, and one more if it is turned over; -1 past the end of an open fan.
    left: cython.int[::1] = np.empty(spoke.shape[0], np.int32)
    end: cython.int[::1] = np.array(first)
    is_done: cython.uchar[::1] = np.zeros(twin.shape[0], np.uint8)
    n_fans: cython.int = 0
    with cython.nogil:
        _shapes(length, corner)
        # Each step takes half a second on a million faces.
        if not is_interrupted():
            n_fans = _fans(vertex, twin, aligned, corner, first, total, is_flat, spoke, left, end, is_done)
            if not is_interrupted():
                _fill_spokes(vertex, length, twin, aligned, corner, spoke, left)
    raise_caught()
    return total_array[:n_fans].copy(), flat_array.view(bool)


@cython.cfunc
@cython.nogil
def _shapes(length: cython.const[cython.double][::1], corner: Corner[::1]) -> cython.void:
    """Place and angle of each corner."""
    room: cython.double[3]
    for first in range(0, length.shape[0], 3):
        half: cython.double = 0.5 * (length[first] + length[first + 1] + length[first + 2])
        root: cython.double = sqrt(half)
        for c in range(3):
            room[c] = sqrt(max(half - length[first + c], 0.0))
        # Heron's formula as a product of differences: a height from right^2 - x^2 loses the digits of slivers.
        twice: cython.double = 2.0 * root * room[0] * room[1] * room[2]
        for c in range(3):
            base: cython.double = length[first + c]
            right: cython.double = length[first + (c + 2) % 3]
            left: cython.double = length[first + (c + 1) % 3]
            here = cython.address(corner[first + c])
            here.x = 0.5 * ((right - left) * (right + left) / (base * base) + 1.0)
            here.y = twice / (base * base)
            beside: cython.double = 1.0 / sqrt(right * left)
            here.cosine, here.sine = root * room[c] * beside, room[(c + 1) % 3] * room[(c + 2) % 3] * beside


@cython.cfunc
@cython.inline
@cython.nogil
def _side(k: cython.int, is_left: cython.bint) -> cython.int:
    """The side at the left of corner k // 2, or at its right: they change places if k is odd, the face turned over."""
    return next_half_edge(k // 2) if is_left != (k & 1) else previous_half_edge(k // 2)


@cython.cfunc
@cython.inline
@cython.nogil
def _beyond(
    twin: cython.const[cython.int][::1],
    aligned: cython.const[cython.uchar][::1],
    k: cython.int,
    is_left: cython.bint,
) -> cython.int:
    """The corner of the same vertex beyond a side of corner k // 2, as `_side` has them; -1 if there is none."""
    h: cython.int = _side(k, is_left)
    t: cython.int = twin[h]
    if t < 0:
        return -1
    is_turned: cython.bint = (k & 1) != (not aligned[h])
    # Of the face beyond, the side is at the right if it is at the left here.
    return 2 * (next_half_edge(t) if is_left != is_turned else previous_half_edge(t)) + is_turned


@cython.cfunc
@cython.nogil
def _fans(
    vertex: cython.const[cython.int][::1],
    twin: cython.const[cython.int][::1],
    aligned: cython.const[cython.uchar][::1],
    corner: Corner[::1],
    first: cython.const[cython.int][::1],
    total: cython.double[::1],
    is_flat: cython.uchar[::1],
    spoke: Spoke[::1],
    left: cython.int[::1],
    end: cython.int[::1],
    is_done: cython.uchar[::1],
) -> cython.int:
    """Glue corners to fans, in rows of spokes from ``end[v]`` on; returns how many fans there are."""
    k: cython.int = -1
    n_fans: cython.int = 0
    for h in range(twin.shape[0]):
        if is_done[h]:
            continue
        v: cython.int = vertex[h]
        begin: cython.int = end[v]
        start: cython.int = 2 * h
        is_open: cython.bint = False
        while True:
            row: cython.int = begin
            # Half the angles are added up as products of complex numbers, in turns and an arctangent for each fan.
            x: cython.double = 1.0
            y: cython.double = 0.0
            turns: cython.int = 0
            k = start
            while True:  # counter-clockwise
                is_done[k // 2] = True
                left[row] = k
                spoke[row].next = row + 1
                row += 1
                here = cython.address(corner[k // 2])
                before: cython.double = y
                x, y = x * here.cosine - y * here.sine, x * here.sine + y * here.cosine
                turns += before < 0.0 and y >= 0.0
                k = _beyond(twin, aligned, k, True)
                if k < 0 or k == start:
                    break
            if k >= 0 or is_open:
                break
            is_open = True
            k = _beyond(twin, aligned, start, False)
            while k >= 0:  # clockwise, to the boundary where the fan begins
                start = k
                k = _beyond(twin, aligned, start, False)
        if is_open:  # the last side, which has no triangle to its left
            left[row] = -1
            spoke[row].next = row
            row += 1
        else:
            spoke[row - 1].next = begin
        angle: cython.double = 2.0 * (atan2(y, x) + 2.0 * M_PI * (turns + (y < 0.0)))
        if begin == first[v]:
            is_flat[v] = is_open or fabs(angle - 2.0 * M_PI) < 1e-9
        end[v] = row
        total[n_fans] = -angle if is_open else angle
        n_fans += 1
    return n_fans


@cython.cfunc
@cython.nogil
def _fill_spokes(
    vertex: cython.const[cython.int][::1],
    length: cython.const[cython.double][::1],
    twin: cython.const[cython.int][::1],
    aligned: cython.const[cython.uchar][::1],
    corner: Corner[::1],
    spoke: Spoke[::1],
    left: cython.int[::1],
) -> cython.void:
    """What a spoke knows of the triangle to its left, and of the one beyond."""
    k: cython.int = -1
    for row in range(spoke.shape[0]):
        s = cython.address(spoke[row])
        s.beyond = -1
        if left[row] < 0:  # past the end of the fan of the spoke before
            s.length = length[_side(k, True)]
            s.height = NAN
            s.neighbour = s.next_neighbour = vertex[_side(k, False)]
            continue
        k = left[row]
        h: cython.int = k // 2
        # The spoke is the side opposite the corner at the left neighbour.
        base: cython.double = length[h]
        s.length, s.base = length[_side(k, False)], base
        s.along, s.height = (1.0 - corner[h].x if k & 1 else corner[h].x) * base, corner[h].y * base
        s.neighbour, s.next_neighbour = vertex[_side(k, True)], vertex[_side(k, False)]
        t: cython.int = twin[h]
        if t >= 0:
            # Seen from beyond, the side mostly runs the other way.
            is_turned: cython.bint = (k & 1) != (not aligned[h])
            s.beyond_along = (corner[t].x if is_turned else 1.0 - corner[t].x) * base
            s.beyond_depth = corner[t].y * base
            s.beyond = vertex[t]
