"""Windows cross a face: distances of the vertex and of the targets in it, and windows on its two other sides."""

import cython
from cython.cimports.heat_igl.kernels.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.window_lists import add, more_room
from cython.cimports.heat_igl.kernels.window_sources import apart, relax
from cython.cimports.heat_igl.kernels.window_structures import (
    AROUND_APEX,
    LEFT_OF_APEX,
    NARROW,
    NEAR,
    RIGHT_OF_APEX,
    List,
    Search,
    Window,
)
from cython.cimports.heat_igl.kernels.window_trimming import trim
from cython.cimports.libc.math import INFINITY, sqrt


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _bent(w: cython.pointer(Window), at: cython.double, x: cython.double, y: cython.double) -> cython.double:
    """Length of the path through a point of the half-edge to a point of the face."""
    return w.offset + sqrt((at - w.x) * (at - w.x) + w.depth * w.depth) + sqrt((at - x) * (at - x) + y * y)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def cross(s: cython.pointer(Search), h: cython.int) -> cython.void:
    """Carry the windows that wait at half-edge h over its face."""
    place: cython.int = s.slot[h]
    one: cython.pointer(List) = cython.address(s.lists[place])
    windows: cython.pointer(Window) = one.windows
    n: cython.int = one.count
    left: cython.int = previous_half_edge(h)
    right: cython.int = next_half_edge(h)
    i: cython.int
    n_left: cython.int = 0
    n_right: cython.int = 0
    best: cython.int = -1
    best_at: cython.double = 0.0
    length: cython.double = s.length[h]
    left_length: cython.double = s.length[left]
    right_length: cython.double = s.length[right]
    apex_x: cython.double
    apex_y: cython.double
    cos_left: cython.double
    sin_left: cython.double
    cos_right: cython.double
    sin_right: cython.double
    x: cython.double
    m: cython.double
    a: cython.double
    b: cython.double
    nearest: cython.double = INFINITY
    distance: cython.double
    out: cython.pointer(Window)
    w: cython.pointer(Window)
    apex: cython.int = s.vertex[h]
    s.slot[h] = -1
    s.n_lists_done += 1
    n = trim(s, windows, n, h)
    if n > s.n_out:
        more_room(s, n)
        if s.failed:
            return
    apex_x = 0.5 * (length + (left_length - right_length) * (left_length + right_length) / length)
    apex_y = s.double_area[h // 3] / length
    # The apex: which windows see it, and how far it is.
    for i in range(n):
        w = windows + i
        x = apex_x - w.x
        m = apex_y + w.depth
        a = (w.start - w.x) * m - w.depth * x
        b = (w.stop - w.x) * m - w.depth * x
        if b < 0.0:
            w.side = LEFT_OF_APEX
            if b < -NEAR * length * m:
                continue
            b = w.stop
        elif a > 0.0:
            w.side = RIGHT_OF_APEX
            if a > NEAR * length * m:
                continue
            b = w.start
        else:
            w.side = AROUND_APEX
            distance = w.offset + sqrt(x * x + m * m)
            if distance < nearest:
                nearest = distance
                best = i
            continue
        # Just missed: over the end of the window, which costs next to nothing.
        relax(s, apex, _bent(w, b, apex_x, apex_y), w.root, h, b)
    if best >= 0:
        w = windows + best
        best_at = w.x + w.depth * (apex_x - w.x) / (apex_y + w.depth)
        relax(s, apex, nearest, w.root, h, best_at)
    if s.first_target != cython.NULL and s.first_target[h // 3] >= 0:
        _measure(s, h, windows, n, apex_x, apex_y)
    cos_left, sin_left = apex_x / left_length, apex_y / left_length
    cos_right, sin_right = (length - apex_x) / right_length, apex_y / right_length
    out = s.to_left
    for i in range(n):
        w = windows + i
        if w.side == RIGHT_OF_APEX:
            continue
        if (
            best >= 0
            and i != best
            and w.start >= best_at
            and (w.side == AROUND_APEX or nearest <= _bent(w, w.stop, apex_x, apex_y))
        ):
            continue  # would cross a shorter way to the apex
        out.depth = w.x * sin_left + w.depth * cos_left
        if out.depth <= 0.0:
            continue
        out.x = w.x * cos_left - w.depth * sin_left
        a = w.depth * cos_left
        out.start = w.start * w.depth / (a - (w.start - w.x) * sin_left)
        out.stop = left_length
        if w.side == LEFT_OF_APEX:
            out.stop = w.stop * w.depth / (a - (w.stop - w.x) * sin_left)
            if out.stop > left_length:
                out.stop = left_length
        if not (out.stop - out.start > NARROW * left_length):
            continue
        out.offset = w.offset
        out.root = w.root
        out += 1
        n_left += 1
    out = s.to_right
    for i in range(n):
        w = windows + i
        if w.side == LEFT_OF_APEX:
            continue
        if (
            best >= 0
            and i != best
            and w.stop <= best_at
            and (w.side == AROUND_APEX or nearest <= _bent(w, w.start, apex_x, apex_y))
        ):
            continue
        x = length - w.x
        out.depth = x * sin_right + w.depth * cos_right
        if out.depth <= 0.0:
            continue
        out.x = right_length - (x * cos_right - w.depth * sin_right)
        a = w.depth * cos_right
        out.stop = right_length - (length - w.stop) * w.depth / (a + (w.stop - w.x) * sin_right)
        out.start = 0.0
        if w.side == RIGHT_OF_APEX:
            out.start = right_length - (length - w.start) * w.depth / (a + (w.start - w.x) * sin_right)
            if out.start < 0.0:
                out.start = 0.0
        if not (out.stop - out.start > NARROW * right_length):
            continue
        out.offset = w.offset
        out.root = w.root
        out += 1
        n_right += 1
    # The list is free again; its room stays with it.
    s.lists[place].count = s.free_list
    s.lists[place].half_edge = -1
    s.free_list = place
    if n_left > 0:
        add(s, left, s.to_left, n_left, True)
    if n_right > 0:
        add(s, right, s.to_right, n_right, False)


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
            at = w.x + w.depth * (x - w.x) / (y + w.depth)
            if at < w.start:
                if at < w.start - NEAR * length:
                    continue
                at = w.start
            if at > w.stop:
                if at > w.stop + NEAR * length:
                    continue
                at = w.stop
            distance = _bent(w, at, x, y)
            if y == 0.0:
                # On the side itself: the path is known better, with its last face, to the copy in the face before.
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
    k: cython.int
    v: cython.int
    corner: cython.double[3]
    distance: cython.double
    for c in range(3):
        for k in range(3):
            corner[k] = 1.0 if k == c else 0.0
        v = s.vertex[3 * f + c]
        distance = s.distance[v] + apart(s, f, corner, s.target + 3 * j)
        if distance < s.target_distance[j]:
            s.target_distance[j] = distance
            s.target_root[j] = v
            s.target_entered[j] = -1
