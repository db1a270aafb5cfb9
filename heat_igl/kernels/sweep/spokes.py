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
    one = _Spokes()
    one.vertex, one.twin, one.aligned, one.length = edges.vertex, edges.twin, edges.aligned, edges.length
    one.first, one.end, one.spoke, one.left = first, np.array(first), spoke, np.empty(spoke.shape[0], np.int32)
    total, is_flat = np.empty(one.twin.shape[0]), np.ones(first.shape[0] - 1, np.uint8)
    one.total, one.is_flat = total, is_flat
    one.corner, one.is_done = np.empty(len(total), _CORNER), np.zeros(len(total), np.uint8)
    n_fans: cython.int = 0
    with cython.nogil:
        one.shapes()
        # Each step takes half a second on a million faces.
        if not is_interrupted():
            n_fans = one.fans()
            if not is_interrupted():
                one.fill()
    raise_caught()
    return total[:n_fans].copy(), is_flat.view(bool)


@cython.cfunc
@cython.inline
@cython.nogil
def _side(k: cython.int, is_left: cython.bint) -> cython.int:
    """The side at the left of corner k // 2, or at its right: they change places if k is odd, the face turned over."""
    return next_half_edge(k // 2) if is_left != (k & 1) else previous_half_edge(k // 2)


@cython.final
@cython.cclass
class _Spokes:
    """Arrays that `fill` reads and writes.

    `left` is the corner at the left of each spoke, twice, one more if turned over; -1 past the end of an open fan.
    """

    vertex: cython.const[cython.int][::1]
    twin: cython.const[cython.int][::1]
    aligned: cython.const[cython.uchar][::1]
    length: cython.const[cython.double][::1]
    corner: Corner[::1]
    first: cython.const[cython.int][::1]
    total: cython.double[::1]
    is_flat: cython.uchar[::1]
    spoke: Spoke[::1]
    left: cython.int[::1]
    end: cython.int[::1]
    is_done: cython.uchar[::1]

    @cython.cfunc
    @cython.nogil
    def shapes(self) -> cython.void:
        """Place and angle of each corner."""
        room: cython.double[3]
        for first in range(0, self.length.shape[0], 3):
            half: cython.double = 0.5 * (self.length[first] + self.length[first + 1] + self.length[first + 2])
            root: cython.double = sqrt(half)
            for c in range(3):
                room[c] = sqrt(max(half - self.length[first + c], 0.0))
            # Heron's formula as a product of differences: a height from right^2 - x^2 loses the digits of slivers.
            twice: cython.double = 2.0 * root * room[0] * room[1] * room[2]
            for c in range(3):
                base: cython.double = self.length[first + c]
                right: cython.double = self.length[first + (c + 2) % 3]
                left: cython.double = self.length[first + (c + 1) % 3]
                here = cython.address(self.corner[first + c])
                here.x = 0.5 * ((right - left) * (right + left) / (base * base) + 1.0)
                here.y = twice / (base * base)
                beside: cython.double = 1.0 / sqrt(right * left)
                here.cosine, here.sine = root * room[c] * beside, room[(c + 1) % 3] * room[(c + 2) % 3] * beside

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def beyond(self, k: cython.int, is_left: cython.bint) -> cython.int:
        """The corner of the same vertex beyond a side of corner k // 2, as `_side` has them; -1 if there is none."""
        h: cython.int = _side(k, is_left)
        t: cython.int = self.twin[h]
        if t < 0:
            return -1
        is_turned: cython.bint = (k & 1) != (not self.aligned[h])
        # Of the face beyond, the side is at the right if it is at the left here.
        return 2 * (next_half_edge(t) if is_left != is_turned else previous_half_edge(t)) + is_turned

    @cython.cfunc
    @cython.nogil
    def fans(self) -> cython.int:
        """Glue corners to fans, in rows of spokes from ``self.end[v]`` on; returns how many fans there are."""
        k: cython.int = -1
        n_fans: cython.int = 0
        for h in range(self.twin.shape[0]):
            if self.is_done[h]:
                continue
            v: cython.int = self.vertex[h]
            begin: cython.int = self.end[v]
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
                    self.is_done[k // 2] = True
                    self.left[row] = k
                    self.spoke[row].next = row + 1
                    row += 1
                    here = cython.address(self.corner[k // 2])
                    before: cython.double = y
                    x, y = x * here.cosine - y * here.sine, x * here.sine + y * here.cosine
                    turns += before < 0.0 and y >= 0.0
                    k = self.beyond(k, True)
                    if k < 0 or k == start:
                        break
                if k >= 0 or is_open:
                    break
                is_open = True
                k = self.beyond(start, False)
                while k >= 0:  # clockwise, to the boundary where the fan begins
                    start = k
                    k = self.beyond(start, False)
            if is_open:  # the last side, which has no triangle to its left
                self.left[row] = -1
                self.spoke[row].next = row
                row += 1
            else:
                self.spoke[row - 1].next = begin
            angle: cython.double = 2.0 * (atan2(y, x) + 2.0 * M_PI * (turns + (y < 0.0)))
            if begin == self.first[v]:
                self.is_flat[v] = is_open or fabs(angle - 2.0 * M_PI) < 1e-9
            self.end[v] = row
            self.total[n_fans] = -angle if is_open else angle
            n_fans += 1
        return n_fans

    @cython.cfunc
    @cython.nogil
    def fill(self) -> cython.void:
        """What a spoke knows of the triangle to its left, and of the one beyond."""
        k: cython.int = -1
        for row in range(self.spoke.shape[0]):
            s = cython.address(self.spoke[row])
            s.beyond = -1
            if self.left[row] < 0:  # past the end of the fan of the spoke before
                s.length = self.length[_side(k, True)]
                s.height = NAN
                s.neighbour = s.next_neighbour = self.vertex[_side(k, False)]
                continue
            k = self.left[row]
            h: cython.int = k // 2
            # The spoke is the side opposite the corner at the left neighbour.
            base: cython.double = self.length[h]
            s.length, s.base = self.length[_side(k, False)], base
            s.along, s.height = (1.0 - self.corner[h].x if k & 1 else self.corner[h].x) * base, self.corner[h].y * base
            s.neighbour, s.next_neighbour = self.vertex[_side(k, True)], self.vertex[_side(k, False)]
            t: cython.int = self.twin[h]
            if t >= 0:
                # Seen from beyond, the side mostly runs the other way.
                is_turned: cython.bint = (k & 1) != (not self.aligned[h])
                s.beyond_along = (self.corner[t].x if is_turned else 1.0 - self.corner[t].x) * base
                s.beyond_depth = self.corner[t].y * base
                s.beyond = self.vertex[t]
