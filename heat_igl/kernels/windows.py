"""Exact polyhedral distance by windows (draft)."""

import cython
from cython.cimports.libc.math import INFINITY, fabs, sqrt
from cython.cimports.libc.stdlib import free, malloc, realloc
from cython.cimports.libc.string import memcpy, memmove

__all__ = ["search", "shapes"]


def shapes(
    vertex: cython.int[::1],
    length: cython.double[::1],
    twin: cython.int[::1],
    double_area: cython.double[::1],
    bulge: cython.double[::1],
    corner_of_vertex: cython.int[::1],
    next_corner: cython.int[::1],
    kind: cython.uchar[::1],
) -> bool:
    m: cython.int = double_area.shape[0]
    f: cython.int
    h: cython.int
    c: cython.int
    v: cython.int
    a: cython.double
    b: cython.double
    d: cython.double
    area: cython.double
    worst: cython.double = 0.0
    sum_: cython.double
    with cython.nogil:
        for f in range(m):
            h = 3 * f
            a, b, d = length[h], length[h + 1], length[h + 2]
            area = _double_area(a, b, d)
            double_area[f] = area
            bulge[h] = a * (b * b + d * d - a * a) / (2.0 * area)
            bulge[h + 1] = b * (a * a + d * d - b * b) / (2.0 * area)
            bulge[h + 2] = d * (a * a + b * b - d * d) / (2.0 * area)
            for c in range(3):
                v = vertex[h + c]
                next_corner[h + c] = corner_of_vertex[v]
                corner_of_vertex[v] = h + c
        for h in range(3 * m):
            if twin[h] > h:
                sum_ = (bulge[h] + bulge[twin[h]]) / length[h]
                if sum_ < worst:
                    worst = sum_
            elif twin[h] == -2:
                kind[vertex[_next(h)]] = JOINS
                kind[vertex[_previous(h)]] = JOINS
                worst = -1.0
    return worst > -1e-6


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _double_area(a: cython.double, b: cython.double, c: cython.double) -> cython.double:
    """Twice the area of a triangle by its sides: Heron's formula as a product of differences."""
    s: cython.double = 0.5 * (a + b + c)
    product: cython.double = s * (s - a) * (s - b) * (s - c)
    return 2.0 * sqrt(product) if product > 0.0 else 0.0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _next(h: cython.int) -> cython.int:
    return h - 2 if h % 3 == 2 else h + 1


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _previous(h: cython.int) -> cython.int:
    return h + 2 if h % 3 == 0 else h - 1


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _third(k: cython.int, side: cython.int) -> cython.int:
    """The half-edge of a face that is neither k nor side."""
    return 9 * (k // 3) + 3 - k - side


# ---- the queue


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _push(s: cython.pointer(Search), key: cython.double, what: cython.int) -> cython.void:
    i: cython.int
    above: cython.int
    if s.n_heap == s.n_all_heap:
        more: cython.pointer(Entry) = cython.cast(
            cython.pointer(Entry), realloc(s.heap, 2 * s.n_all_heap * cython.sizeof(Entry))
        )
        if more == cython.NULL:
            s.failed = True
            return
        s.heap = more
        s.n_all_heap *= 2
    i = s.n_heap
    s.n_heap += 1
    while i > 0:
        above = (i - 1) // 2
        if s.heap[above].key <= key:
            break
        s.heap[i] = s.heap[above]
        i = above
    s.heap[i].key = key
    s.heap[i].what = what


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _pop(s: cython.pointer(Search)) -> Entry:
    top: Entry = s.heap[0]
    last: Entry
    i: cython.int = 0
    below: cython.int
    s.n_heap -= 1
    last = s.heap[s.n_heap]
    while True:
        below = 2 * i + 1
        if below >= s.n_heap:
            break
        if below + 1 < s.n_heap and s.heap[below + 1].key < s.heap[below].key:
            below += 1
        if s.heap[below].key >= last.key:
            break
        s.heap[i] = s.heap[below]
        i = below
    s.heap[i] = last
    return top


# ---- vertices


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _classify(s: cython.pointer(Search), v: cython.int) -> cython.uchar:
    """Walk around v; whether its faces are one fan, and whether the angles exceed 2 pi."""
    start: cython.int = s.corner_of_vertex[v]
    k: cython.int = start
    side: cython.int
    t: cython.int
    e: cython.int
    n_corners: cython.int = 0
    n_seen: cython.int = 0
    n_turns: cython.int = 0
    is_tail: cython.bint
    is_open: cython.bint = False
    re: cython.double = 1.0
    im: cython.double = 0.0
    c: cython.double
    d: cython.double
    w: cython.double
    p: cython.double
    q: cython.double
    norm: cython.double
    while k >= 0:
        n_corners += 1
        k = s.next_corner[k]
    k = start
    side = _previous(k)  # v is its tail
    is_tail = True
    while n_seen < n_corners:
        n_seen += 1
        e = _third(k, side)
        # the angle at k
        p = s.length[side]
        q = s.length[e]
        w = 0.5 / (p * q)
        c = (p * p + q * q - s.length[k] * s.length[k]) * w
        d = 2.0 * s.double_area[k // 3] * w
        norm = re * c - im * d
        d = re * d + im * c
        re = norm
        if (d < 0.0) != (im < 0.0):
            n_turns += 1
        im = d
        # over side e to the next face
        is_tail = e == _previous(k)
        t = s.twin[e]
        if t < 0:
            is_open = True
            break
        if s.aligned[e]:
            is_tail = not is_tail
        k = _next(t) if is_tail else _previous(t)
        side = t
        if k == start:
            break
    if is_open:
        # the other way, only counting
        k = start
        side = _next(start)
        e = side
        is_tail = False
        while True:
            t = s.twin[e]
            if t < 0:
                break
            if s.aligned[e]:
                is_tail = not is_tail
            k = _next(t) if is_tail else _previous(t)
            n_seen += 1
            e = _third(k, t)
            is_tail = e == _previous(k)
        return ENDS if n_seen == n_corners else JOINS
    if n_seen != n_corners:
        return JOINS
    # n_turns counts how often the direction crossed the axis: at pi, at 2 pi, ...
    if n_turns >= 3:
        return BENDS
    if n_turns == 2 and (im > 1e-8 or re < 0.0):
        return BENDS
    return PASSED


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _relax(
    s: cython.pointer(Search),
    v: cython.int,
    distance: cython.double,
    root: cython.int,
    entered: cython.int,
    crossing: cython.double,
) -> cython.void:
    if distance >= s.distance[v]:
        return
    if s.distance[v] == INFINITY:
        s.touched[s.n_touched] = v
        s.n_touched += 1
    s.distance[v] = distance
    s.root[v] = root
    s.label[v] = s.label[root]
    s.entered[v] = entered
    s.crossing[v] = crossing
    if s.kind[v] == UNKNOWN:
        s.kind[v] = _classify(s, v)
    if s.kind[v] != PASSED:
        _push(s, distance, s.n_half_edges + v)


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
    right: cython.double = s.length[_previous(k)]  # tail to apex
    left: cython.double = s.length[_next(k)]
    if s.twin[k] == -1:
        return
    one.x = length - 0.5 * (length + (right - left) * (right + left) / length)
    one.depth = s.double_area[k // 3] / length
    one.start = length - stop if stop < length else 0.0
    one.stop = length - start if start > 0.0 else length
    one.offset = offset
    one.root = root
    one.side = 0
    if one.depth > 0.0:
        _add(s, k, cython.address(one), 1, False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _emit_corner(s: cython.pointer(Search), k: cython.int, root: cython.int, offset: cython.double) -> cython.void:
    _relax(s, s.vertex[_next(k)], offset + s.length[_previous(k)], root, _next(k), s.length[_next(k)])
    _relax(s, s.vertex[_previous(k)], offset + s.length[_next(k)], root, _previous(k), 0.0)
    _emit(s, k, 0.0, s.length[k], root, offset)



@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _turn_to_straight(
    s: cython.pointer(Search),
    k: cython.int,
    e: cython.int,
    re: cython.double,
    im: cython.double,
    out: cython.pointer(Ray),
) -> cython.bint:
    """From corner k over its side e, turned by (re, im) so far, to the corner that holds angle pi; whether there is one."""
    t: cython.int
    is_tail: cython.bint
    n_steps: cython.int = 0
    p: cython.double
    q: cython.double
    w: cython.double
    c: cython.double
    d: cython.double
    x: cython.double
    y: cython.double
    while n_steps < 1000000:
        n_steps += 1
        t = s.twin[e]
        if t < 0:
            return False
        is_tail = e == _previous(k)
        if s.aligned[e]:
            is_tail = not is_tail
        k = _next(t) if is_tail else _previous(t)
        e = _third(k, t)
        p = s.length[t]
        q = s.length[e]
        w = 0.5 / (p * q)
        c = (p * p + q * q - s.length[k] * s.length[k]) * w
        d = 2.0 * s.double_area[k // 3] * w
        x = re * c - im * d
        y = re * d + im * c
        if y < 0.0:
            out.corner = k
            out.side = t
            out.cosine = -re
            out.sine = im
            return True
        re = x
        im = y
    return False


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach(s: cython.pointer(Search), ray: cython.pointer(Ray)) -> cython.double:
    """How far along the half-edge opposite the ray's corner, from its end on the ray's side, the ray meets it."""
    k: cython.int = ray.corner
    length: cython.double = s.length[k]
    p: cython.double = s.length[ray.side]
    q: cython.double = s.length[_third(k, ray.side)]
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
def _fill(s: cython.pointer(Search), v: cython.int, first: cython.pointer(Ray), last: cython.pointer(Ray)) -> cython.void:
    """Windows from v between two rays, or from the first ray to the boundary."""
    k: cython.int = first.corner
    side: cython.int = first.side
    e: cython.int
    t: cython.int
    is_tail: cython.bint
    near: cython.double
    far: cython.double
    length: cython.double
    offset: cython.double = s.distance[v]
    n_steps: cython.int = 0
    while n_steps < 1000000:
        e = _third(k, side)
        length = s.length[k]
        near = 0.0
        far = length
        if n_steps == 0:
            near = _reach(s, first) - SHADOW_MARGIN * length
        if last != cython.NULL and k == last.corner:
            far = length - _reach(s, last) + SHADOW_MARGIN * length
        n_steps += 1
        _relax(s, s.vertex[_next(k)], offset + s.length[_previous(k)], v, _next(k), s.length[_next(k)])
        _relax(s, s.vertex[_previous(k)], offset + s.length[_next(k)], v, _previous(k), 0.0)
        if near < far:
            if side == _previous(k):
                _emit(s, k, near, far, v, offset)
            else:
                _emit(s, k, length - far, length - near, v, offset)
        if last != cython.NULL and k == last.corner:
            return
        t = s.twin[e]
        if t < 0:
            return
        is_tail = e == _previous(k)
        if s.aligned[e]:
            is_tail = not is_tail
        k = _next(t) if is_tail else _previous(t)
        side = t


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _shed(s: cython.pointer(Search), v: cython.int) -> cython.void:
    """Windows from vertex v into all directions in which a shortest path can go on."""
    k: cython.int
    h: cython.int = s.entered[v]
    length: cython.double
    x: cython.double
    y: cython.double
    at: cython.double
    dot: cython.double
    cross: cython.double
    norm: cython.double
    left: Ray
    right: Ray
    has_left: cython.bint
    has_right: cython.bint
    s.emitted[v] = s.distance[v]
    s.n_emissions += 1
    if h < 0 or s.kind[v] == JOINS:
        k = s.corner_of_vertex[v]
        while k >= 0:
            _emit_corner(s, k, v, s.distance[v])
            k = s.next_corner[k]
        return
    # From the apex of h: the direction back to where the path crosses h, and its angles to the two sides.
    length = s.length[h]
    at = s.crossing[v]
    right_side: cython.double = s.length[_next(h)]
    left_side: cython.double = s.length[_previous(h)]
    x = 0.5 * (length + (left_side - right_side) * (left_side + right_side) / length)
    y = s.double_area[h // 3] / length
    norm = sqrt((at - x) * (at - x) + y * y)
    dot = (x * (x - at) + y * y) / (norm * left_side)
    cross = y * at / (norm * left_side)
    has_left = _turn_to_straight(s, h, _previous(h), dot, cross, cython.address(left))
    dot = ((length - x) * (at - x) + y * y) / (norm * right_side)
    cross = y * (length - at) / (norm * right_side)
    has_right = _turn_to_straight(s, h, _next(h), dot, cross, cython.address(right))
    if has_left and has_right:
        # Around a closed fan both rays bound one shadow; in an open one there are two, each up to the boundary.
        _fill(s, v, cython.address(left), cython.address(right))
        if s.kind[v] == ENDS:
            _fill(s, v, cython.address(right), cython.NULL)
    elif has_left:
        _fill(s, v, cython.address(left), cython.NULL)
    elif has_right:
        _fill(s, v, cython.address(right), cython.NULL)


# ---- lists


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _append(
    s: cython.pointer(Search),
    t: cython.int,
    run: cython.pointer(Window),
    n: cython.int,
    in_front: cython.bint,
    mirrored: cython.bint,
) -> cython.void:
    """Add windows to those that wait at half-edge t."""
    i: cython.int
    place: cython.int = s.slot[t]
    capacity: cython.int
    one: cython.pointer(List)
    to: cython.pointer(Window)
    length: cython.double = s.length[t]
    bulge: cython.double = s.bulge[t]
    key: cython.double
    lowest: cython.double = INFINITY
    x: cython.double
    if place < 0:
        place = _free_list(s)
        if place < 0:
            return
        s.slot[t] = place
        s.lists[place].half_edge = t
        s.lists[place].count = 0
        s.lists[place].key = INFINITY
    one = cython.address(s.lists[place])
    if one.count + n > one.capacity:
        capacity = 2 * (one.count + n) + 4
        to = cython.cast(cython.pointer(Window), realloc(one.windows, capacity * cython.sizeof(Window)))
        if to == cython.NULL:
            s.failed = True
            return
        one.windows = to
        one.capacity = capacity
    if in_front != mirrored:
        if one.count > 0:
            memmove(one.windows + n, one.windows, one.count * cython.sizeof(Window))
        to = one.windows
    else:
        to = one.windows + one.count
    one.count += n
    s.n_windows += n
    s.n_live += n
    if s.n_live > s.most_live:
        s.most_live = s.n_live
    if mirrored:
        for i in range(n):
            to[i] = run[n - 1 - i]
            to[i].x = length - to[i].x
            x = to[i].start
            to[i].start = length - to[i].stop
            to[i].stop = length - x
    else:
        memcpy(to, run, n * cython.sizeof(Window))
    if s.is_delaunay:
        for i in range(n):
            key = to[i].x * (to[i].x - length) + to[i].depth * (to[i].depth + bulge)
            key = to[i].offset + (sqrt(key) if key > 0.0 else 0.0)
            if key < lowest:
                lowest = key
    else:
        for i in range(n):
            x = 0.0
            if to[i].x < to[i].start:
                x = to[i].start - to[i].x
            elif to[i].x > to[i].stop:
                x = to[i].x - to[i].stop
            key = to[i].offset + sqrt(x * x + to[i].depth * to[i].depth)
            if key < lowest:
                lowest = key
    if lowest < one.key:
        one.key = lowest
        _push(s, lowest, t)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _free_list(s: cython.pointer(Search)) -> cython.int:
    place: cython.int = s.free_list
    more: cython.pointer(List)
    if place >= 0:
        s.free_list = s.lists[place].count
        return place
    if s.n_lists == s.n_all_lists:
        more = cython.cast(cython.pointer(List), realloc(s.lists, 2 * s.n_all_lists * cython.sizeof(List)))
        if more == cython.NULL:
            s.failed = True
            return -1
        s.lists = more
        s.n_all_lists *= 2
    place = s.n_lists
    s.n_lists += 1
    s.lists[place].windows = cython.NULL
    s.lists[place].capacity = 0
    return place


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _add(
    s: cython.pointer(Search), e: cython.int, run: cython.pointer(Window), n: cython.int, in_front: cython.bint
) -> cython.void:
    """Windows over half-edge e, out of its face; their frame runs from the head of e to its tail."""
    t: cython.int = s.twin[e]
    if t >= 0:
        _append(s, t, run, n, in_front, not s.aligned[e])
    elif t == -2:
        t = s.ring[e]
        while t != e:
            _append(s, t, run, n, in_front, s.vertex[_next(t)] == s.vertex[_next(e)])
            t = s.ring[t]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _settle(u: cython.pointer(Window), w: cython.pointer(Window)) -> cython.int:
    """Cut two windows of one half-edge where the other is nearer. 1: u is gone, 2: w is gone, 4: w comes before u."""
    low: cython.double = u.start if u.start > w.start else w.start
    high: cython.double = u.stop if u.stop < w.stop else w.stop
    a: cython.double
    b: cython.double
    p: cython.double
    q: cython.double
    at_low: cython.double
    at_high: cython.double
    slope_low: cython.double
    slope_high: cython.double
    better: cython.int = 0
    x: cython.double
    y: cython.double
    difference: cython.double
    n_steps: cython.int
    if low >= high:
        return 4 if w.stop <= u.start else 0
    if high - low < 0.2 * (u.stop - u.start) and high - low < 0.2 * (w.stop - w.start):
        return 0
    difference = u.offset - w.offset
    if difference == 0.0:
        # |x - u|^2 - |x - w|^2 = b - a x
        a = 2.0 * (u.x - w.x)
        b = (u.x - w.x) * (u.x + w.x) + (u.depth - w.depth) * (u.depth + w.depth)
        at_low = b - a * low
        at_high = b - a * high
        if at_low <= 0.0 and at_high <= 0.0:
            better = 1
        elif at_low >= 0.0 and at_high >= 0.0:
            better = 2
        else:
            x = b / a
    else:
        p = low - u.x
        q = low - w.x
        a = sqrt(p * p + u.depth * u.depth)
        b = sqrt(q * q + w.depth * w.depth)
        at_low = difference + a - b
        slope_low = p * b - q * a
        p = high - u.x
        q = high - w.x
        a = sqrt(p * p + u.depth * u.depth)
        b = sqrt(q * q + w.depth * w.depth)
        at_high = difference + a - b
        slope_high = p * b - q * a
        # The difference has at most one extremum, where the line through both roots meets the half-edge.
        if at_low <= 0.0 and at_high <= 0.0:
            if slope_low <= 0.0 or slope_high >= 0.0:
                better = 1
            else:
                p = u.x - w.x
                q = u.depth - w.depth
                if difference <= 0.0 and p * p + q * q <= difference * difference:
                    better = 1
                else:
                    return 0
        elif at_low >= 0.0 and at_high >= 0.0:
            if slope_low >= 0.0 or slope_high <= 0.0:
                better = 2
            else:
                p = u.x - w.x
                q = u.depth - w.depth
                if difference >= 0.0 and p * p + q * q <= difference * difference:
                    better = 2
                else:
                    return 0
        else:
            # One root: a few steps of Newton's method inside the bracket.
            p = low
            q = high
            y = at_low
            x = low + (high - low) * at_low / (at_low - at_high)
            for n_steps in range(8):
                a = sqrt((x - u.x) * (x - u.x) + u.depth * u.depth)
                b = sqrt((x - w.x) * (x - w.x) + w.depth * w.depth)
                y = difference + a - b
                if (y < 0.0) == (at_low < 0.0):
                    p = x
                else:
                    q = x
                if fabs(y) <= 1e-15 * (a + u.offset):
                    break
                a = (x - u.x) / a - (x - w.x) / b
                if a != 0.0:
                    x -= y / a
                if not (p < x < q):
                    x = 0.5 * (p + q)
    if better == 1:
        if low <= w.start:
            if high >= w.stop:
                return 2
            w.start = high
            return 0
        if high >= w.stop:
            w.stop = low
            return 4
        return 0
    if better == 2:
        if low <= u.start:
            if high >= u.stop:
                return 1
            u.start = high
            return 4
        if high >= u.stop:
            u.stop = low
        return 0
    if at_low < 0.0:
        # u before x, w behind
        if high >= u.stop:
            u.stop = x
        if low <= w.start:
            w.start = x
        return 0
    if high >= w.stop:
        w.stop = x
    if low <= u.start:
        u.start = x
    return 4


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _trim(s: cython.pointer(Search), windows: cython.pointer(Window), n: cython.int, h: cython.int) -> cython.int:
    """Cut from windows what a path over an end of the half-edge or another window makes useless; how many are left."""
    i: cython.int
    j: cython.int
    k: cython.int = 0
    outcome: cython.int
    w: Window
    u: Window
    length: cython.double = s.length[h]
    from_tail: cython.double = s.distance[s.vertex[_next(h)]]
    from_head: cython.double = s.distance[s.vertex[_previous(h)]]
    narrow: cython.double = NARROW * length
    a: cython.double
    b: cython.double
    p: cython.double
    q: cython.double
    r: cython.double
    square: cython.double
    is_gone: cython.bint
    from_tail += s.tolerance * from_tail
    from_head += s.tolerance * from_head
    from_head += length
    for i in range(n):
        w = windows[i]
        square = w.depth * w.depth
        a = from_tail - w.offset
        b = from_head - w.offset
        p = (w.start - w.x) * (w.start - w.x) + square
        q = (w.stop - w.x) * (w.stop - w.x) + square
        r = a + w.stop
        if r < 0.0 or q > r * r:
            continue
        r = b - w.start
        if r < 0.0 or p > r * r:
            continue
        r = a + w.start
        if r < 0.0 or p > r * r:
            r = 2.0 * (a + w.x)
            if r > 0.0:
                r = (w.x * w.x + square - a * a) / r
                if r > w.start:
                    w.start = r
        r = b - w.stop
        if r < 0.0 or q > r * r:
            r = 2.0 * (b - w.x)
            if r > 0.0:
                r = (b * b - w.x * w.x - square) / r
                if r < w.stop:
                    w.stop = r
        if w.stop - w.start <= narrow:
            continue
        is_gone = False
        j = k
        while j > 0:
            outcome = _settle(cython.address(windows[j - 1]), cython.address(w))
            if outcome == 1 or windows[j - 1].stop - windows[j - 1].start <= narrow:
                # remove j - 1
                if j < k:
                    memmove(windows + (j - 1), windows + j, (k - j) * cython.sizeof(Window))
                k -= 1
                j -= 1
                if outcome == 2:
                    is_gone = True
                    break
                continue
            if outcome == 2 or w.stop - w.start <= narrow:
                is_gone = True
                break
            if outcome == 4:
                j -= 1
                continue
            break
        if is_gone:
            continue
        if j < k:
            memmove(windows + (j + 1), windows + j, (k - j) * cython.sizeof(Window))
        elif j > 0 and fabs(windows[j - 1].x - w.x) <= SAME * (fabs(w.x) + w.depth):
            # Two halves that passed a flat vertex are one again.
            if (
                windows[j - 1].root == w.root
                and windows[j - 1].offset == w.offset
                and fabs(windows[j - 1].depth - w.depth) <= SAME * (fabs(w.x) + w.depth)
                and windows[j - 1].start <= w.start <= windows[j - 1].stop + narrow
            ):
                if w.stop > windows[j - 1].stop:
                    windows[j - 1].stop = w.stop
                continue
        windows[j] = w
        k += 1
    return k


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _bent(w: cython.pointer(Window), at: cython.double, x: cython.double, y: cython.double) -> cython.double:
    """Length of the path through a point of the half-edge to a point of the face."""
    return (
        w.offset
        + sqrt((at - w.x) * (at - w.x) + w.depth * w.depth)
        + sqrt((at - x) * (at - x) + y * y)
    )


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _cross(s: cython.pointer(Search), h: cython.int) -> cython.void:
    """Carry the windows that wait at half-edge h over its face."""
    place: cython.int = s.slot[h]
    one: cython.pointer(List) = cython.address(s.lists[place])
    windows: cython.pointer(Window) = one.windows
    n: cython.int = one.count
    left: cython.int = _previous(h)
    right: cython.int = _next(h)
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
    s.n_live -= n
    s.slot[h] = -1
    s.n_lists_done += 1
    n = _trim(s, windows, n, h)
    if n > s.n_out:
        _more_room(s, n)
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
        _relax(s, apex, _bent(w, b, apex_x, apex_y), w.root, h, b)
    if best >= 0:
        w = windows + best
        best_at = w.x + w.depth * (apex_x - w.x) / (apex_y + w.depth)
        _relax(s, apex, nearest, w.root, h, best_at)
    if s.first_target != cython.NULL and s.first_target[h // 3] >= 0:
        _measure(s, h, windows, n, apex_x, apex_y)
    cos_left, sin_left = apex_x / left_length, apex_y / left_length
    cos_right, sin_right = (length - apex_x) / right_length, apex_y / right_length
    out = s.to_left
    for i in range(n):
        w = windows + i
        if w.side == RIGHT_OF_APEX:
            continue
        if best >= 0 and i != best and w.start >= best_at and (
            w.side == AROUND_APEX or nearest <= _bent(w, w.stop, apex_x, apex_y)
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
        if best >= 0 and i != best and w.stop <= best_at and (
            w.side == AROUND_APEX or nearest <= _bent(w, w.start, apex_x, apex_y)
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
        _add(s, left, s.to_left, n_left, True)
    if n_right > 0:
        _add(s, right, s.to_right, n_right, False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _more_room(s: cython.pointer(Search), n: cython.int) -> cython.void:
    s.n_out = 2 * n
    free(s.to_left)
    free(s.to_right)
    s.to_left = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    s.to_right = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    if s.to_left == cython.NULL or s.to_right == cython.NULL:
        s.failed = True


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
        x = s.target[3 * j + _previous(h) % 3] * length + s.target[3 * j + h % 3] * apex_x
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
            if distance < s.target_distance[j]:
                s.target_distance[j] = distance
                s.target_root[j] = w.root
                s.target_entered[j] = h
                s.target_crossing[j] = at
        j = s.next_target[j]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _apart(s: cython.pointer(Search), f: cython.int, a: cython.p_double, b: cython.p_double) -> cython.double:
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
def _over_corners(s: cython.pointer(Search), j: cython.int) -> cython.void:
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
        distance = s.distance[v] + _apart(s, f, corner, s.target + 3 * j)
        if distance < s.target_distance[j]:
            s.target_distance[j] = distance
            s.target_root[j] = v
            s.target_entered[j] = -1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _emit_point(s: cython.pointer(Search), p: cython.int) -> cython.void:
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
    distance: cython.double
    length: cython.double
    left_length: cython.double
    right_length: cython.double
    for c in range(3):
        h = 3 * f + c
        for i in range(3):
            corner[i] = 1.0 if i == c else 0.0
        _relax(s, s.vertex[h], offset + _apart(s, f, corner, at), root, -1, 0.0)
        if at[c] <= 0.0:
            continue  # on the side itself, the source belongs to the face beyond it too
        length = s.length[h]
        left_length = s.length[_previous(h)]
        right_length = s.length[_next(h)]
        one.x = at[c] * 0.5 * (length + (left_length - right_length) * (left_length + right_length) / length)
        one.x = length - (one.x + at[_previous(h) % 3] * length)
        one.depth = at[c] * s.double_area[f] / length
        one.start = 0.0
        one.stop = length
        one.offset = offset
        one.root = root
        one.side = 0
        if one.depth > 0.0:
            _add(s, h, cython.address(one), 1, False)
    j = s.first_target[f] if s.first_target != cython.NULL else -1
    while j >= 0:
        distance = offset + _apart(s, f, s.target + 3 * j, at)
        if distance < s.target_distance[j]:
            s.target_distance[j] = distance
            s.target_root[j] = root
            s.target_entered[j] = -1
        j = s.next_target[j]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _all_found(s: cython.pointer(Search), key: cython.double) -> cython.bint:
    """Whether no window with this key or a later one can come nearer to what is asked for."""
    j: cython.int
    while s.n_found < s.n_goals:
        if s.distance[s.goal[s.n_found]] > key:
            return False
        s.n_found += 1
    while s.n_found < s.n_goals + s.n_targets:
        j = s.n_found - s.n_goals
        _over_corners(s, j)
        # A window may lead to a point of a face before it has left the circle around the face.
        if s.target_distance[j] + s.slack > key:
            return False
        s.n_found += 1
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _run(s: cython.pointer(Search), cutoff: cython.double) -> cython.void:
    entry: Entry
    v: cython.int
    j: cython.int
    place: cython.int
    while s.n_heap > 0 and not s.failed:
        entry = _pop(s)
        if entry.key > cutoff + s.slack:
            break
        if s.stops_early and _all_found(s, entry.key):
            break
        if entry.what < s.n_half_edges:
            place = s.slot[entry.what]
            if place >= 0 and s.lists[place].key == entry.key:
                _cross(s, entry.what)
            continue
        v = entry.what - s.n_half_edges
        if v >= s.n:
            _emit_point(s, v - s.n)
        elif entry.key == s.distance[v] and s.emitted[v] > entry.key:
            _shed(s, v)
    for j in range(s.n_targets):
        _over_corners(s, j)


def search(
    vertex: cython.int[::1],
    length: cython.double[::1],
    twin: cython.int[::1],
    aligned: cython.uchar[::1],
    ring: cython.int[::1],
    double_area: cython.double[::1],
    bulge: cython.double[::1],
    corner_of_vertex: cython.int[::1],
    next_corner: cython.int[::1],
    kind: cython.uchar[::1],
    is_delaunay: bool,
    source: cython.int[::1],
    offset: cython.double[::1],
    point_face: cython.int[::1],
    point: cython.double[::1],
    point_offset: cython.double[::1],
    distance: cython.double[::1],
    emitted: cython.double[::1],
    root: cython.int[::1],
    label: cython.int[::1],
    entered: cython.int[::1],
    crossing: cython.double[::1],
    touched: cython.int[::1],
    slot: cython.int[::1],
    goal: cython.int[::1],
    first_target: cython.int[::1],
    next_target: cython.int[::1],
    target_face: cython.int[::1],
    target: cython.double[::1],
    target_distance: cython.double[::1],
    target_root: cython.int[::1],
    target_entered: cython.int[::1],
    target_crossing: cython.double[::1],
    slack: cython.double,
    stops_early: bool,
    cutoff: cython.double,
    tolerance: cython.double,
    statistics: cython.longlong[::1],
) -> bool:
    s: Search
    i: cython.int
    v: cython.int
    s.vertex = cython.address(vertex[0])
    s.length = cython.address(length[0])
    s.twin = cython.address(twin[0])
    s.aligned = cython.address(aligned[0])
    s.ring = cython.address(ring[0])
    s.double_area = cython.address(double_area[0])
    s.bulge = cython.address(bulge[0])
    s.corner_of_vertex = cython.address(corner_of_vertex[0])
    s.next_corner = cython.address(next_corner[0])
    s.kind = cython.address(kind[0])
    s.is_delaunay = is_delaunay
    s.n = corner_of_vertex.shape[0]
    s.n_half_edges = vertex.shape[0]
    s.distance = cython.address(distance[0])
    s.root = cython.address(root[0])
    s.label = cython.address(label[0])
    s.entered = cython.address(entered[0])
    s.crossing = cython.address(crossing[0])
    s.emitted = cython.address(emitted[0])
    s.touched = cython.address(touched[0])
    s.slot = cython.address(slot[0])
    s.n_points = point_face.shape[0]
    if s.n_points > 0:
        s.point_face = cython.address(point_face[0])
        s.point = cython.address(point[0])
        s.point_offset = cython.address(point_offset[0])
    s.n_goals = goal.shape[0]
    if s.n_goals > 0:
        s.goal = cython.address(goal[0])
    s.n_targets = target_face.shape[0]
    s.first_target = cython.NULL
    if s.n_targets > 0:
        s.first_target = cython.address(first_target[0])
        s.next_target = cython.address(next_target[0])
        s.target_face = cython.address(target_face[0])
        s.target = cython.address(target[0])
        s.target_distance = cython.address(target_distance[0])
        s.target_root = cython.address(target_root[0])
        s.target_entered = cython.address(target_entered[0])
        s.target_crossing = cython.address(target_crossing[0])
    s.stops_early = stops_early
    s.slack = slack
    s.tolerance = tolerance
    s.n_touched = s.n_found = 0
    s.n_lists = s.n_heap = 0
    s.n_all_lists, s.n_all_heap, s.n_out = 256, 1024, 256
    s.free_list = -1
    s.failed = False
    s.n_windows = s.n_lists_done = s.n_emissions = s.n_live = s.most_live = 0
    with cython.nogil:
        s.lists = cython.cast(cython.pointer(List), malloc(s.n_all_lists * cython.sizeof(List)))
        s.heap = cython.cast(cython.pointer(Entry), malloc(s.n_all_heap * cython.sizeof(Entry)))
        s.to_left = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
        s.to_right = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
        if s.lists == cython.NULL or s.heap == cython.NULL or s.to_left == cython.NULL or s.to_right == cython.NULL:
            s.failed = True
        for i in range(source.shape[0]):
            v = source[i]
            if not s.failed and offset[i] < distance[v]:
                if distance[v] == INFINITY:
                    touched[s.n_touched] = v
                    s.n_touched += 1
                distance[v] = offset[i]
                root[v] = v
                label[v] = i
                entered[v] = -1
                _push(cython.address(s), offset[i], s.n_half_edges + v)
        for i in range(s.n_points):
            if not s.failed:
                label[s.n + i] = source.shape[0] + i
                _push(cython.address(s), point_offset[i], s.n_half_edges + s.n + i)
        if not s.failed:
            _run(cython.address(s), cutoff)
        for i in range(s.n_lists):
            if s.lists[i].half_edge >= 0:
                slot[s.lists[i].half_edge] = -1
            free(s.lists[i].windows)
        free(s.lists)
        free(s.heap)
        free(s.to_left)
        free(s.to_right)
    statistics[0] = s.n_touched
    statistics[1] = s.n_windows
    statistics[2] = s.n_lists_done
    statistics[3] = s.n_emissions
    statistics[4] = s.most_live
    return not s.failed
