"""Windows cross a face: trimmed before it, they give distances to the opposite vertex and go on over two sides.

They lose the parts of their half-edge that another path reaches sooner: over an end of the half-edge (Xin and Wang
2009), or through another window of the list.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.windows.front import add, more_room, relax, release, take
from cython.cimports.heat_igl.kernels.windows.structures import (
    AROUND_APEX,
    FLATNESS,
    JOINS,
    LEFT_OF_APEX,
    MARGIN,
    NARROW,
    OVERLAP,
    RIGHT_OF_APEX,
    ROUNDING,
    SAME,
    SLIVER,
    TURNED,
    U_NEARER,
    U_THEN_W,
    UNDECIDED,
    W_NEARER,
    W_THEN_U,
    Apex,
    List,
    Search,
    Window,
    apart,
    at_corner,
    backward,
    bent,
    is_within,
    keep_root,
    lateral,
    reach,
    twice_product,
)
from cython.cimports.libc.math import INFINITY, fabs, sqrt
from cython.cimports.libc.string import memcpy, memmove


@cython.cfunc
@cython.inline
@cython.nogil
def _slope(w: cython.pointer(Window), at: cython.double, reached: cython.double) -> cython.double:
    """Derivative, along the half-edge, of the length `reached` that a window adds to its offset."""
    return w.x if w.is_plane else (at - w.x) / reached


@cython.cfunc
@cython.inline
@cython.nogil
def _bend(w: cython.pointer(Window), reached: cython.double) -> cython.double:
    """A bound of the derivative of `_slope` over a quarter of the distance of the root."""
    return 0.0 if w.is_plane else 2.0 / reached


@cython.cfunc
@cython.inline
@cython.nogil
def _change(
    u: cython.pointer(Window), w: cython.pointer(Window), at: cython.double, a: cython.double, b: cython.double
) -> cython.double:
    """The sign of the derivative of distance by u less that by w, which add a and b to their offsets."""
    if u.is_plane or w.is_plane:
        return _slope(u, at, a) - _slope(w, at, b)
    return (at - u.x) * b - (at - w.x) * a


@cython.cfunc
@cython.nogil
def _meeting(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
    at_low: cython.double,
    at_high: cython.double,
    shift: cython.double,
    room: cython.p_double,
) -> cython.double:
    """The point at which distance by u less that by w, plus `shift`, is 0, to within `room`.

    Newton's method inside the bracket [low, high], with the values `at_low` and `at_high` of opposite signs. It ends
    as soon as the step proves where the point is: the derivative of a distance changes by at most 1 / distance.
    `room` comes as a length, and takes how far windows that meet have to overlap: that the difference grows to this
    length, as it grows further before its extremum, and the uncertainty of the point.
    """
    x: cython.double = low + (high - low) * at_low / (at_low - at_high)
    margin: cython.double = room[0]
    slope: cython.double = 0.0
    shift += u.offset - w.offset
    for _ in range(8):
        a = reach(u, x)
        b = reach(w, x)
        y = shift + a - b
        if (y < 0.0) == (at_low < 0.0):
            low = x
        else:
            high = x
        slope = _slope(u, x, a) - _slope(w, x, b)
        # At most twice the second derivative while the step is below a quarter of both distances.
        bend = _bend(u, a) + _bend(w, b)
        step = -y / slope if slope != 0.0 else INFINITY
        x += step
        if 4.0 * bend * fabs(step) <= fabs(slope) and low <= x <= high:
            # The derivative keeps at least half of its size.
            room[0] = (bend * step * step + 2.0 * margin) / fabs(slope)
            return x
        if not (low < x < high):
            x = 0.5 * (low + high)
    room[0] = high - low
    return x


@cython.cfunc
@cython.nogil
def _compare_squares(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
    until: cython.p_double,
) -> cython.int:
    """`_compare` for roots with the same offset: the difference of the squares of both distances is linear."""
    # |x - u|^2 - |x - w|^2 = b - a x
    a: cython.double = 2.0 * (u.x - w.x)
    b: cython.double = (u.x - w.x) * (u.x + w.x) + (u.depth - w.depth) * (u.depth + w.depth)
    at_low: cython.double = b - a * low
    at_high: cython.double = b - a * high
    reached: cython.double = fabs(low - u.x) + u.depth
    margin: cython.double = 2.0 * ROUNDING * (u.offset + reached) * reached
    if at_low < -margin and at_high < -margin:
        return U_NEARER
    if at_low > margin and at_high > margin:
        return W_NEARER
    if a == 0.0:
        return UNDECIDED
    a = 1.0 / a
    if a < 0.0:
        until[0] = high if at_high <= margin else (b - margin) * a
        until[1] = low if at_low >= -margin else (b + margin) * a
        return U_THEN_W
    until[0] = low if at_low <= margin else (b - margin) * a
    until[1] = high if at_high >= -margin else (b + margin) * a
    return W_THEN_U


@cython.cfunc
@cython.inline
@cython.nogil
def _ordered(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
    at_low: cython.double,
    at_high: cython.double,
    slope_low: cython.double,
    slope_high: cython.double,
    margin: cython.double,
    until: cython.p_double,
) -> cython.int:
    """`_compare`, if u is nearer at one end and w is at most at the other; by the excess and its slope at both."""
    if at_high < -margin:
        # The difference has at most one extremum: for two roots, where the line through both meets the half-edge.
        if slope_low <= 0.0 or slope_high >= 0.0:
            return U_NEARER
        a = u.x - w.x
        b = u.depth - w.depth
        is_farther: cython.bint = u.offset <= w.offset and a * a + b * b <= (u.offset - w.offset) ** 2
        return U_NEARER if is_farther and not (u.is_plane or w.is_plane) else UNDECIDED
    if at_low < -margin and at_high > margin:
        b = margin
        a = _meeting(u, w, low, high, at_low, at_high, 0.0, cython.address(b))
        until[0], until[1] = min(a + b, high), max(a - b, low)
        return U_THEN_W
    # Equally near at one end, or at both.
    until[0], until[1] = high, low
    b = 0.0
    if at_low < -margin:
        if slope_high >= 0.0:
            a = _meeting(u, w, low, high, at_low + margin, at_high + margin, margin, cython.address(b))
            until[1] = max(a - b, low)
        return U_THEN_W
    if at_high > margin:
        if slope_low >= 0.0:
            a = _meeting(u, w, low, high, at_low - margin, at_high - margin, -margin, cython.address(b))
            until[0] = min(a + b, high)
        return U_THEN_W
    return UNDECIDED


@cython.cfunc
@cython.nogil
def _compare(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
    until: cython.p_double,
) -> cython.int:
    """Which of two windows is nearer between two points, by more than rounding.

    If one is nearer at one end and the other at the other, `until` takes the points up to which u and w are needed.
    """
    if u.offset == w.offset and not (u.is_plane or w.is_plane):
        return _compare_squares(u, w, low, high, until)
    a, b, c, d = reach(u, low), reach(w, low), reach(u, high), reach(w, high)
    at_low, at_high = (u.offset - w.offset) + a - b, (u.offset - w.offset) + c - d
    slope_low, slope_high = _change(u, w, low, a, b), _change(u, w, high, c, d)
    margin = ROUNDING * (fabs(u.offset) + a)
    # Where w comes first, u and w change places.
    if at_low > margin or (at_low >= -margin and at_high < -margin):
        order = _ordered(w, u, low, high, -at_low, -at_high, -slope_low, -slope_high, margin, until)
        until[0], until[1] = until[1], until[0]
        return W_NEARER if order == U_NEARER else W_THEN_U if order == U_THEN_W else UNDECIDED
    return _ordered(u, w, low, high, at_low, at_high, slope_low, slope_high, margin, until)


@cython.cfunc
@cython.nogil
def _gives_way(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
) -> cython.int:
    """Cut w between two points where u is nearer. 2: w is gone, 4: what is left comes before u, 0: or behind."""
    if low <= w.start:
        if high >= w.stop:
            return 2
        w.start = high
        return 0
    if high >= w.stop:
        w.stop = low
        return 4
    return 4 if w.start < u.start and w.stop < u.stop else 0


@cython.cfunc
@cython.inline
@cython.nogil
def _overlap_little(u: cython.pointer(Window), w: cython.pointer(Window), sliver: cython.double) -> cython.bint:
    """Whether two windows overlap by little of the half-edge or of both, or not at all: it seldom pays to compare.

    Without a branch: what touches, what overlaps by rounding and what overlaps by more come in any order.
    """
    low: cython.double = u.start if u.start > w.start else w.start
    high: cython.double = u.stop if u.stop < w.stop else w.stop
    overlap: cython.double = high - low
    return (overlap < sliver) | ((overlap < OVERLAP * (u.stop - u.start)) & (overlap < OVERLAP * (w.stop - w.start)))


@cython.cfunc
@cython.nogil
def _settle(u: cython.pointer(Window), w: cython.pointer(Window), sliver: cython.double) -> cython.int:
    """Cut two windows of one half-edge where the other is nearer. 1: u is gone, 2: w is gone, 4: w comes before u."""
    low: cython.double = u.start if u.start > w.start else w.start
    high: cython.double = u.stop if u.stop < w.stop else w.stop
    until: cython.double[2]
    first: cython.int = 4 * ((w.start < u.start) & (w.stop < u.stop))
    if _overlap_little(u, w, sliver):
        return first
    order = _compare(u, w, low, high, until)
    if order == U_NEARER:
        return _gives_way(u, w, low, high)
    if order == W_NEARER:
        order = _gives_way(w, u, low, high)
        if order == 2:
            return 1
        # What is left of u comes before w, unless w comes first.
        return 4 if order == 0 and w.start < u.start else 0
    if order == U_THEN_W:
        if high >= u.stop:
            u.stop = until[0]
        if low <= w.start:
            w.start = until[1]
    elif order == W_THEN_U:
        if high >= w.stop:
            w.stop = until[1]
        if low <= u.start:
            u.start = until[0]
        return 4
    return first


@cython.cfunc
@cython.nogil
def _cut_by_ends(w: cython.pointer(Window), a: cython.double, b: cython.double) -> cython.bint:
    """Cut what is nearer over the ends of the half-edge; whether anything is left.

    The way over the tail is longer than the offset of the window by `a` plus the place on the half-edge, the one over
    the head by `b` minus the place.
    """
    if w.is_plane:
        if w.x * w.stop > a + w.stop or w.x * w.start > b - w.start:
            return False
        if w.x * w.start > a + w.start:
            w.start = a / (w.x - 1.0)
        if w.x * w.stop > b - w.stop:
            w.stop = b / (w.x + 1.0)
        return True
    square = w.depth * w.depth
    p = (w.start - w.x) * (w.start - w.x) + square
    q = (w.stop - w.x) * (w.stop - w.x) + square
    # The usual case, with one branch: the whole window is nearer.
    if (w.start >= -a) & (w.stop <= b) & (p <= (a + w.start) * (a + w.start)) & (q <= (b - w.stop) * (b - w.stop)):
        return True
    r = a + w.stop
    if r < 0.0 or q > r * r:
        return False
    r = b - w.start
    if r < 0.0 or p > r * r:
        return False
    r = a + w.start
    if r < 0.0 or p > r * r:
        r = a + w.x
        if r > 0.0:
            # Not as one difference of squares, which is rounding where the root is near the line from the tail.
            r = 0.5 * (w.x - a + square / r)
            if r > w.start:
                w.start = r
    r = b - w.stop
    if r < 0.0 or q > r * r:
        r = b - w.x
        if r > 0.0:
            r = 0.5 * (b + w.x - square / r)
            if r < w.stop:
                w.stop = r
    return True


@cython.cfunc
@cython.nogil
def _goes_on(
    u: cython.pointer(Window), w: cython.pointer(Window), length: cython.double, is_many: cython.bint
) -> cython.bint:
    """Whether w continues u: two halves that passed a flat vertex.

    Halves that passed a vertex beside the root, one on either side, may have the same root to rounding while they left
    it in directions that differ by the curvature of the vertex: then their half-edge is turned against the corner.
    Where more than two faces meet (`is_many`), they cannot be oriented alike, and directions have no meaning.
    """
    if fabs(u.x - w.x) > SAME * (fabs(w.x) + w.depth):
        return False
    if not is_many and u.corner == w.corner and fabs(u.turn_x - w.turn_x) + fabs(u.turn_y - w.turn_y) > TURNED:
        return False
    return (
        u.root == w.root
        and fabs(u.offset - w.offset) <= (SAME * (fabs(w.offset) + length) if w.is_plane else 0.0)
        and fabs(u.depth - w.depth) <= SAME * (fabs(w.x) + w.depth)
        and u.start <= w.stop + NARROW * length
        and w.start <= u.stop + NARROW * length
    )


@cython.cfunc
@cython.inline
@cython.nogil
def _is_next(u: cython.pointer(Window), w: cython.pointer(Window), sliver: cython.double) -> cython.bint:
    """Whether w lies behind u, from another root, and overlaps it by little: `_insert` would add it at the end."""
    is_before: cython.bint = (w.start < u.start) & (w.stop < u.stop)
    is_other: cython.bint = fabs(u.x - w.x) > SAME * (fabs(w.x) + w.depth)
    return is_other & (not is_before) & _overlap_little(u, w, sliver)


@cython.cfunc
@cython.nogil
def _insert(
    windows: cython.pointer(Window),
    k: cython.int,
    w: cython.pointer(Window),
    length: cython.double,
    is_many: cython.bint,
) -> cython.int:
    """Add a window to k, after cutting all where another is nearer; how many there are then.

    They lie side by side, or, over an edge of more than two faces, in any order: then the window is compared with all,
    and is one with those of the same root. The window may stand in the same array, behind the k.
    """
    j: cython.int = k
    moved: Window
    u: cython.pointer(Window)
    narrow: cython.double = NARROW * length
    sliver: cython.double = 0.0 if is_many else SLIVER * length
    while j > 0:
        u = windows + (j - 1)
        if (is_many or (j == k and u.start <= w.start)) and _goes_on(u, w, length, is_many):
            u.start, u.stop = min(u.start, w.start), max(u.stop, w.stop)
            return k
        outcome = _settle(u, w, sliver)
        if outcome == 1 or u.stop - u.start <= narrow:
            if j < k:
                memmove(u, u + 1, (k - j) * cython.sizeof(Window))
            k -= 1
            j -= 1
            if outcome == 2:
                return k
            continue
        if outcome == 2 or w.stop - w.start <= narrow:
            return k
        if outcome != 4 and not is_many:
            break
        j -= 1
    if is_many:
        j = k
    if j < k:
        moved = w[0]
        memmove(windows + (j + 1), windows + j, (k - j) * cython.sizeof(Window))
        windows[j] = moved
    elif w != windows + j:
        windows[j] = w[0]
    return k + 1


@cython.cfunc
@cython.inline
@cython.nogil
def _bound_over(s: cython.pointer(Search), v: cython.int, length: cython.double) -> cython.double:
    """What windows may take to an end of their half-edge, compared with the distance of that vertex.

    Of the length too: straight past a vertex near the root, both ways round to the same number. From where paths leave
    into all faces, what passes the vertex by less than rounding is not kept: between more than two faces at each of its
    edges, there would be as many such windows as there are ways around the vertex.
    """
    slack: cython.double = -MARGIN if not s.is_delaunay and s.kind[v] == JOINS else s.tolerance
    return s.upper[v] + slack * (s.upper[v] + length)


@cython.cfunc
@cython.nogil
def trim(s: cython.pointer(Search), windows: cython.pointer(Window), n: cython.int, h: cython.int) -> cython.int:
    """Cut from windows what a path over an end of the half-edge or another window makes useless; how many are left."""
    k: cython.int = 0
    w: cython.pointer(Window)
    length: cython.double = s.length[h]
    # Over an edge of more than two faces windows come in any order, some of them with the same root on several ways.
    is_many: cython.bint = s.twin[h] == -2
    from_tail: cython.double = _bound_over(s, s.vertex[next_half_edge(h)], length)
    from_head: cython.double = _bound_over(s, s.vertex[previous_half_edge(h)], length) + length
    for i in range(n):
        w = windows + i
        if not _cut_by_ends(w, from_tail - w.offset, from_head - w.offset):
            continue
        if w.stop - w.start <= NARROW * length:
            continue
        # The usual case: behind the last, and not a half of it.
        if k == 0 or (not is_many and _is_next(windows + (k - 1), w, SLIVER * length)):
            if k < i:
                windows[k] = w[0]
            k += 1
        else:
            k = _insert(windows, k, w, length, is_many)
    return k


@cython.cfunc
@cython.nogil
def is_covered(
    s: cython.pointer(Search),
    before: cython.pointer(cython.const[Window]),
    n_before: cython.int,
    windows: cython.pointer(cython.const[Window]),
    n: cython.int,
    h: cython.int,
) -> cython.bint:
    """Whether n trimmed windows, and the ends of the half-edge, lead to all points of the windows before as shortly."""
    length: cython.double = s.length[h]
    j: cython.int
    w: cython.pointer(cython.const[Window])
    for i in range(n_before):
        for j in range(5):
            at = before[i].start + 0.25 * j * (before[i].stop - before[i].start)
            reached = before[i].offset + reach(before + i, at)
            nearest = s.upper[s.vertex[next_half_edge(h)]] + at
            nearest = min(nearest, s.upper[s.vertex[previous_half_edge(h)]] + (length - at))
            for k in range(n):
                w = windows + k
                if w.start - 2.0 * NARROW * length <= at <= w.stop + 2.0 * NARROW * length:
                    nearest = min(nearest, w.offset + reach(w, at))
            if not is_within(nearest, reached, length):
                return False
    return True


@cython.cfunc
@cython.nogil
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
    apex.excess = 2.0 * ROUNDING * max(apex.left_length, apex.right_length)
    apex.best, apex.best_at, apex.nearest = -1, 0.0, INFINITY
    return apex


@cython.cfunc
@cython.inline
@cython.nogil
def _arrive(
    s: cython.pointer(Search),
    h: cython.int,
    w: cython.pointer(Window),
    apex: cython.pointer(Apex),
    distance: cython.double,
    at: cython.double,
) -> cython.void:
    """Take the distance of the apex of h by the line of a window through a point of h."""
    # The direction to the apex: near the root, that to the point of h would be a quotient of roundings.
    x: cython.double = apex.x - w.x
    y: cython.double = apex.y + w.depth
    leaving_x: cython.double = x * w.turn_x - y * w.turn_y
    leaving_y: cython.double = x * w.turn_y + y * w.turn_x
    if w.is_plane:
        leaving_x, leaving_y = w.turn_x + w.turn_y * w.depth * at, w.turn_y
    relax(s, s.vertex[h], distance, w.root, h, at, w.corner, leaving_x, leaving_y)


@cython.cfunc
@cython.inline
@cython.nogil
def _straight(w: cython.pointer(Window), x: cython.double, y: cython.double) -> cython.double:
    """Distance of a point of the face by the straight line of a window, or of what extends it."""
    if w.is_plane:
        return w.offset + (w.x * x + w.depth * y)
    return w.offset + sqrt((x - w.x) * (x - w.x) + (y + w.depth) * (y + w.depth))


@cython.cfunc
@cython.inline
@cython.nogil
def _may_reach(
    w: cython.pointer(Window), apex: cython.pointer(Apex), x: cython.double, m: cython.double, off: cython.double
) -> cython.bint:
    """Whether the path to the apex over an end of a window may be as long as the straight line, to rounding.

    The line passes the end at a distance of `off` over the length of (x, m). The path is longer by half the square of
    that over the length of its last part, or by more.
    """
    if w.is_plane:
        return off * off <= apex.excess * fabs(_straight(w, apex.x, apex.y))
    return off * off <= apex.excess * (w.offset + fabs(x) + m) * (x * x + m * m)


@cython.cfunc
@cython.nogil
def _reach_apex(
    s: cython.pointer(Search),
    h: cython.int,
    windows: cython.pointer(Window),
    n: cython.int,
    apex: cython.pointer(Apex),
) -> cython.void:
    """Distance of the apex, and the side on which the lines of each window pass it."""
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
        # The apex is beside the window, maybe between two halves that a vertex turned against each other: the path over
        # the end of the window comes from the same direction as a straight one, unless it is longer. It gives way to a
        # path that is as long to rounding: one from a root nearby may leave in another direction, and one that bends at
        # a vertex of the end passes it on the right side.
        distance = bent(w, b, apex.x, apex.y) * (1.0 + ROUNDING)
        if distance <= _straight(w, apex.x, apex.y) * (1.0 + 2.0 * ROUNDING):
            at = min(max(backward(w, apex.x, apex.y), 0.0), apex.length)
            _arrive(s, h, w, apex, distance, at)
    if apex.best >= 0:
        w = windows + apex.best
        apex.best_at = backward(w, apex.x, apex.y)
        _arrive(s, h, w, apex, apex.nearest, apex.best_at)


@cython.cfunc
@cython.nogil
def _to_left(w: cython.pointer(Window), apex: cython.pointer(Apex), out: cython.pointer(Window)) -> cython.bint:
    """Make the window over the side between the tail and the apex; true if there is one."""
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
    # A line along the side meets it anywhere: so near a root on its extension, the quotient is that of two roundings.
    out.start = w.start * w.depth / (scale - lateral(w, w.start) * apex.sin_left)
    out.start = max(out.start, 0.0)
    out.stop = apex.left_length
    if w.side == LEFT_OF_APEX:
        out.stop = w.stop * w.depth / (scale - lateral(w, w.stop) * apex.sin_left)
        if out.stop > apex.left_length:
            out.stop = apex.left_length
    return out.stop - out.start > NARROW * apex.left_length


@cython.cfunc
@cython.nogil
def _to_right(w: cython.pointer(Window), apex: cython.pointer(Apex), out: cython.pointer(Window)) -> cython.bint:
    """Make the window over the side between the apex and the head; true if there is one."""
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
    return out.stop - out.start > NARROW * apex.right_length


@cython.cfunc
@cython.inline
@cython.nogil
def _longest(apex: cython.pointer(Apex)) -> cython.double:
    """The longest side of the face, which places on its sides are rounded to."""
    return max(apex.length, apex.left_length, apex.right_length)


@cython.cfunc
@cython.nogil
def _leads(
    w: cython.pointer(Window),
    at: cython.double,
    apex: cython.pointer(Apex),
    out: cython.pointer(Window),
    place: cython.double,
    to_left: cython.bint,
) -> cython.bint:
    """Whether w leads through a point of the half-edge to a place of `out`, on the left or right, by no longer path."""
    x: cython.double = place * apex.cos_left
    y: cython.double = place * apex.sin_left
    if not to_left:
        x = apex.length - (apex.right_length - place) * apex.cos_right
        y = (apex.right_length - place) * apex.sin_right
    return is_within(bent(w, at, x, y), out.offset + reach(out, place), _longest(apex))


@cython.cfunc
@cython.nogil
def _continues(
    w: cython.pointer(Window), apex: cython.pointer(Apex), out: cython.pointer(Window), to_left: cython.bint
) -> cython.bint:
    """Whether `out` lies on its side, and begins and ends at the first and the last line of w, or at the apex.

    So it is reached by straight lines through w, all of them inside the faces, and covers what w leads to.
    """
    start: cython.double = w.start
    stop: cython.double = w.stop
    if not 0.0 <= out.start < out.stop <= (apex.left_length if to_left else apex.right_length):
        return False
    if w.side == AROUND_APEX:
        at: cython.double = min(max(backward(w, apex.x, apex.y), w.start), w.stop)
        start, stop = (start, at) if to_left else (at, stop)
    # Lengths agree, not places: a line along the side meets it anywhere.
    return _leads(w, start, apex, out, out.start, to_left) and _leads(w, stop, apex, out, out.stop, to_left)


@cython.cfunc
@cython.nogil
def _is_behind(
    w: cython.pointer(Window), apex: cython.pointer(Apex), best: cython.pointer(Window), to_left: cython.bint
) -> cython.bint:
    """Whether the window that the apex is reached through leads to where w does by paths that are no longer."""
    out: Window
    if not (_to_left(w, apex, cython.address(out)) if to_left else _to_right(w, apex, cython.address(out))):
        return True
    to_start: cython.bint = _leads(best, apex.best_at, apex, cython.address(out), out.start, to_left)
    return to_start and _leads(best, apex.best_at, apex, cython.address(out), out.stop, to_left)


@cython.cfunc
@cython.nogil
def _is_reached_between(
    s: cython.pointer(Search),
    h: cython.int,
    windows: cython.pointer(Window),
    n: cython.int,
    apex: cython.pointer(Apex),
) -> cython.bint:
    """Whether the apex is reached if it lies between two halves of a window, turned against each other by rounding."""
    j: cython.int
    u: cython.pointer(Window)
    w: cython.pointer(Window)
    for i in range(n):
        u = windows + i
        near: cython.double = 10.0 * FLATNESS * (fabs(u.x) + u.depth)
        if u.side != LEFT_OF_APEX or u.is_plane:
            continue
        for j in range(n):
            w = windows + j
            if (
                w.side == RIGHT_OF_APEX
                and w.root == u.root
                and fabs(u.x - w.x) + fabs(u.depth - w.depth) <= near
                and w.start - u.stop <= near
                and not is_within(s.upper[s.vertex[h]], bent(u, u.stop, apex.x, apex.y), _longest(apex))
            ):
                return False
    return True


@cython.cfunc
@cython.inline
@cython.nogil
def _fetch(s: cython.pointer(Search), t: cython.int) -> cython.void:
    """Prefetch the data for windows over half-edge t."""
    prefetch(s.slot + t)
    prefetch(s.length + t)
    prefetch(s.bulge + t)


@cython.cfunc
@cython.nogil
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
    prefetch(s.upper + s.vertex[h])
    _fetch(s, s.twin[previous_half_edge(h)])
    _fetch(s, s.twin[next_half_edge(h)])
    s.slot[h] = -1
    s.n_lists_done += 1
    s.n_waiting -= n
    if n > s.n_out:
        more_room(s, n)
        if s.failed:
            return
    # Only the checked build has assertions. The next needs the windows as they came, in room that is free until then.
    assert memcpy(s.to_left, windows, n * cython.sizeof(Window)) != cython.NULL
    i = n
    n = trim(s, windows, n, h)
    assert is_covered(s, s.to_left, i, windows, n, h)
    apex = _opposite(s, h)
    _reach_apex(s, h, windows, n, cython.address(apex))
    assert _is_reached_between(s, h, windows, n, cython.address(apex))
    if s.first_target != cython.NULL and s.first_target[h // 3] >= 0:
        _measure(s, h, windows, n, apex.x, apex.y)
    for i in range(n):
        w = windows + i
        # Windows whose lines would cross a shorter path to the apex go no further.
        is_best = (apex.best < 0) | (i == apex.best)
        if w.side != RIGHT_OF_APEX and (
            is_best
            or w.start < apex.best_at
            or (w.side == LEFT_OF_APEX and not apex.nearest <= bent(w, w.stop, apex.x, apex.y))
        ):
            if _to_left(w, cython.address(apex), s.to_left + n_left):
                assert _continues(w, cython.address(apex), s.to_left + n_left, True)
                n_left += 1
        else:
            assert w.side == RIGHT_OF_APEX or _is_behind(w, cython.address(apex), windows + apex.best, True)
        if w.side != LEFT_OF_APEX and (
            is_best
            or w.stop > apex.best_at
            or (w.side == RIGHT_OF_APEX and not apex.nearest <= bent(w, w.start, apex.x, apex.y))
        ):
            if _to_right(w, cython.address(apex), s.to_right + n_right):
                assert _continues(w, cython.address(apex), s.to_right + n_right, False)
                n_right += 1
        else:
            assert w.side == LEFT_OF_APEX or _is_behind(w, cython.address(apex), windows + apex.best, False)
    release(s, place)
    if n_left > 0:
        add(s, previous_half_edge(h), s.to_left, n_left, True)
    if n_right > 0:
        add(s, next_half_edge(h), s.to_right, n_right, False)


@cython.cfunc
@cython.nogil
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
    length: cython.double = s.length[h]
    w: cython.pointer(Window)
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
def over_corners(s: cython.pointer(Search), j: cython.int) -> cython.void:
    """Distance of target j over the corners of its face."""
    f: cython.int = s.target_face[j]
    c: cython.int
    corner: cython.double[3]
    for c in range(3):
        at_corner(c, corner)
        v = s.vertex[3 * f + c]
        take(s, j, s.distance[v] + apart(s.length + 3 * f, corner, s.target + 3 * j), v)
