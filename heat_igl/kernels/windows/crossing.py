"""The windows of a half-edge cross its face: they give the apex its distance and continue over the other two sides."""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.windows.front import add, more_room, relax, release, take
from cython.cimports.heat_igl.kernels.windows.structures import (
    AROUND_APEX,
    LEFT_OF_APEX,
    MARGIN,
    RIGHT_OF_APEX,
    ROUNDING,
    Apex,
    Window,
    apart,
    at_corner,
    backward,
    bent,
    is_within,
    keep_root,
    lateral,
    p_apex,
    p_list,
    p_search,
    p_window,
    reach,
    twice_product,
)
from cython.cimports.heat_igl.kernels.windows.trimming import is_covered, trim, trim_by_kept
from cython.cimports.libc.math import INFINITY, fabs, sqrt
from cython.cimports.libc.string import memcpy


@cython.cfunc
@cython.nogil
def _opposite(s: p_search, h: cython.int) -> Apex:
    """The corner opposite half-edge h."""
    apex: Apex
    apex.length = s.length[h]
    apex.left_length = s.length[previous_half_edge(h)]
    apex.right_length = s.length[next_half_edge(h)]
    apex.x = 0.5 * twice_product(apex.length, apex.left_length, apex.right_length) / apex.length
    apex.right_x = 0.5 * twice_product(apex.length, apex.right_length, apex.left_length) / apex.length
    apex.y = s.double_area[h // 3] / apex.length
    apex.cos_left, apex.sin_left = apex.x / apex.left_length, apex.y / apex.left_length
    apex.cos_right, apex.sin_right = apex.right_x / apex.right_length, apex.y / apex.right_length
    apex.longest = max(apex.length, apex.left_length, apex.right_length)
    apex.best, apex.best_at, apex.nearest = -1, 0.0, INFINITY
    return apex


@cython.cfunc
@cython.nogil
def _arrive(
    s: p_search, h: cython.int, w: p_window, apex: p_apex, distance: cython.double, at: cython.double
) -> cython.void:
    """Relax the apex of h by the path of window w through the point `at` of h."""
    # The path leaves towards the apex. The direction to the point of h would cancel if the root is close to h.
    x: cython.double = apex.x - w.x
    y: cython.double = apex.y + w.depth
    leaving_x: cython.double = x * w.turn_x - y * w.turn_y
    leaving_y: cython.double = x * w.turn_y + y * w.turn_x
    if w.is_plane:
        leaving_x, leaving_y = w.turn_x + w.turn_y * w.depth * at, w.turn_y
    relax(s, s.vertex[h], distance, w.root, h, at, w.corner, leaving_x, leaving_y)


@cython.cfunc
@cython.nogil
def _straight(w: p_window, x: cython.double, y: cython.double) -> cython.double:
    """Length of the straight line from the root of a window to a point of the face, also outside of the window."""
    if w.is_plane:
        return w.offset + (w.x * x + w.depth * y)
    return w.offset + sqrt((x - w.x) * (x - w.x) + (y + w.depth) * (y + w.depth))


@cython.cfunc
@cython.nogil
def _may_reach(w: p_window, apex: p_apex, x: cython.double, m: cython.double, off: cython.double) -> cython.bint:
    """Whether the path to the apex over an end of the window may have the length of the straight line to rounding.

    The straight line passes the end at the distance d = `off` / |(x, m)|. The path over the end is longer by at least
    d^2 / 2 divided by the length of its last part.
    """
    most: cython.double = 2.0 * MARGIN * apex.longest
    if w.is_plane:
        return off * off <= most * (fabs(_straight(w, apex.x, apex.y)) + apex.longest)
    return off * off <= most * (w.offset + fabs(x) + m + apex.longest) * (x * x + m * m)


@cython.cfunc
@cython.nogil
def _reach_apex(s: p_search, h: cython.int, windows: p_window, n: cython.int, apex: p_apex) -> cython.void:
    """Relax the apex by all windows, and set on which side of it the lines of each window pass."""
    x: cython.double
    m: cython.double
    a: cython.double
    b: cython.double
    at: cython.double
    distance: cython.double
    w: p_window
    for i in range(n):
        w = windows + i
        if w.is_plane:
            x = backward(w, apex.x, apex.y)
            m = 1.0
            a = (w.start - x) * w.depth
            b = (w.stop - x) * w.depth
        else:
            x = apex.x - w.x
            m = apex.y + w.depth
            a = (w.start - w.x) * m - w.depth * x
            b = (w.stop - w.x) * m - w.depth * x
        if b < 0.0:
            w.side = LEFT_OF_APEX
            if not _may_reach(w, apex, x, m, b):
                continue
            b = w.stop
        elif a > 0.0:
            w.side = RIGHT_OF_APEX
            if not _may_reach(w, apex, x, m, a):
                continue
            b = w.start
        else:
            w.side = AROUND_APEX
            distance = _straight(w, apex.x, apex.y)
            if distance < apex.nearest:
                apex.nearest = distance
                apex.best = i
            continue
        # The apex is outside the window, possibly between two halves that rounding separated. The path over the end of
        # the window is then as good as a straight one if it has the same length to rounding. It is lengthened slightly,
        # so that a path of equal length is preferred: one from another root may leave in another direction, and one
        # that bends at a vertex passes it on the correct side.
        distance = bent(w, b, apex.x, apex.y) * (1.0 + ROUNDING)
        if is_within(distance, _straight(w, apex.x, apex.y), apex.longest):
            at = min(max(backward(w, apex.x, apex.y), 0.0), apex.length)
            _arrive(s, h, w, apex, distance, at)
    if apex.best >= 0:
        w = windows + apex.best
        apex.best_at = backward(w, apex.x, apex.y)
        _arrive(s, h, w, apex, apex.nearest, apex.best_at)


@cython.cfunc
@cython.nogil
def _to_left(w: p_window, apex: p_apex, out: p_window) -> cython.bint:
    """Propagate a window to the side between the tail and the apex; false if it does not reach this side."""
    keep_root(w, out)
    if w.is_plane:
        out.x = w.x * apex.cos_left + w.depth * apex.sin_left
        out.depth = w.depth * apex.cos_left - w.x * apex.sin_left
        out.turn_x, out.turn_y = w.turn_x, w.turn_y
    else:
        out.x = w.x * apex.cos_left - w.depth * apex.sin_left
        out.depth = w.x * apex.sin_left + w.depth * apex.cos_left
        out.turn_x = w.turn_x * apex.cos_left - w.turn_y * apex.sin_left
        out.turn_y = w.turn_x * apex.sin_left + w.turn_y * apex.cos_left
    if out.depth <= 0.0:
        return False
    scale = w.depth * apex.cos_left
    # If the root lies on the extension of the side, the intersection is a quotient of two rounding errors.
    out.start = w.start * w.depth / (scale - lateral(w, w.start) * apex.sin_left)
    out.start = max(out.start, 0.0)
    out.stop = apex.left_length
    if w.side == LEFT_OF_APEX:
        out.stop = w.stop * w.depth / (scale - lateral(w, w.stop) * apex.sin_left)
        if out.stop > apex.left_length:
            out.stop = apex.left_length
    return out.stop > out.start


@cython.cfunc
@cython.nogil
def _to_right(w: p_window, apex: p_apex, out: p_window) -> cython.bint:
    """Propagate a window to the side between the apex and the head; false if it does not reach this side."""
    x: cython.double = apex.length - w.x
    keep_root(w, out)
    if w.is_plane:
        out.offset = w.offset + w.x * apex.x + w.depth * apex.y
        out.x = w.x * apex.cos_right - w.depth * apex.sin_right
        out.depth = w.x * apex.sin_right + w.depth * apex.cos_right
        out.turn_x = w.turn_x + w.turn_y * (w.depth * apex.x - w.x * apex.y)
        out.turn_y = w.turn_y
    else:
        out.x = apex.right_length - (x * apex.cos_right - w.depth * apex.sin_right)
        out.depth = x * apex.sin_right + w.depth * apex.cos_right
        out.turn_x = w.turn_x * apex.cos_right + w.turn_y * apex.sin_right
        out.turn_y = w.turn_y * apex.cos_right - w.turn_x * apex.sin_right
    if out.depth <= 0.0:
        return False
    scale = w.depth * apex.cos_right
    out.stop = apex.right_length - (apex.length - w.stop) * w.depth / (scale + lateral(w, w.stop) * apex.sin_right)
    out.stop = min(out.stop, apex.right_length)
    out.start = 0.0
    if w.side == RIGHT_OF_APEX:
        out.start = apex.right_length - (apex.length - w.start) * w.depth / (
            scale + lateral(w, w.start) * apex.sin_right
        )
        if out.start < 0.0:
            out.start = 0.0
    return out.stop > out.start


@cython.cfunc
@cython.nogil
def _loses_nothing(w: p_window, apex: p_apex, windows: p_window, out: p_window, to_left: cython.bint) -> cython.bint:
    """Whether `out`, made of w, lies on its side, and its ends are on the first and the last line of w, or at the apex.

    Then straight lines through w reach all of `out`, and `out` covers all that they reach. If `out` is NULL, w was not
    propagated: whether the one of the `windows` that gives the apex its distance leads to all points that w reaches, by
    paths no longer.
    """
    unused: Window
    start: cython.double = w.start
    stop: cython.double = w.stop
    if out == cython.NULL:
        out = cython.address(unused)
        if not (_to_left(w, apex, out) if to_left else _to_right(w, apex, out)):
            return True
        w = windows + apex.best
        start = stop = apex.best_at
    elif w.side == AROUND_APEX:
        at: cython.double = min(max(backward(w, apex.x, apex.y), w.start), w.stop)
        start, stop = (start, at) if to_left else (at, stop)
    for end in range(2):
        place: cython.double = out.stop if end else out.start
        x: cython.double = place * apex.cos_left
        y: cython.double = place * apex.sin_left
        if not to_left:
            x = apex.length - (apex.right_length - place) * apex.cos_right
            y = (apex.right_length - place) * apex.sin_right
        # Lengths are compared and no positions, since the intersection with a line along the side is ill-conditioned.
        if not is_within(bent(w, stop if end else start, x, y), out.offset + reach(out, place), apex.longest):
            return False
    return 0.0 <= out.start < out.stop <= (apex.left_length if to_left else apex.right_length)


@cython.cfunc
@cython.nogil
def _fetch(s: p_search, t: cython.int) -> cython.void:
    """Prefetch the data for windows over half-edge t."""
    prefetch(s.slot + t)
    prefetch(s.length + t)
    prefetch(s.bulge + t)


def cross(s, h):
    """Propagate the windows that wait at half-edge h across its face."""
    place: cython.int = s.slot[h]
    one: p_list = cython.address(s.lists[place])
    windows: p_window = one.windows
    n: cython.int = one.count
    i: cython.int
    n_left: cython.int = 0
    n_right: cython.int = 0
    apex: Apex
    w: p_window
    is_best: cython.bint
    prefetch(s.upper + s.vertex[h])
    _fetch(s, s.twin[previous_half_edge(h)])
    _fetch(s, s.twin[next_half_edge(h)])
    s.slot[h] = -1
    s.n_lists_done += 1
    s.n_crossed += 1
    s.n_waiting -= n
    if n > s.n_out:
        more_room(s, n)
        if s.failed:
            return
    # Only the checked build has assertions. The next one needs a copy of the untrimmed windows; s.to_left is free here.
    assert memcpy(s.to_left, windows, n * cython.sizeof(Window)) != cython.NULL
    i = n
    n = trim(s, windows, n, h)
    # There are about 6 half-edges for each vertex, so by then each was crossed twice in the mean. On scans and spheres
    # 3.1 to 3.8 lists cross for each vertex. With 6 in place of 12, fans of 2048 triangles take 1.3 times as long.
    if s.n_crossed > 12 * cython.cast(cython.longlong, s.n_touched):
        n = trim_by_kept(s, windows, n, h, one.turns)
    assert is_covered(s, s.to_left, i, windows, n, h)
    apex = _opposite(s, h)
    _reach_apex(s, h, windows, n, cython.address(apex))
    if s.first_target != cython.NULL and s.first_target[h // 3] >= 0:
        _measure(s, h, windows, n, apex.x, apex.y)
    for i in range(n):
        w = windows + i
        # Windows whose lines would cross a shorter path to the apex are not propagated.
        is_best = (apex.best < 0) | (i == apex.best)
        if w.side != RIGHT_OF_APEX and (
            is_best
            or w.start < apex.best_at
            or (w.side == LEFT_OF_APEX and not apex.nearest <= bent(w, w.stop, apex.x, apex.y))
        ):
            if _to_left(w, cython.address(apex), s.to_left + n_left):
                assert _loses_nothing(w, cython.address(apex), windows, s.to_left + n_left, True)
                n_left += 1
        else:
            assert w.side == RIGHT_OF_APEX or _loses_nothing(w, cython.address(apex), windows, cython.NULL, True)
        if w.side != LEFT_OF_APEX and (
            is_best
            or w.stop > apex.best_at
            or (w.side == RIGHT_OF_APEX and not apex.nearest <= bent(w, w.start, apex.x, apex.y))
        ):
            if _to_right(w, cython.address(apex), s.to_right + n_right):
                assert _loses_nothing(w, cython.address(apex), windows, s.to_right + n_right, False)
                n_right += 1
        else:
            assert w.side == LEFT_OF_APEX or _loses_nothing(w, cython.address(apex), windows, cython.NULL, False)
    # Lines that cross as many faces around a vertex as it has corners cross an edge there twice, and no shortest path
    # does: the vertex and the two crossings span a triangle with two sides on the edge, which is shorter than the line.
    # Around the tip of a needle, where lines may differ by less than rounding, they would wind a million times.
    n_left_turns: cython.int = max(one.turns, 0) + 1
    n_right_turns: cython.int = max(-one.turns, 0) + 1
    release(s, place)
    if n_left > 0 and n_left_turns < s.n_corners[s.vertex[next_half_edge(h)]]:
        add(s, previous_half_edge(h), s.to_left, n_left, n_left_turns)
    if n_right > 0 and n_right_turns < s.n_corners[s.vertex[previous_half_edge(h)]]:
        add(s, next_half_edge(h), s.to_right, n_right, -n_right_turns)


@cython.cfunc
@cython.nogil
def _measure(
    s: p_search, h: cython.int, windows: p_window, n: cython.int, apex_x: cython.double, apex_y: cython.double
) -> cython.void:
    """Update the distances of the targets in the face of h by its windows."""
    j: cython.int = s.first_target[h // 3]
    length: cython.double = s.length[h]
    w: p_window
    while j >= 0:
        x = s.target[3 * j + previous_half_edge(h) % 3] * length + s.target[3 * j + h % 3] * apex_x
        y = s.target[3 * j + h % 3] * apex_y
        for i in range(n):
            w = windows + i
            place = backward(w, x, y)
            at = min(max(place, w.start), w.stop)
            distance = bent(w, at, x, y)
            if at != place and distance > _straight(w, x, y) + ROUNDING * (distance + length):
                continue
            if y == 0.0:
                # On the side itself, prefer the copy in the previous face: that is the last face of the path.
                distance += s.tolerance * distance
            if distance < s.target_distance[j]:
                s.target_distance[j] = distance
                s.target_root[j] = w.root
                s.target_entered[j] = h
                s.target_crossing[j] = at
        j = s.next_target[j]


def over_corners(s, j):
    """Update the distance of target j by paths over the corners of its face."""
    f: cython.int = s.target_face[j]
    c: cython.int
    corner: cython.double[3]
    for c in range(3):
        at_corner(c, corner)
        v = s.vertex[3 * f + c]
        take(s, j, s.distance[v] + apart(s.length + 3 * f, corner, s.target + 3 * j), v)
