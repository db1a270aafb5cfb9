"""Windows cross a face: they give distances to the opposite vertex and the targets inside, and windows on two sides."""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.windows.window_distances import relax, take
from cython.cimports.heat_igl.kernels.windows.window_lists import add
from cython.cimports.heat_igl.kernels.windows.window_memory import more_room
from cython.cimports.heat_igl.kernels.windows.window_structures import (
    AROUND_APEX,
    LEFT_OF_APEX,
    NARROW,
    NEAR,
    RIGHT_OF_APEX,
    Apex,
    List,
    Search,
    Window,
    apart,
    at_corner,
    backward,
    bent,
    is_within,
    lateral,
    reach,
    twice_product,
)
from cython.cimports.heat_igl.kernels.windows.window_trimming import is_covered, trim
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.libc.string import memcpy


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _opposite(s: cython.pointer(Search), h: cython.int) -> Apex:
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
    apex.best, apex.best_at, apex.nearest = -1, 0.0, INFINITY
    return apex


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _arrive(
    s: cython.pointer(Search), h: cython.int, w: cython.pointer(Window), distance: cython.double, at: cython.double
) -> cython.void:
    """Take the distance of the corner opposite h by the line of a window through a point of h."""
    x: cython.double = at - w.x
    leaving_x: cython.double = x * w.turn_x - w.depth * w.turn_y
    leaving_y: cython.double = x * w.turn_y + w.depth * w.turn_x
    if w.is_plane:
        leaving_x, leaving_y = w.turn_x + w.turn_y * w.depth * at, w.turn_y
    relax(s, s.vertex[h], distance, w.root, h, at, w.corner, leaving_x, leaving_y)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach_apex(
    s: cython.pointer(Search),
    h: cython.int,
    windows: cython.pointer(Window),
    n: cython.int,
    apex: cython.pointer(Apex),
) -> cython.void:
    """Distance of the apex, and the side on which the lines of each window pass it."""
    i: cython.int
    x: cython.double
    m: cython.double
    a: cython.double
    b: cython.double
    at: cython.double
    distance: cython.double
    w: cython.pointer(Window)
    for i in range(n):
        w = windows + i
        if w.is_plane:
            x = backward(w, apex.x, apex.y)
            m = 1.0
            a = w.start - x
            b = w.stop - x
            distance = w.offset + w.x * apex.x + w.depth * apex.y
        else:
            x = apex.x - w.x
            m = apex.y + w.depth
            a = (w.start - w.x) * m - w.depth * x
            b = (w.stop - w.x) * m - w.depth * x
            distance = w.offset + sqrt(x * x + m * m)
        if b < 0.0:
            w.side = LEFT_OF_APEX
            if b < -NEAR * apex.length * m:
                continue
            b = w.stop
        elif a > 0.0:
            w.side = RIGHT_OF_APEX
            if a > NEAR * apex.length * m:
                continue
            b = w.start
        else:
            w.side = AROUND_APEX
            if distance < apex.nearest:
                apex.nearest = distance
                apex.best = i
            continue
        # The apex is just beside the window: the path over the end of the window is hardly longer, and comes from the
        # same direction as a straight one.
        at = backward(w, apex.x, apex.y)
        at = 0.0 if at < 0.0 else apex.length if at > apex.length else at
        _arrive(s, h, w, bent(w, b, apex.x, apex.y), at)
    if apex.best >= 0:
        w = windows + apex.best
        apex.best_at = backward(w, apex.x, apex.y)
        _arrive(s, h, w, apex.nearest, apex.best_at)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _to_left(w: cython.pointer(Window), apex: cython.pointer(Apex), out: cython.pointer(Window)) -> cython.bint:
    """Make the window over the side between the tail and the apex; true if there is one."""
    scale: cython.double
    out[0] = w[0]
    if w.is_plane:
        out.x = w.x * apex.cos_left + w.depth * apex.sin_left
        out.depth = w.depth * apex.cos_left - w.x * apex.sin_left
    else:
        out.x = w.x * apex.cos_left - w.depth * apex.sin_left
        out.depth = w.x * apex.sin_left + w.depth * apex.cos_left
        out.turn_x = w.turn_x * apex.cos_left - w.turn_y * apex.sin_left
        out.turn_y = w.turn_x * apex.sin_left + w.turn_y * apex.cos_left
    if out.depth <= 0.0:
        return False
    scale = w.depth * apex.cos_left
    # A line along the side meets it anywhere: so near a root on its extension, the quotient is that of two roundings.
    out.start = w.start * w.depth / (scale - lateral(w, w.start) * apex.sin_left)
    if out.start < 0.0:
        out.start = 0.0
    out.stop = apex.left_length
    if w.side == LEFT_OF_APEX:
        out.stop = w.stop * w.depth / (scale - lateral(w, w.stop) * apex.sin_left)
        if out.stop > apex.left_length:
            out.stop = apex.left_length
    return out.stop - out.start > NARROW * apex.left_length


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _to_right(w: cython.pointer(Window), apex: cython.pointer(Apex), out: cython.pointer(Window)) -> cython.bint:
    """Make the window over the side between the apex and the head; true if there is one."""
    scale: cython.double
    x: cython.double = apex.length - w.x
    out[0] = w[0]
    if w.is_plane:
        out.offset = w.offset + w.x * apex.x + w.depth * apex.y
        out.x = w.x * apex.cos_right - w.depth * apex.sin_right
        out.depth = w.x * apex.sin_right + w.depth * apex.cos_right
        out.turn_x = w.turn_x + w.turn_y * (w.depth * apex.x - w.x * apex.y)
    else:
        out.x = apex.right_length - (x * apex.cos_right - w.depth * apex.sin_right)
        out.depth = x * apex.sin_right + w.depth * apex.cos_right
        out.turn_x = w.turn_x * apex.cos_right + w.turn_y * apex.sin_right
        out.turn_y = w.turn_y * apex.cos_right - w.turn_x * apex.sin_right
    if out.depth <= 0.0:
        return False
    scale = w.depth * apex.cos_right
    out.stop = apex.right_length - (apex.length - w.stop) * w.depth / (scale + lateral(w, w.stop) * apex.sin_right)
    if out.stop > apex.right_length:
        out.stop = apex.right_length
    out.start = 0.0
    if w.side == RIGHT_OF_APEX:
        out.start = apex.right_length - (apex.length - w.start) * w.depth / (
            scale + lateral(w, w.start) * apex.sin_right
        )
        if out.start < 0.0:
            out.start = 0.0
    return out.stop - out.start > NARROW * apex.right_length


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _place(
    apex: cython.pointer(Apex), to_left: cython.bint, at: cython.double, x: cython.p_double, y: cython.p_double
) -> cython.void:
    """A point of the side to the left or right of the apex, in the frame of the half-edge."""
    if to_left:
        x[0], y[0] = at * apex.cos_left, at * apex.sin_left
    else:
        at = apex.right_length - at
        x[0], y[0] = apex.length - at * apex.cos_right, at * apex.sin_right


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _continues(
    w: cython.pointer(Window), apex: cython.pointer(Apex), out: cython.pointer(Window), to_left: cython.bint
) -> cython.bint:
    """Whether `out` lies on its side, and begins and ends at the first and the last line of w, or at the apex.

    So it is reached by straight lines through w, all of them inside the faces, and covers what w leads to.
    """
    x: cython.double
    y: cython.double
    place: cython.double
    at: cython.double
    i: cython.int
    if not 0.0 <= out.start < out.stop <= (apex.left_length if to_left else apex.right_length):
        return False
    for i in range(2):
        place = out.stop if i else out.start
        at = w.stop if i else w.start
        _place(apex, to_left, place, cython.address(x), cython.address(y))
        if w.side == AROUND_APEX and i == to_left:
            at = min(max(backward(w, apex.x, apex.y), w.start), w.stop)
        # Lengths agree, not places: a line along the side meets it anywhere.
        if not is_within(bent(w, at, x, y), out.offset + reach(out, place), apex.length):
            return False
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _is_behind(
    w: cython.pointer(Window),
    apex: cython.pointer(Apex),
    best: cython.pointer(Window),
    to_left: cython.bint,
) -> cython.bint:
    """Whether the window that the apex is reached through leads to where w does by paths that are no longer."""
    out: Window
    x: cython.double
    y: cython.double
    place: cython.double
    i: cython.int
    if to_left:
        if not _to_left(w, apex, cython.address(out)):
            return True
    elif not _to_right(w, apex, cython.address(out)):
        return True
    for i in range(2):
        place = out.stop if i else out.start
        _place(apex, to_left, place, cython.address(x), cython.address(y))
        if not is_within(bent(best, apex.best_at, x, y), out.offset + reach(cython.address(out), place), apex.length):
            return False
    return True


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _fetch(s: cython.pointer(Search), t: cython.int) -> cython.void:
    """Prefetch the data for windows over half-edge t."""
    prefetch(s.slot + t)
    prefetch(s.length + t)
    prefetch(s.bulge + t)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def cross(s: cython.pointer(Search), h: cython.int) -> cython.void:
    """Carry the windows that wait at half-edge h over its face."""
    place: cython.int = s.slot[h]
    one: cython.pointer(List) = cython.address(s.lists[place])
    windows: cython.pointer(Window) = one.windows
    n: cython.int = one.count
    i: cython.int
    n_left: cython.int = 0
    n_right: cython.int = 0
    apex: Apex
    w: cython.pointer(Window)
    is_best: cython.bint
    _fetch(s, s.twin[previous_half_edge(h)])
    _fetch(s, s.twin[next_half_edge(h)])
    s.slot[h] = -1
    s.n_lists_done += 1
    s.n_waiting -= n
    if n > s.n_out:
        more_room(s, n)
        if s.failed:
            return
    assert memcpy(s.to_left, windows, n * cython.sizeof(Window)) != cython.NULL
    i = n
    n = trim(s, windows, n, h)
    assert is_covered(s, s.to_left, i, windows, n, h)
    apex = _opposite(s, h)
    _reach_apex(s, h, windows, n, cython.address(apex))
    if s.first_target != cython.NULL and s.first_target[h // 3] >= 0:
        _measure(s, h, windows, n, apex.x, apex.y)
    for i in range(n):
        w = windows + i
        # Windows whose lines would cross a shorter path to the apex go no further.
        is_best = apex.best < 0 or i == apex.best
        if w.side != RIGHT_OF_APEX and (
            is_best
            or w.start < apex.best_at
            or (w.side != AROUND_APEX and not apex.nearest <= bent(w, w.stop, apex.x, apex.y))
        ):
            if _to_left(w, cython.address(apex), s.to_left + n_left):
                assert _continues(w, cython.address(apex), s.to_left + n_left, True)
                n_left += 1
        else:
            assert w.side == RIGHT_OF_APEX or _is_behind(w, cython.address(apex), windows + apex.best, True)
        if w.side != LEFT_OF_APEX and (
            is_best
            or w.stop > apex.best_at
            or (w.side != AROUND_APEX and not apex.nearest <= bent(w, w.start, apex.x, apex.y))
        ):
            if _to_right(w, cython.address(apex), s.to_right + n_right):
                assert _continues(w, cython.address(apex), s.to_right + n_right, False)
                n_right += 1
        else:
            assert w.side == LEFT_OF_APEX or _is_behind(w, cython.address(apex), windows + apex.best, False)
    # The list is free again; its room stays with it.
    s.lists[place].count = s.free_list
    s.lists[place].half_edge = -1
    s.free_list = place
    if n_left > 0:
        add(s, previous_half_edge(h), s.to_left, n_left, True)
    if n_right > 0:
        add(s, next_half_edge(h), s.to_right, n_right, False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _measure(
    s: cython.pointer(Search),
    h: cython.int,
    windows: cython.pointer(Window),
    n: cython.int,
    apex_x: cython.double,
    apex_y: cython.double,
) -> cython.void:
    """Distances of the targets in the face of h, over its windows."""
    j: cython.int = s.first_target[h // 3]
    i: cython.int
    length: cython.double = s.length[h]
    x: cython.double
    y: cython.double
    at: cython.double
    distance: cython.double
    w: cython.pointer(Window)
    while j >= 0:
        x = s.target[3 * j + previous_half_edge(h) % 3] * length + s.target[3 * j + h % 3] * apex_x
        y = s.target[3 * j + h % 3] * apex_y
        for i in range(n):
            w = windows + i
            at = backward(w, x, y)
            if at < w.start:
                if at < w.start - NEAR * length:
                    continue
                at = w.start
            if at > w.stop:
                if at > w.stop + NEAR * length:
                    continue
                at = w.stop
            distance = bent(w, at, x, y)
            if y == 0.0:
                # On the side itself: the copy in the face before knows the last face of the path.
                distance += s.tolerance * distance
            if distance < s.target_distance[j]:
                s.target_distance[j] = distance
                s.target_root[j] = w.root
                s.target_entered[j] = h
                s.target_crossing[j] = at
        j = s.next_target[j]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def over_corners(s: cython.pointer(Search), j: cython.int) -> cython.void:
    """Distance of target j over the corners of its face."""
    f: cython.int = s.target_face[j]
    c: cython.int
    v: cython.int
    corner: cython.double[3]
    for c in range(3):
        at_corner(c, corner)
        v = s.vertex[3 * f + c]
        take(s, j, s.distance[v] + apart(s.length + 3 * f, corner, s.target + 3 * j), v)
