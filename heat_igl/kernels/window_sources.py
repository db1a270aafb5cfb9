"""Where windows begin: at sources, and at vertices at which shortest paths can bend.

Paths bend where the angles around a vertex exceed 2 pi, into the directions beyond a straight angle on both sides; at
the boundary; and where faces are not one fan, into all faces.
"""

import cython
from cython.cimports.heat_igl.kernels.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.window_lists import add, push, tell
from cython.cimports.heat_igl.kernels.window_structures import (
    BENDS,
    FLAT,
    JOINS,
    PASSED,
    SHADOW_MARGIN,
    UNKNOWN,
    Ray,
    Search,
    Window,
    straight,
)
from cython.cimports.heat_igl.kernels.window_surface import beyond, classify, third, turn
from cython.cimports.libc.math import INFINITY, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def relax(
    s: cython.pointer(Search),
    v: cython.int,
    distance: cython.double,
    root: cython.int,
    entered: cython.int,
    crossing: cython.double,
    corner: cython.int,
    x: cython.double,
    y: cython.double,
) -> cython.void:
    """Take a distance of v if it is shorter than the one known.

    The straight last part of the path leaves the root out of a corner, in the direction (x, y). The frame of a corner
    begins with the side to the next corner of the face. In the face f of a source point it is that of corner 3 f.
    """
    if distance >= s.upper[v]:
        return
    if s.distance[v] == INFINITY:
        s.touched[s.n_touched] = v
        s.n_touched += 1
    s.distance[v] = s.upper[v] = distance
    s.root[v] = root
    s.label[v] = s.label[root]
    s.entered[v] = entered
    s.crossing[v] = crossing
    if s.corner != cython.NULL:
        s.corner[v] = corner
        s.leaving[2 * v] = x
        s.leaving[2 * v + 1] = y
    if s.other != cython.NULL:
        tell(s, v, distance)
    if distance > s.last_key:
        return
    if s.aim >= 0:
        if v == s.aim:
            s.within = min(s.within, with_rounding(distance))
        elif distance + straight(s, v) > s.within:
            return
    if s.kind[v] == UNKNOWN:
        s.kind[v] = classify(s, v)
    if s.kind[v] == FLAT:
        s.meets_flat = True
    elif s.kind[v] != PASSED:
        push(s, distance, s.n_half_edges + v)


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
    one.x = length - 0.5 * (length + (right - left) * (right + left) / length)
    one.depth = s.double_area[k // 3] / length
    one.start = length - stop if stop < length else 0.0
    one.stop = length - start if start > 0.0 else length
    one.offset = offset
    one.root = root
    one.corner = k
    one.turn_x, one.turn_y = (length - one.x) / right, -one.depth / right
    one.side = one.is_plane = 0
    if one.depth > 0.0:
        add(s, k, cython.address(one), 1, False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach_ends(s: cython.pointer(Search), k: cython.int, v: cython.int, offset: cython.double) -> cython.void:
    """Distances along the two sides of corner k from its vertex v."""
    head: cython.int = next_half_edge(k)
    tail: cython.int = previous_half_edge(k)
    a: cython.double = s.length[tail]
    b: cython.double = s.length[head]
    relax(s, s.vertex[head], offset + a, v, head, b, k, 1.0, 0.0)
    relax(s, s.vertex[tail], offset + b, v, tail, 0.0, k, foot(a, b, s.length[k]), s.double_area[k // 3] / a)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _straighten(s: cython.pointer(Search), k: cython.int, side: cython.int, ray: cython.pointer(Ray)) -> cython.bint:
    """Go on over a side of corner k until the direction has turned by pi; whether the fan reaches that far.

    `ray` takes the corner that holds the direction, the side over which it was entered, and the angle between them.
    """
    cosine: cython.double
    sine: cython.double
    while True:
        k = beyond(s, k, side)
        if k < 0:
            return False
        side = s.twin[side]
        cosine, sine = ray.cosine, ray.sine
        turn(s, k, side, ray)
        if ray.sine < 0.0:
            ray.corner, ray.side = k, side
            ray.cosine, ray.sine = -cosine, sine
            return True
        side = third(k, side)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach(s: cython.pointer(Search), ray: cython.pointer(Ray)) -> cython.double:
    """How far along the half-edge opposite the ray's corner, from its end on the ray's side, the ray meets it."""
    k: cython.int = ray.corner
    length: cython.double = s.length[k]
    p: cython.double = s.length[ray.side]
    q: cython.double = s.length[third(k, ray.side)]
    cosine: cython.double = (p * p + length * length - q * q) / (2.0 * p * length)
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
    """Windows from v between two rays, or, without a second one, from the first ray to the boundary."""
    k: cython.int = first.corner
    side: cython.int = first.side
    near: cython.double = _reach(s, first) - SHADOW_MARGIN * s.length[k]
    far: cython.double
    length: cython.double
    offset: cython.double = s.distance[v]
    while k >= 0:
        length = s.length[k]
        far = length
        if last != cython.NULL and k == last.corner:
            far = length - _reach(s, last) + SHADOW_MARGIN * length
        _reach_ends(s, k, v, offset)
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
def shed(s: cython.pointer(Search), v: cython.int) -> cython.void:
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
    left: Ray
    right: Ray
    has_left: cython.bint
    has_right: cython.bint
    s.emitted[v] = s.distance[v]
    if h < 0 or s.kind[v] == JOINS:
        k = s.corner_of_vertex[v]
        while k >= 0:
            _reach_ends(s, k, v, s.distance[v])
            _emit(s, k, 0.0, s.length[k], v, s.distance[v])
            k = s.next_corner[k]
        return
    # From the apex of h: the angles between the way back, to where the path crosses h, and the two sides.
    length, left_length, right_length = s.length[h], s.length[previous_half_edge(h)], s.length[next_half_edge(h)]
    x = 0.5 * (length + (left_length - right_length) * (left_length + right_length) / length)
    y = s.double_area[h // 3] / length
    norm = sqrt((at - x) * (at - x) + y * y)
    left.cosine, left.sine = (x * (x - at) + y * y) / (norm * left_length), y * at / (norm * left_length)
    right.cosine = ((length - x) * (at - x) + y * y) / (norm * right_length)
    right.sine = y * (length - at) / (norm * right_length)
    has_left = _straighten(s, h, previous_half_edge(h), cython.address(left))
    has_right = _straighten(s, h, next_half_edge(h), cython.address(right))
    # Around a closed fan both rays bound one shadow; in an open one there are two, each up to the boundary.
    if s.kind[v] == BENDS:
        if has_left and has_right:
            _fill(s, v, cython.address(left), cython.address(right))
        return
    if has_left:
        _fill(s, v, cython.address(left), cython.NULL)
    if has_right:
        _fill(s, v, cython.address(right), cython.NULL)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def apart(s: cython.pointer(Search), f: cython.int, a: cython.p_double, b: cython.p_double) -> cython.double:
    """Distance between two points of a face, by their barycentric coordinates."""
    u: cython.double = a[0] - b[0]
    v: cython.double = a[1] - b[1]
    w: cython.double = a[2] - b[2]
    p: cython.double = s.length[3 * f]
    q: cython.double = s.length[3 * f + 1]
    r: cython.double = s.length[3 * f + 2]
    square: cython.double = -(p * p * v * w + q * q * w * u + r * r * u * v)
    return sqrt(square) if square > 0.0 else 0.0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def take(s: cython.pointer(Search), j: cython.int, distance: cython.double, root: cython.int) -> cython.void:
    """Take a distance of target j inside its face if it is shorter than the one known."""
    if distance < s.target_distance[j]:
        s.target_distance[j] = distance
        s.target_root[j] = root
        s.target_entered[j] = -1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def emit_point(s: cython.pointer(Search), p: cython.int) -> cython.void:
    """Windows from a source inside a face over its three sides."""
    f: cython.int = s.point_face[p]
    root: cython.int = s.n + p
    offset: cython.double = s.point_offset[p]
    at: cython.p_double = s.point + 3 * p
    one: Window
    c: cython.int
    h: cython.int
    i: cython.int
    j: cython.int
    corner: cython.double[3]
    length: cython.double
    left_length: cython.double
    right_length: cython.double
    distance: cython.double
    place_x: cython.double[3]
    place_y: cython.double[3]
    place_x[0] = place_y[0] = place_y[1] = 0.0
    place_x[1] = s.length[3 * f + 2]
    place_x[2] = foot(place_x[1], s.length[3 * f + 1], s.length[3 * f])
    place_y[2] = s.double_area[f] / place_x[1]
    x: cython.double = at[1] * place_x[1] + at[2] * place_x[2]
    y: cython.double = at[2] * place_y[2]
    for c in range(3):
        h = 3 * f + c
        for i in range(3):
            corner[i] = 1.0 if i == c else 0.0
        distance = offset + apart(s, f, corner, at)
        relax(s, s.vertex[h], distance, root, -1, 0.0, 3 * f, place_x[c] - x, place_y[c] - y)
        if at[c] <= 0.0:
            continue  # on the side itself, the source belongs to the face beyond it too
        length = s.length[h]
        left_length = s.length[previous_half_edge(h)]
        right_length = s.length[next_half_edge(h)]
        one.x = at[c] * 0.5 * (length + (left_length - right_length) * (left_length + right_length) / length)
        one.x = length - (one.x + at[previous_half_edge(h) % 3] * length)
        one.depth = at[c] * s.double_area[f] / length
        one.start = 0.0
        one.stop = length
        one.offset = offset
        one.root = root
        one.corner = 3 * f
        one.turn_x = (place_x[(c + 1) % 3] - place_x[(c + 2) % 3]) / length
        one.turn_y = (place_y[(c + 1) % 3] - place_y[(c + 2) % 3]) / length
        one.side = one.is_plane = 0
        if one.depth > 0.0:
            add(s, h, cython.address(one), 1, False)
    j = s.first_target[f] if s.first_target != cython.NULL else -1
    while j >= 0:
        take(s, j, offset + apart(s, f, s.target + 3 * j, at), root)
        j = s.next_target[j]


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def with_rounding(distance: cython.double) -> cython.double:
    """A little more than a distance: by more than rounding, and than needles are made longer by. Edges are about 1."""
    return distance * (1.0 + 1e-9) + 1e-10


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def aim_at(s: cython.pointer(Search), v: cython.int, goal: cython.int) -> cython.void:
    """Let the search from v be one for the distance of `goal` alone, and bound that by a path along edges.

    From each vertex, the path takes the edge that makes the way to the goal shortest, were it straight from there on.
    Where that comes no nearer to the goal, there is no bound.
    """
    k: cython.int
    h: cython.int
    i: cython.int
    best: cython.int
    length: cython.double = 0.0
    along: cython.double
    left: cython.double
    shortest: cython.double
    s.aim = goal
    s.within = INFINITY
    left = straight(s, v)
    while v != goal:
        shortest = INFINITY
        best = -1
        k = s.corner_of_vertex[v]
        while k >= 0:
            for i in range(2):
                h = next_half_edge(k) if i == 0 else previous_half_edge(k)
                along = s.length[third(k, h)]
                if along + straight(s, s.vertex[h]) < shortest:
                    shortest = along + straight(s, s.vertex[h])
                    best = s.vertex[h]
            k = s.next_corner[k]
        if best < 0 or straight(s, best) >= left:
            return
        v = best
        left = straight(s, v)
        length += shortest - left
    s.within = with_rounding(length)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def start_at(s: cython.pointer(Search), v: cython.int, offset: cython.double, label: cython.int) -> cython.void:
    """Let distance start at vertex v."""
    if s.failed or offset >= s.distance[v]:
        return
    if s.distance[v] == INFINITY:
        s.touched[s.n_touched] = v
        s.n_touched += 1
    s.distance[v] = s.upper[v] = offset
    s.root[v] = v
    s.label[v] = label
    s.entered[v] = -1
    if s.other != cython.NULL:
        tell(s, v, offset)
    push(s, offset, s.n_half_edges + v)
