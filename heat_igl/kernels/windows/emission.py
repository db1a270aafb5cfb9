"""Where windows start: at source vertices, at points and segments inside faces, and where shortest paths bend.

A segment emits lines at right angles on both sides (Bommes and Kobbelt 2007). Its two ends are source points as well,
so that lines leave them in all directions.

Shortest paths bend at boundary vertices, at vertices with several fans (into all faces), and at vertices whose angles
sum to more than 2 pi: there, into directions that make an angle of at least pi with the arriving path on both sides.
Two paths to a vertex with lengths equal to rounding may arrive in directions that differ by the square root of the
rounding, since the extra length is quadratic in the angle; a window that passes the vertex may belong to the other
path. The range of directions that leave the vertex is therefore widened by this angle, so that no gap remains. The
additional windows are valid paths, and are trimmed where another path is shorter.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.front import add, relax, take
from cython.cimports.heat_igl.kernels.windows.structures import (
    BENDS,
    FLATNESS,
    JOINS,
    ROUNDING,
    WIDEST,
    Direction,
    Window,
    apart,
    at_corner,
    nearest_on,
    twice_product,
)
from cython.cimports.heat_igl.kernels.windows.surface import beyond, third, turn
from cython.cimports.libc.math import fabs, sqrt


def emit_point(s, p):
    """Emit windows from a source point inside a face over the three sides of the face."""
    f: cython.int = s.point_face[p]
    root: cython.int = s.n + p
    offset: cython.double = s.point_offset[p]
    at: cython.p_double = s.point + 3 * p
    one: Window
    corner: cython.double[3]
    place_x: cython.double[3]
    place_y: cython.double[3]
    place_x[0] = place_y[0] = place_y[1] = 0.0
    place_x[1] = s.length[3 * f + 2]
    place_x[2] = foot(place_x[1], s.length[3 * f + 1], s.length[3 * f])
    place_y[2] = s.double_area[f] / place_x[1]
    for c in range(3):
        h: cython.int = 3 * f + c
        at_corner(c, corner)
        distance: cython.double = offset + apart(s.length + 3 * f, corner, at)
        # A difference of two positions would cancel if the point is close to the corner.
        x: cython.double = 0.0
        y: cython.double = 0.0
        for other in range(3):
            x += at[other] * (place_x[c] - place_x[other])
            y += at[other] * (place_y[c] - place_y[other])
        relax(s, s.vertex[h], distance, root, -1, 0.0, 3 * f, x, y)
        if at[c] <= 0.0:
            continue  # a source on the side is also listed for the neighbouring face
        length: cython.double = s.length[h]
        left_length: cython.double = s.length[previous_half_edge(h)]
        right_length: cython.double = s.length[next_half_edge(h)]
        one.x = at[c] * 0.5 * twice_product(length, left_length, right_length) / length
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
            add(s, h, cython.address(one), 1, 0)
    j: cython.int = s.first_target[f] if s.first_target != cython.NULL else -1
    while j >= 0:
        take(s, j, offset + apart(s.length + 3 * f, s.target + 3 * j, at), root)
        j = s.next_target[j]


def emit_segment(s, i):
    """Distances from source segment i to the corners and targets of its face, and windows over the sides."""
    f: cython.int = s.segment_face[i]
    root: cython.int = s.n + s.n_points + i
    ends: cython.p_double = s.segment + 6 * i
    corner: cython.double[3]
    for c in range(3):
        at_corner(c, corner)
        relax(s, s.vertex[3 * f + c], _segment_distance(s, i, corner), root, -1, 0.0, 3 * f, 0.0, 0.0)
        # A segment on the side is also listed for the neighbouring face.
        if ends[c] > 0.0 or ends[3 + c] > 0.0:
            _emit_parallel(s, 3 * f + c, ends, root, s.segment_offset[i])
    j: cython.int = s.first_target[f] if s.first_target != cython.NULL else -1
    while j >= 0:
        take(s, j, _segment_distance(s, i, s.target + 3 * j), root)
        j = s.next_target[j]


def _segment_distance(s, i, point):
    """Distance of a point in the face of segment i from the segment."""
    found: cython.double[3]
    nearest_on(s.length + 3 * s.segment_face[i], s.segment + 6 * i, point, found)
    return s.segment_offset[i] + apart(s.length + 3 * s.segment_face[i], point, found)


def _emit_parallel(s, h, ends, root, offset):
    """Emit the window of a segment over half-edge h out of the face; its frame runs from the head of h to the tail."""
    c: cython.int = h % 3
    head: cython.int = previous_half_edge(h) % 3
    length: cython.double = s.length[h]
    height: cython.double = s.double_area[h // 3] / length
    apex_x: cython.double = foot(length, s.length[previous_half_edge(h)], s.length[next_half_edge(h)])
    x: cython.double = length - (ends[c] * apex_x + ends[head] * length)
    depth: cython.double = ends[c] * height
    along: cython.double = length - (ends[3 + c] * apex_x + ends[3 + head] * length) - x
    rise: cython.double = depth - ends[3 + c] * height
    norm: cython.double = sqrt(along * along + rise * rise)
    one: Window
    if fabs(along) <= ROUNDING * norm or norm <= 0.0:
        return  # the segment is perpendicular to the half-edge, so its lines are parallel to it
    one.depth = fabs(along) / norm
    one.x = (-rise if along > 0.0 else rise) / norm
    one.start = x + depth * one.x / one.depth
    one.stop = x + along + (depth - rise) * one.x / one.depth
    if along < 0.0:
        one.start, one.stop = one.stop, one.start
    one.start = max(one.start, 0.0)
    one.stop = min(one.stop, length)
    one.offset = offset - one.x * x + one.depth * depth
    one.root = root
    one.corner = h - c
    one.turn_x, one.turn_y = (depth * rise - x * along) / norm, 1.0 if along > 0.0 else -1.0
    one.side = 0
    one.is_plane = True
    if one.stop > one.start:
        add(s, h, cython.address(one), 1, 0)


def _emit_from_bend(s, k, start, stop, root, offset):
    """Emit a window from a vertex over the opposite half-edge k; start and stop are measured from the tail of k."""
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
        add(s, k, cython.address(one), 1, 0)


def _reach_ends(s, k, v, offset):
    """Distances along the two sides of corner k from its vertex v."""
    head: cython.int = next_half_edge(k)
    tail: cython.int = previous_half_edge(k)
    a: cython.double = s.length[tail]
    b: cython.double = s.length[head]
    relax(s, s.vertex[head], offset + a, v, head, b, k, 1.0, 0.0)
    x: cython.double = 0.5 * twice_product(a, b, s.length[k]) / a
    relax(s, s.vertex[tail], offset + b, v, tail, 0.0, k, x, s.double_area[k // 3] / a)


def _straighten(s, k, side, ray, margin):
    """Rotate around the vertex by pi minus a margin, starting over a side of corner k; true if the fan spans pi.

    `ray` takes the corner that contains the direction, the side over which the rotation entered this corner, and the
    angle between the two.
    """
    sine: cython.double = ray.sine
    ray.sine = sine + margin * ray.cosine
    ray.cosine -= margin * sine
    ray.corner = -1
    ahead: Direction = ray[0]
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


def _reach(s, ray):
    """Where the ray meets the half-edge opposite its corner: the distance from the end that lies on `ray.side`."""
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


def _fill(s, v, first, last):
    """Emit windows from v between two rays, or between the first ray and the boundary if `last` is NULL."""
    k: cython.int = first.corner
    side: cython.int = first.side
    near: cython.double = _reach(s, first)
    offset: cython.double = s.distance[v]
    while k >= 0:
        length: cython.double = s.length[k]
        far: cython.double = length
        is_last: cython.bint = last != cython.NULL and k == last.corner
        if is_last:
            far = length - _reach(s, last)
        _reach_ends(s, k, v, offset)
        if near < far:
            if side == previous_half_edge(k):
                _emit_from_bend(s, k, near, far, v, offset)
            else:
                _emit_from_bend(s, k, length - far, length - near, v, offset)
        if is_last:
            return
        near = 0.0
        side = third(k, side)
        k = beyond(s, k, side)
        side = s.twin[side]


def emit_vertex(s, v):
    """Emit windows from vertex v into all directions in which a shortest path can continue."""
    h: cython.int = s.entered[v]
    at: cython.double = s.crossing[v]
    left: Direction
    right: Direction
    s.emitted[v] = s.distance[v]
    if h < 0 or s.kind[v] == JOINS:
        k: cython.int = s.corner_of_vertex[v]
        while k >= 0:
            _reach_ends(s, k, v, s.distance[v])
            _emit_from_bend(s, k, 0.0, s.length[k], v, s.distance[v])
            k = s.next_corner[k]
        return
    # At v, which is opposite h: the angles between the direction back to the crossing of h and the two sides.
    length, left_length, right_length = s.length[h], s.length[previous_half_edge(h)], s.length[next_half_edge(h)]
    x: cython.double = 0.5 * twice_product(length, left_length, right_length) / length
    y: cython.double = s.double_area[h // 3] / length
    norm: cython.double = sqrt((at - x) * (at - x) + y * y)
    left.cosine, left.sine = (x * (x - at) + y * y) / (norm * left_length), y * at / (norm * left_length)
    right.cosine = 0.5 * twice_product(length, right_length, left_length) / length
    right.cosine = (right.cosine * (at - x) + y * y) / (norm * right_length)
    right.sine = y * (length - at) / (norm * right_length)
    margin: cython.double = sqrt(ROUNDING * s.distance[v] / norm)
    if margin > WIDEST:
        margin = WIDEST
    has_left: cython.bint = _straighten(s, h, previous_half_edge(h), cython.address(left), margin)
    has_right: cython.bint = _straighten(s, h, next_half_edge(h), cython.address(right), margin)
    # In a closed fan, the two rays bound one range of directions; in an open fan, each ray and the boundary bound one.
    if s.kind[v] == BENDS:
        if has_left and has_right:
            _fill(s, v, cython.address(left), cython.address(right))
        return
    if has_left:
        _fill(s, v, cython.address(left), cython.NULL)
    if has_right:
        _fill(s, v, cython.address(right), cython.NULL)
