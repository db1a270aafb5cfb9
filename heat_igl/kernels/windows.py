"""Exact distance by windows: continuous Dijkstra over the faces of an intrinsic triangulation.

A *window* is the part of a half-edge that straight lines from one root cross, all through the same faces; the root laid
out in the plane before the half-edge gives the distance of every point of the window (Mitchell, Mount, Papadimitriou
1987). Windows that enter a face over the same side wait there in one list and cross the face together, as in Qin et al.
2016. What is different here is the order. The square of the key of a list is the power of the root with respect to the
circle around the face that is entered next. On a Delaunay triangulation that power grows along every straight line from
the root, it is no larger than the square of the distance of any vertex ahead, and it sorts faces from front to back.
So a list is nearly always complete when its turn comes, a face is crossed once from each side, and no vertex can come
nearer than the key. On other triangulations the key is the distance of the nearest point of the windows.

Before a list crosses its face, windows lose what is nearer over an end of the side (Xin and Wang 2009), what another
window of the list reaches sooner, and what would cross a shorter way to the corner ahead. A vertex gets windows of its
own where shortest paths can bend: where the angles around it exceed 2 pi, into the directions beyond a straight angle
on both sides; at the boundary; and where faces are not one fan, into all faces.

Half-edge ``3 f + c`` is the side of face f opposite its corner c; the corner carries the same number.
"""

import cython
from cython.cimports.heat_igl.kernels.triangles import next_half_edge, previous_half_edge
from cython.cimports.libc.math import INFINITY, fabs, sqrt
from cython.cimports.libc.stdlib import free, malloc, realloc
from cython.cimports.libc.string import memcpy, memmove

__all__ = ["Front", "search", "search_each", "shapes"]


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
    """Fill what `search` reads of a surface, and say whether it is intrinsic Delaunay.

    Parameters
    ----------
    vertex, length, twin : (3 m,)
        Vertex of each corner, length of each half-edge, and the half-edge glued to it: -1 on the boundary, -2 where
        more than two faces meet.
    double_area : (m,)
        Takes twice the area of each face.
    bulge : (3 m,)
        Takes the length of each half-edge times the cotangent of the angle opposite: the circle around the face has the
        power ``x (x - length) + y (y + bulge)`` at the point (x, -y) of the frame of the half-edge.
    corner_of_vertex, next_corner : (n,), (3 m,)
        Take the corners of each vertex as linked lists that end with -1; the first must come full of -1.
    kind : (n,)
        Takes JOINS at the ends of edges of more than two faces; the rest must come as UNKNOWN.
    """
    m: cython.int = double_area.shape[0]
    f: cython.int
    h: cython.int
    c: cython.int
    v: cython.int
    a: cython.double
    b: cython.double
    d: cython.double
    area: cython.double
    is_delaunay: cython.bint = True
    with cython.nogil:
        for f in range(m):
            h = 3 * f
            a, b, d = length[h], length[h + 1], length[h + 2]
            # A needle without height would have no circle.
            area = _double_area(a, b, d) + 1e-20 * a * a
            double_area[f] = area
            bulge[h] = a * (b * b + d * d - a * a) / (2.0 * area)
            bulge[h + 1] = b * (a * a + d * d - b * b) / (2.0 * area)
            bulge[h + 2] = d * (a * a + b * b - d * d) / (2.0 * area)
            for c in range(3):
                v = vertex[h + c]
                next_corner[h + c] = corner_of_vertex[v]
                corner_of_vertex[v] = h + c
        for h in range(3 * m):
            if twin[h] > h and bulge[h] + bulge[twin[h]] < -1e-6 * length[h]:
                is_delaunay = False
            elif twin[h] == -2:
                kind[vertex[next_half_edge(h)]] = kind[vertex[previous_half_edge(h)]] = JOINS
                is_delaunay = False
    return is_delaunay


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _double_area(a: cython.double, b: cython.double, c: cython.double) -> cython.double:
    """Twice the area of a triangle by its sides: Heron's formula as a product of differences, which needles need."""
    s: cython.double = 0.5 * (a + b + c)
    product: cython.double = s * (s - a) * (s - b) * (s - c)
    return 2.0 * sqrt(product) if product > 0.0 else 0.0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _third(k: cython.int, side: cython.int) -> cython.int:
    """The half-edge of the face that is neither of two others."""
    return 9 * (k // 3) + 3 - k - side


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _push(s: cython.pointer(Search), key: cython.double, what: cython.int) -> cython.void:
    """Add to the queue, a binary heap."""
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
    """Take the entry with the smallest key."""
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


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _beyond(s: cython.pointer(Search), k: cython.int, side: cython.int) -> cython.int:
    """The corner of the same vertex beyond a side of corner k; -1 where there is not just one face."""
    t: cython.int = s.twin[side]
    is_tail: cython.bint = side == previous_half_edge(k)
    if t < 0:
        return -1
    if s.aligned[side]:
        is_tail = not is_tail
    return next_half_edge(t) if is_tail else previous_half_edge(t)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _turn(s: cython.pointer(Search), k: cython.int, side: cython.int, ray: cython.pointer(Ray)) -> cython.void:
    """Turn a direction by the angle of corner k, which has the side `side`."""
    p: cython.double = s.length[side]
    q: cython.double = s.length[_third(k, side)]
    scale: cython.double = 0.5 / (p * q)
    cosine: cython.double = (p * p + q * q - s.length[k] * s.length[k]) * scale
    sine: cython.double = 2.0 * s.double_area[k // 3] * scale
    ray.cosine, ray.sine = ray.cosine * cosine - ray.sine * sine, ray.cosine * sine + ray.sine * cosine


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _classify(s: cython.pointer(Search), v: cython.int) -> cython.uchar:
    """Walk around v: whether its faces are one fan, and whether the angles exceed 2 pi."""
    start: cython.int = s.corner_of_vertex[v]
    k: cython.int = start
    side: cython.int = previous_half_edge(start)
    beyond: cython.int
    n_corners: cython.int = 0
    n_seen: cython.int = 0
    n_half_turns: cython.int = 0
    was_below: cython.bint
    ray: Ray
    while k >= 0:
        n_corners += 1
        k = s.next_corner[k]
    k = start
    ray.cosine, ray.sine = 1.0, 0.0
    while n_seen < n_corners:
        n_seen += 1
        was_below = ray.sine < 0.0
        _turn(s, k, side, cython.address(ray))
        if was_below != (ray.sine < 0.0):
            n_half_turns += 1
        side = _third(k, side)
        beyond = _beyond(s, k, side)
        if beyond < 0:
            break
        k = beyond
        side = s.twin[side]
        if k == start:
            if n_seen < n_corners:
                return JOINS
            # Less than 1e-8 above 2 pi is flat: what a path loses there is the square of it.
            if n_half_turns < 2 or (n_half_turns == 2 and ray.cosine > 0.0 and ray.sine < 1e-8):
                return PASSED
            return BENDS
    # An open fan: from the start to its other end.
    k = start
    side = previous_half_edge(start)
    while n_seen < n_corners:
        k = _beyond(s, k, side)
        if k < 0:
            return JOINS
        n_seen += 1
        side = _third(k, s.twin[side])
    return ENDS


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
    """Take a distance of v if it is shorter than the one known."""
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
    one.side = 0
    if one.depth > 0.0:
        _add(s, k, cython.address(one), 1, False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach_ends(s: cython.pointer(Search), k: cython.int, v: cython.int, offset: cython.double) -> cython.void:
    """Distances along the two sides of corner k from its vertex v."""
    head: cython.int = next_half_edge(k)
    tail: cython.int = previous_half_edge(k)
    _relax(s, s.vertex[head], offset + s.length[tail], v, head, s.length[head])
    _relax(s, s.vertex[tail], offset + s.length[head], v, tail, 0.0)


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
        k = _beyond(s, k, side)
        if k < 0:
            return False
        side = s.twin[side]
        cosine, sine = ray.cosine, ray.sine
        _turn(s, k, side, ray)
        if ray.sine < 0.0:
            ray.corner, ray.side = k, side
            ray.cosine, ray.sine = -cosine, sine
            return True
        side = _third(k, side)


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
        side = _third(k, side)
        k = _beyond(s, k, side)
        side = s.twin[side]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _shed(s: cython.pointer(Search), v: cython.int) -> cython.void:
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
    """A list that is not in use, with the room that it had before; -1 without memory."""
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
    if place == s.n_made_lists:
        s.n_made_lists += 1
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
            _append(s, t, run, n, in_front, s.vertex[next_half_edge(t)] == s.vertex[next_half_edge(e)])
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
    _: cython.int
    if low >= high:
        return 4 if w.stop <= u.start else 0
    if high - low < OVERLAP * (u.stop - u.start) and high - low < OVERLAP * (w.stop - w.start):
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
            for _ in range(8):
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
    length: cython.double = s.length[h]
    from_tail: cython.double = s.distance[s.vertex[next_half_edge(h)]]
    from_head: cython.double = s.distance[s.vertex[previous_half_edge(h)]]
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
        elif (
            j > 0
            and fabs(windows[j - 1].x - w.x) <= SAME * (fabs(w.x) + w.depth)
            and windows[j - 1].root == w.root
            and windows[j - 1].offset == w.offset
            and fabs(windows[j - 1].depth - w.depth) <= SAME * (fabs(w.x) + w.depth)
            and windows[j - 1].start <= w.start <= windows[j - 1].stop + narrow
        ):
            # Two halves that passed a flat vertex are one again.
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
    return w.offset + sqrt((at - w.x) * (at - w.x) + w.depth * w.depth) + sqrt((at - x) * (at - x) + y * y)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _cross(s: cython.pointer(Search), h: cython.int) -> cython.void:
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
        _add(s, left, s.to_left, n_left, True)
    if n_right > 0:
        _add(s, right, s.to_right, n_right, False)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _more_room(s: cython.pointer(Search), n: cython.int) -> cython.void:
    """Room for n windows on each side of an apex."""
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
        left_length = s.length[previous_half_edge(h)]
        right_length = s.length[next_half_edge(h)]
        one.x = at[c] * 0.5 * (length + (left_length - right_length) * (left_length + right_length) / length)
        one.x = length - (one.x + at[previous_half_edge(h) % 3] * length)
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
def _run(s: cython.pointer(Search)) -> cython.void:
    """Carry lists, and let vertices and points shed windows, in ascending order of their keys."""
    entry: Entry
    v: cython.int
    j: cython.int
    place: cython.int
    while s.n_heap > 0 and not s.failed:
        if s.n_nearest > 0 and s.n_touched >= s.n_next:
            _narrow(s)
        entry = _pop(s)
        if entry.key > s.cutoff * (1.0 + MARGIN) + s.slack:
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


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _narrow(s: cython.pointer(Search)) -> cython.void:
    """End the search at the distance within which as many vertices as asked for are known to lie."""
    i: cython.int
    j: cython.int
    low: cython.int = 0
    high: cython.int = s.n_touched - 1
    wanted: cython.int = s.n_nearest - 1
    pivot: cython.double
    if s.n_touched > s.n_all_ranked:
        free(s.ranked)
        s.n_all_ranked = 2 * s.n_touched
        s.ranked = cython.cast(cython.p_double, malloc(s.n_all_ranked * cython.sizeof(cython.double)))
        if s.ranked == cython.NULL:
            s.n_all_ranked = 0
            s.failed = True
            return
    for i in range(s.n_touched):
        s.ranked[i] = s.distance[s.touched[i]]
    # Quickselect, Hoare 1961.
    while low < high:
        pivot = s.ranked[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while s.ranked[i] < pivot:
                i += 1
            while s.ranked[j] > pivot:
                j -= 1
            if i <= j:
                s.ranked[i], s.ranked[j] = s.ranked[j], s.ranked[i]
                i += 1
                j -= 1
        if wanted <= j:
            high = j
        elif wanted >= i:
            low = i
        else:
            break
    if s.ranked[wanted] < s.cutoff:
        s.cutoff = s.ranked[wanted]
    s.n_next = s.n_touched + s.n_nearest // 4 + 1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _allocate(s: cython.pointer(Search)) -> cython.void:
    """Room for a front."""
    s.n_lists = s.n_made_lists = s.n_heap = s.n_touched = s.n_found = 0
    s.n_all_lists, s.n_all_heap, s.n_out = 256, 1024, 256
    s.free_list = -1
    s.failed = False
    s.n_windows = s.n_lists_done = 0
    s.n_nearest = s.n_all_ranked = 0
    s.ranked = cython.NULL
    s.lists = cython.cast(cython.pointer(List), malloc(s.n_all_lists * cython.sizeof(List)))
    s.heap = cython.cast(cython.pointer(Entry), malloc(s.n_all_heap * cython.sizeof(Entry)))
    s.to_left = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    s.to_right = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    if s.lists == cython.NULL or s.heap == cython.NULL or s.to_left == cython.NULL or s.to_right == cython.NULL:
        s.failed = True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _free_front(s: cython.pointer(Search)) -> cython.void:
    i: cython.int
    for i in range(s.n_made_lists):
        free(s.lists[i].windows)
    free(s.lists)
    free(s.heap)
    free(s.to_left)
    free(s.to_right)
    free(s.ranked)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _empty_front(s: cython.pointer(Search)) -> cython.void:
    """Drop all that waits; lists and queue keep their room."""
    i: cython.int
    for i in range(s.n_lists):
        if s.lists[i].half_edge >= 0:
            s.slot[s.lists[i].half_edge] = -1
    s.n_lists = s.n_heap = 0
    s.free_list = -1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _forget(s: cython.pointer(Search)) -> cython.void:
    """Make all that a search wrote what it was before."""
    i: cython.int
    v: cython.int
    _empty_front(s)
    for i in range(s.n_touched):
        v = s.touched[i]
        s.distance[v] = s.emitted[v] = INFINITY
        s.root[v] = s.label[v] = s.entered[v] = -1
    s.n_touched = s.n_found = 0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _start_at(s: cython.pointer(Search), v: cython.int, offset: cython.double, label: cython.int) -> cython.void:
    """Let distance start at vertex v."""
    if s.failed or offset >= s.distance[v]:
        return
    if s.distance[v] == INFINITY:
        s.touched[s.n_touched] = v
        s.n_touched += 1
    s.distance[v] = offset
    s.root[v] = v
    s.label[v] = label
    s.entered[v] = -1
    _push(s, offset, s.n_half_edges + v)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _write_within(
    s: cython.pointer(Search), name: cython.p_longlong, to: cython.p_int, value: cython.p_double
) -> cython.int:
    """All vertices within the cutoff and their distances; how many they are."""
    i: cython.int
    v: cython.int
    n: cython.int = 0
    for i in range(s.n_touched):
        v = s.touched[i]
        if s.distance[v] <= s.cutoff:
            to[n] = name[v]
            value[n] = s.distance[v]
            n += 1
    return n


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _write_nearest(
    s: cython.pointer(Search), name: cython.p_longlong, to: cython.p_int, value: cython.p_double
) -> cython.int:
    """The nearest vertices, of equally near ones those with the lowest names, in order; how many they are."""
    i: cython.int
    j: cython.int
    v: cython.int
    n: cython.int = 0
    d: cython.double
    for i in range(s.n_touched):
        v = s.touched[i]
        d = s.distance[v]
        if d > s.cutoff:
            continue
        if n < s.n_nearest:
            n += 1
        elif d > value[n - 1] or (d == value[n - 1] and name[v] > to[n - 1]):
            continue
        j = n - 1
        while j > 0 and (d < value[j - 1] or (d == value[j - 1] and name[v] < to[j - 1])):
            value[j] = value[j - 1]
            to[j] = to[j - 1]
            j -= 1
        value[j] = d
        to[j] = name[v]
    return n


class Front:
    """A surface, and what searches on it write; `search` and `search_each` say in which state.

    Parameters
    ----------
    vertex, length, twin, double_area, bulge, corner_of_vertex, next_corner, kind
        As `shapes` takes and fills them. `kind` is filled further, the same by every search.
    aligned : (3 m,)
        Whether the faces at a glued half-edge run along it in opposite directions.
    ring : (3 m,)
        Where more than two faces meet, the next half-edge of the same edge.
    is_delaunay : bool
        What `shapes` returned.
    distance, emitted : (n,)
        Must come full of infinity; the first takes distances.
    root, label, entered, crossing : (n,), (n + p,), (n,), (n,)
        Take where the shortest paths come from; see `heat_igl.unfolding.exact.Origin`. They must come full of -1.
    touched : (n,)
        Takes the vertices that were reached.
    slot : (3 m,)
        Must come full of -1, and is again after a search.
    tolerance : float
        The fraction of a distance by which another way must be shorter before a window is cut.
    """

    def __init__(
        self,
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
        distance: cython.double[::1],
        emitted: cython.double[::1],
        root: cython.int[::1],
        label: cython.int[::1],
        entered: cython.int[::1],
        crossing: cython.double[::1],
        touched: cython.int[::1],
        slot: cython.int[::1],
        tolerance: cython.double,
    ) -> None:
        s: cython.pointer(Search) = cython.address(self.state)
        # The pointers hold as long as the arrays do.
        self.arrays = (
            vertex.base,
            length.base,
            twin.base,
            aligned.base,
            ring.base,
            double_area.base,
            bulge.base,
            corner_of_vertex.base,
            next_corner.base,
            kind.base,
            distance.base,
            emitted.base,
            root.base,
            label.base,
            entered.base,
            crossing.base,
            touched.base,
            slot.base,
        )
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
        s.distance = cython.address(distance[0])
        s.emitted = cython.address(emitted[0])
        s.root = cython.address(root[0])
        s.label = cython.address(label[0])
        s.entered = cython.address(entered[0])
        s.crossing = cython.address(crossing[0])
        s.touched = cython.address(touched[0])
        s.slot = cython.address(slot[0])
        s.is_delaunay = is_delaunay
        s.n = corner_of_vertex.shape[0]
        s.n_half_edges = vertex.shape[0]
        s.tolerance = tolerance
        s.n_points = s.n_targets = s.n_goals = 0
        s.first_target = cython.NULL


def search_each(
    front: Front,
    source: cython.int[::1],
    goal: cython.int[::1],
    first_goal: cython.longlong[::1],
    cutoff: cython.double,
    n_nearest: cython.int,
    name: cython.longlong[::1],
    found: cython.int[::1],
    value: cython.double[::1],
    end: cython.longlong[::1],
) -> int:
    """Distances from one vertex after the other, each search ended early; how many sources were done, -1 for no memory.

    What a search touched is cleared after it, so that its cost depends on what is near alone.

    Parameters
    ----------
    front : Front
        In its first state, and in it again afterwards.
    source : (k,)
        Vertices that distance starts from, each alone.
    goal, first_goal : (g,), (k + 1,)
        The distances that are asked for, ``goal[first_goal[i]:first_goal[i + 1]]`` of source i, if there are any.
    cutoff : float
        Otherwise all vertices up to here are asked for,
    n_nearest : int
        and so many at most, the nearest; 0 for all.
    name : (n,)
        What vertices are called in `found`.
    found, value : (r,)
        Take vertices and their distances, source after source. The last source done is the last whose results had room.
    end : (k,)
        Takes where the results of each source end. Results for goals are one value each, and `found` is not used.
    """
    s: cython.pointer(Search) = cython.address(front.state)
    i: cython.int
    j: cython.longlong
    n_done: cython.int = 0
    at: cython.longlong = 0
    room: cython.longlong = value.shape[0]
    names: cython.p_longlong = cython.address(name[0])
    s.stops_early = goal.shape[0] > 0
    s.slack = 0.0
    with cython.nogil:
        _allocate(s)
        for i in range(source.shape[0]):
            s.cutoff = cutoff
            s.n_nearest = s.n_next = n_nearest
            if s.stops_early:
                s.n_goals = cython.cast(cython.int, first_goal[i + 1] - first_goal[i])
                s.goal = cython.address(goal[0]) + first_goal[i]
            _start_at(s, source[i], 0.0, 0)
            if not s.failed:
                _run(s)
            if s.failed:
                break
            if s.stops_early:
                for j in range(first_goal[i], first_goal[i + 1]):
                    value[j] = s.distance[goal[j]]
                at = first_goal[i + 1]
            else:
                if at + (n_nearest if n_nearest > 0 else s.n_touched) > room:
                    break
                if n_nearest > 0:
                    if s.n_touched >= n_nearest:
                        _narrow(s)
                    at += _write_nearest(s, names, cython.address(found[0]) + at, cython.address(value[0]) + at)
                else:
                    at += _write_within(s, names, cython.address(found[0]) + at, cython.address(value[0]) + at)
            end[i] = at
            n_done += 1
            _forget(s)
        _forget(s)
        _free_front(s)
    return -1 if s.failed else n_done


def search(
    front: Front,
    source: cython.int[::1],
    offset: cython.double[::1],
    point_face: cython.int[::1],
    point: cython.double[::1],
    point_offset: cython.double[::1],
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
    statistics: cython.longlong[::1],
) -> bool:
    """Exact distances from vertices and points; false where memory runs out.

    Parameters
    ----------
    front : Front
        For one search alone, whose `label` has room for p source points.
    source, offset : (k,)
        Vertices that distance starts from, and the distance at which each starts.
    point_face, point, point_offset : (p,), (3 p,), (p,)
        Sources inside faces: face, barycentric coordinates, distance. A source on a side, with a coordinate of 0, comes
        once for every face there.
    goal : (g,)
        With `stops_early`, the search ends when the distances of these vertices and of all targets are known.
    first_target, next_target, target_face, target : (m,), (t,), (t,), (3 t,)
        Points whose distance is asked for, as linked lists by face, with their barycentric coordinates.
    target_distance, target_root, target_entered, target_crossing : (t,)
        As for vertices.
    slack : float
        Diameter of the largest circle around a face with targets.
    cutoff : float
        Distances up to here are exact, larger ones may be too large.
    statistics : (3,)
        Takes the numbers of vertices that were reached, of windows, and of lists that crossed a face.
    """
    s: cython.pointer(Search) = cython.address(front.state)
    i: cython.int
    s.n_points = point_face.shape[0]
    if s.n_points > 0:
        s.point_face = cython.address(point_face[0])
        s.point = cython.address(point[0])
        s.point_offset = cython.address(point_offset[0])
    s.n_goals = goal.shape[0]
    if s.n_goals > 0:
        s.goal = cython.address(goal[0])
    s.n_targets = target_face.shape[0]
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
    s.cutoff = cutoff
    with cython.nogil:
        _allocate(s)
        for i in range(source.shape[0]):
            _start_at(s, source[i], offset[i], i)
        for i in range(s.n_points):
            if not s.failed:
                s.label[s.n + i] = source.shape[0] + i
                _push(s, point_offset[i], s.n_half_edges + s.n + i)
        if not s.failed:
            _run(s)
        _empty_front(s)
        _free_front(s)
    statistics[0] = s.n_touched
    statistics[1] = s.n_windows
    statistics[2] = s.n_lists_done
    return not s.failed
