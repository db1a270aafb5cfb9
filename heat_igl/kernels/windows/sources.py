"""Windows from vertices at which shortest paths can bend: the pseudo-sources of continuous Dijkstra.

Paths bend at a vertex with angles that sum to more than 2 pi, into directions at least pi from the arriving path on
both sides; at the boundary; and, into all faces, at a vertex with several fans.

Two paths to the vertex whose lengths agree to rounding can differ in direction by the square root of that: excess grows
with the square of the angle. What passes the vertex on its two sides may have come on the other path. So that nothing
between is left out, the rays that bound the directions of windows from the vertex are moved apart by this angle. Such
windows are paths too, and are cut where another is shorter.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.window_distances import relax
from cython.cimports.heat_igl.kernels.windows.window_lists import add
from cython.cimports.heat_igl.kernels.windows.window_structures import (
    BENDS,
    FLATNESS,
    JOINS,
    ROUNDING,
    WIDEST,
    Ray,
    Search,
    Window,
    twice_product,
)
from cython.cimports.heat_igl.kernels.windows.window_surface import beyond, third, turn
from cython.cimports.libc.math import sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _emit(
    s: cython.pointer(Search),
    k: cython.int,
    start: cython.double,
    stop: cython.double,
    root: cython.int,
    offset: cython.double,
) -> cython.void:
    """A window over the half-edge k, from the vertex opposite; start and stop from the tail of k."""
    one: Window
    length: cython.double = s.length[k]
    right: cython.double = s.length[previous_half_edge(k)]  # tail to apex
    left: cython.double = s.length[next_half_edge(k)]
    if s.twin[k] == -1:
        return
    one.x = 0.5 * twice_product(length, left, right) / length
    one.depth = s.double_area[k // 3] / length
    one.start = length - stop if stop < length else 0.0
    one.stop = length - start if start > 0.0 else length
    one.offset = offset
    one.root = root
    one.corner = k
    one.turn_x, one.turn_y = 0.5 * twice_product(length, right, left) / (length * right), -one.depth / right
    one.side = one.is_plane = 0
    if one.depth > 0.0:
        add(s, k, cython.address(one), 1, False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach_end(
    s: cython.pointer(Search), k: cython.int, is_tail: cython.bint, v: cython.int, offset: cython.double
) -> cython.void:
    """Distance along a side of corner k from its vertex v: to the tail of half-edge k, or to its head."""
    head: cython.int = next_half_edge(k)
    tail: cython.int = previous_half_edge(k)
    a: cython.double = s.length[tail]
    b: cython.double = s.length[head]
    if is_tail:
        relax(s, s.vertex[head], offset + a, v, head, b, k, 1.0, 0.0)
    else:
        x: cython.double = 0.5 * twice_product(a, b, s.length[k]) / a
        relax(s, s.vertex[tail], offset + b, v, tail, 0.0, k, x, s.double_area[k // 3] / a)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _straighten(
    s: cython.pointer(Search), k: cython.int, side: cython.int, ray: cython.pointer(Ray), margin: cython.double
) -> cython.bint:
    """Turn around the vertex over a side of corner k by pi, less a margin; true if the fan reaches as far as pi.

    `ray` takes the corner that holds the direction, the side over which it was entered, and the angle between them.
    """
    ahead: Ray
    sine: cython.double = ray.sine
    ray.sine = sine + margin * ray.cosine
    ray.cosine -= margin * sine
    ray.corner = -1
    ahead = ray[0]
    while True:
        k = beyond(s, k, side)
        if k < 0:
            return False
        side = s.twin[side]
        turn(s, k, side, cython.address(ahead))
        if ray.corner < 0:
            if ahead.sine < 0.0:
                ray.corner, ray.side = k, side
                ray.cosine = -ray.cosine
            else:
                ray[0] = ahead
        if ahead.sine < margin * ahead.cosine - FLATNESS:
            return True
        side = third(k, side)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach(s: cython.pointer(Search), ray: cython.pointer(Ray)) -> cython.double:
    """How far the ray meets the half-edge opposite its corner from the end on the side of the ray."""
    k: cython.int = ray.corner
    length: cython.double = s.length[k]
    p: cython.double = s.length[ray.side]
    q: cython.double = s.length[third(k, ray.side)]
    cosine: cython.double = 0.5 * twice_product(p, length, q) / (p * length)
    sine: cython.double = s.double_area[k // 3] / (p * length)
    x: cython.double = ray.sine * cosine + ray.cosine * sine
    if x <= 0.0:
        return length
    x = p * ray.sine / x
    return x if x < length else length


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _fill(
    s: cython.pointer(Search), v: cython.int, first: cython.pointer(Ray), last: cython.pointer(Ray)
) -> cython.void:
    """Windows from v between two rays, or between the first ray and the boundary if there is no second."""
    k: cython.int = first.corner
    side: cython.int = first.side
    near: cython.double = _reach(s, first)
    far: cython.double
    length: cython.double
    offset: cython.double = s.distance[v]
    while k >= 0:
        length = s.length[k]
        far = length
        if last != cython.NULL and k == last.corner:
            far = length - _reach(s, last)
        # An end that the windows leave out is reached by others. Its path over v would be longer, but with a tolerance
        # that is not known, and windows from that end would not fit between those that pass it.
        if near <= 0.0:
            _reach_end(s, k, side == previous_half_edge(k), v, offset)
        if far >= length:
            _reach_end(s, k, side != previous_half_edge(k), v, offset)
        if near < far:
            if side == previous_half_edge(k):
                _emit(s, k, near, far, v, offset)
            else:
                _emit(s, k, length - far, length - near, v, offset)
        if last != cython.NULL and k == last.corner:
            return
        near = 0.0
        side = third(k, side)
        k = beyond(s, k, side)
        side = s.twin[side]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def emit_vertex(s: cython.pointer(Search), v: cython.int) -> cython.void:
    """Windows from vertex v into all directions in which a shortest path can go on."""
    k: cython.int
    h: cython.int = s.entered[v]
    length: cython.double
    right_length: cython.double
    left_length: cython.double
    x: cython.double
    y: cython.double
    at: cython.double = s.crossing[v]
    norm: cython.double
    margin: cython.double
    left: Ray
    right: Ray
    has_left: cython.bint
    has_right: cython.bint
    s.emitted[v] = s.distance[v]
    if h < 0 or s.kind[v] == JOINS:
        k = s.corner_of_vertex[v]
        while k >= 0:
            _reach_end(s, k, True, v, s.distance[v])
            _reach_end(s, k, False, v, s.distance[v])
            _emit(s, k, 0.0, s.length[k], v, s.distance[v])
            k = s.next_corner[k]
        return
    # From the apex of h: the angles between the way back, to where the path crosses h, and the two sides.
    length, left_length, right_length = s.length[h], s.length[previous_half_edge(h)], s.length[next_half_edge(h)]
    x = 0.5 * twice_product(length, left_length, right_length) / length
    y = s.double_area[h // 3] / length
    norm = sqrt((at - x) * (at - x) + y * y)
    left.cosine, left.sine = (x * (x - at) + y * y) / (norm * left_length), y * at / (norm * left_length)
    right.cosine = 0.5 * twice_product(length, right_length, left_length) / length
    right.cosine = (right.cosine * (at - x) + y * y) / (norm * right_length)
    right.sine = y * (length - at) / (norm * right_length)
    margin = sqrt(ROUNDING * s.distance[v] / norm)
    if margin > WIDEST:
        margin = WIDEST
    has_left = _straighten(s, h, previous_half_edge(h), cython.address(left), margin)
    has_right = _straighten(s, h, next_half_edge(h), cython.address(right), margin)
    # Around a closed fan both rays bound one shadow; in an open one there are two, each up to the boundary.
    if s.kind[v] == BENDS:
        if has_left and has_right:
            _fill(s, v, cython.address(left), cython.address(right))
        return
    if has_left:
        _fill(s, v, cython.address(left), cython.NULL)
    if has_right:
        _fill(s, v, cython.address(right), cython.NULL)
