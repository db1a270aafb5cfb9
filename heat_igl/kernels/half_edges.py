"""Tables of half-edges, spokes and fans for walks over a triangulation."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.half_edges import Spoke, Step, Turn, following, preceding
from cython.cimports.libc.math import M_PI, NAN, atan2, fabs, sqrt

__all__ = ["HalfEdges", "fill", "first_spokes"]


@cython.final
@cython.cclass
class HalfEdges:
    """Views of the arrays of `heat_igl.intrinsic.fans.Tables`."""

    def __init__(self, tables):
        self.first = tables.first
        self.spoke = tables.spoke
        self.turn = tables.turn
        self.step = tables.step
        self.total = tables.total


def first_spokes(F: cython.const[cython.int][:, ::1], twin: cython.const[cython.int][::1], n: cython.int):
    """First spoke (n + 1,) int32 of each vertex: one per corner, and one more at the end of an open fan."""
    f: cython.Py_ssize_t
    c: cython.int
    h: cython.int
    v: cython.int
    array = np.zeros(n + 1, np.int32)
    first: cython.int[::1] = array
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(3):
                h = 3 * f + c
                first[F[f, c] + 1] += 2 if twin[following(h)] < 0 else 1
        for v in range(n):
            first[v + 1] += first[v]
    return array


def fill(
    F: cython.const[cython.int][:, ::1],
    l: cython.const[cython.double][:, ::1],
    twin: cython.const[cython.int][::1],
    first: cython.const[cython.int][::1],
    spoke: Spoke[::1],
    turn: Turn[::1],
    step: Step[::1],
):
    """Fill the tables; returns the total angle (k,) of each fan, and whether each vertex (n,) is flat.

    A vertex is flat if the first fan of it has no curvature, or is open; or if it has none.
    """
    total_array, flat_array = np.empty(twin.shape[0]), np.ones(first.shape[0] - 1, np.uint8)
    is_flat: cython.uchar[::1] = flat_array
    v: cython.int
    total: cython.double[::1] = total_array
    end: cython.int[::1] = np.array(first)
    n_fans: cython.int
    with cython.nogil:
        _shapes(F, l, twin, step)
        n_fans = _fans(twin, step, total, end, spoke, turn)
        _fill_spokes(l, twin, step, spoke, turn)
        for v in range(is_flat.shape[0]):
            if first[v] < first[v + 1]:
                around: cython.double = total[turn[first[v]].fan_here]
                is_flat[v] = around < 0.0 or fabs(around - 2.0 * M_PI) < 1e-9
    return total_array[:n_fans].copy(), flat_array.view(bool)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _shapes(
    F: cython.const[cython.int][:, ::1],
    l: cython.const[cython.double][:, ::1],
    twin: cython.const[cython.int][::1],
    step: Step[::1],
) -> cython.void:
    """What a step knows of its own triangle and of the next half-edges."""
    f: cython.Py_ssize_t
    c: cython.int
    for f in range(F.shape[0]):
        for c in range(3):
            base: cython.double = l[f, c]
            right: cython.double = l[f, (c + 2) % 3]
            left: cython.double = l[f, (c + 1) % 3]
            # Heron's formula as a product of differences: a height from right^2 - x^2 loses the digits of slivers.
            half: cython.double = 0.5 * (base + right + left)
            product: cython.double = max(half * (half - base) * (half - right) * (half - left), 0.0)
            here = cython.address(step[3 * f + c])
            here.x = 0.5 * ((right - left) * (right + left) / (base * base) + 1.0)
            here.y = 2.0 * sqrt(product) / (base * base)
            here.angle = 2.0 * atan2(
                sqrt(max((half - right) * (half - left), 0.0)), sqrt(max(half * (half - base), 0.0))
            )
            here.vertex = F[f, c]
            here.fan = -1  # not known yet
            here.to_right, here.to_left = twin[3 * f + (c + 1) % 3], twin[3 * f + (c + 2) % 3]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _fans(
    twin: cython.const[cython.int][::1],
    step: Step[::1],
    total: cython.double[::1],
    end: cython.int[::1],
    spoke: Spoke[::1],
    turn: Turn[::1],
) -> cython.int:
    """Glue corners to fans, in rows of spokes from ``end[v]`` on; returns how many fans there are."""
    h: cython.int
    k: cython.int
    t: cython.int
    n_fans: cython.int = 0
    for h in range(twin.shape[0]):
        if step[h].fan >= 0:
            continue
        start: cython.int = h
        is_open: cython.bint = False
        while True:  # clockwise, to the boundary or once around
            t = twin[preceding(start)]
            if t < 0:
                is_open = True
                break
            start = preceding(t)
            if start == h:
                break
        v: cython.int = step[h].vertex
        row: cython.int = end[v]
        first: cython.int = row
        angle: cython.double = 0.0
        k = start
        while True:  # counter-clockwise
            step[k].fan = n_fans
            step[k].direction = angle
            turn[row].here = angle
            turn[row].fan_here = n_fans
            turn[row].corner = k
            spoke[row].next = row + 1
            row += 1
            angle += step[k].angle
            t = twin[following(k)]
            if t < 0:
                break
            k = following(t)
            if k == start:
                break
        if t < 0:  # the last side, which has no triangle to its left
            turn[row].here = angle
            turn[row].fan_here = n_fans
            turn[row].corner = -1
            spoke[row].next = row
            row += 1
        else:
            spoke[row - 1].next = first
        end[v] = row
        total[n_fans] = -angle if is_open else angle
        n_fans += 1
    return n_fans


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _fill_spokes(
    l: cython.const[cython.double][:, ::1],
    twin: cython.const[cython.int][::1],
    step: Step[::1],
    spoke: Spoke[::1],
    turn: Turn[::1],
) -> cython.void:
    """What a spoke knows of the triangle to its left, and of the one beyond."""
    k: cython.int
    h: cython.int = -1
    t: cython.int
    for k in range(spoke.shape[0]):
        s = cython.address(spoke[k])
        r = cython.address(turn[k])
        s.beyond = -1
        if r.corner < 0:  # past the end of the fan of the spoke before
            neighbour = cython.address(step[preceding(h)])
            s.length = l[following(h) // 3, following(h) % 3]
            s.height = NAN
            s.neighbour = s.next_neighbour = neighbour.vertex
            r.there, r.fan_there, r.across = neighbour.direction, neighbour.fan, -1
            continue
        h = r.corner
        # The corners at the neighbours right and left of corner h; the spoke is the side opposite the left one.
        right = cython.address(step[following(h)])
        left = cython.address(step[preceding(h)])
        base: cython.double = l[h // 3, h % 3]
        s.length, s.base = l[h // 3, preceding(h) % 3], base
        s.along, s.height = step[h].x * base, step[h].y * base
        s.neighbour, s.next_neighbour = right.vertex, left.vertex
        r.there, r.fan_there = right.direction + right.angle, right.fan
        t = twin[h]
        r.across = t
        if t >= 0:
            # Seen from beyond, the side runs the other way.
            s.beyond_along, s.beyond_depth = (1.0 - step[t].x) * base, step[t].y * base
            s.beyond = step[t].vertex
