"""Windows lose the parts of their half-edge that another path reaches sooner.

That path leads over an end of the half-edge (Xin and Wang 2009), or through another window of the list.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.window_structures import (
    FARTHEST,
    NARROW,
    OVERLAP,
    ROUNDING,
    SAME,
    U_NEARER,
    U_THEN_W,
    UNDECIDED,
    W_NEARER,
    W_THEN_U,
    Search,
    Window,
    is_within,
    lateral,
    reach,
)
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.libc.string import memmove


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _slope(w: cython.pointer(Window), at: cython.double, reached: cython.double) -> cython.double:
    """Derivative, along the half-edge, of the length `reached` that a window adds to its offset."""
    return w.x if w.is_plane else (at - w.x) / reached


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _excess(
    u: cython.pointer(Window), w: cython.pointer(Window), at: cython.double, slope: cython.p_double
) -> cython.double:
    """Distance by u less that by w; `slope` takes a number with the sign of the derivative of this difference."""
    a: cython.double = reach(u, at)
    b: cython.double = reach(w, at)
    if u.is_plane or w.is_plane:
        slope[0] = _slope(u, at, a) - _slope(w, at, b)
    else:
        slope[0] = (at - u.x) * b - (at - w.x) * a
    return (u.offset - w.offset) + a - b


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _meeting(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
    at_low: cython.double,
    at_high: cython.double,
    shift: cython.double,
    slope: cython.p_double,
) -> cython.double:
    """The point at which distance by u less that by w, plus `shift`, is 0: Newton's method inside a bracket.

    The bracket is [low, high], with the values `at_low` and `at_high` of opposite signs. `slope` takes the derivative.
    """
    x: cython.double = low + (high - low) * at_low / (at_low - at_high)
    y: cython.double
    a: cython.double
    b: cython.double
    _: cython.int
    shift += u.offset - w.offset
    for _ in range(8):
        a = reach(u, x)
        b = reach(w, x)
        y = shift + a - b
        if (y < 0.0) == (at_low < 0.0):
            low = x
        else:
            high = x
        slope[0] = _slope(u, x, a) - _slope(w, x, b)
        if fabs(y) <= 1e-15 * (fabs(a) + fabs(u.offset)):
            break
        if slope[0] != 0.0:
            x -= y / slope[0]
        if not (low < x < high):
            x = 0.5 * (low + high)
    return x


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _compare_squares(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
    tolerance: cython.double,
    until: cython.p_double,
) -> cython.int:
    """`_compare` for roots with the same offset: the difference of the squares of both distances is linear."""
    # |x - u|^2 - |x - w|^2 = b - a x
    a: cython.double = 2.0 * (u.x - w.x)
    b: cython.double = (u.x - w.x) * (u.x + w.x) + (u.depth - w.depth) * (u.depth + w.depth)
    at_low: cython.double = b - a * low
    at_high: cython.double = b - a * high
    reached: cython.double = fabs(low - u.x) + u.depth
    margin: cython.double = 2.0 * tolerance * (u.offset + reached) * reached
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
@cython.nogil
@cython.exceptval(check=False)
def _compare(
    u: cython.pointer(Window),
    w: cython.pointer(Window),
    low: cython.double,
    high: cython.double,
    tolerance: cython.double,
    until: cython.p_double,
) -> cython.int:
    """Which of two windows is nearer between two points, by more than a fraction `tolerance` of the distance.

    If one is nearer at one end and the other at the other, `until` takes the points up to which u and w are needed.
    """
    a: cython.double
    b: cython.double
    at_low: cython.double
    at_high: cython.double
    slope_low: cython.double
    slope_high: cython.double
    x: cython.double
    margin: cython.double
    is_point: cython.bint = not (u.is_plane or w.is_plane)
    difference: cython.double = u.offset - w.offset
    if difference == 0.0 and is_point:
        return _compare_squares(u, w, low, high, tolerance, until)
    at_low = _excess(u, w, low, cython.address(slope_low))
    at_high = _excess(u, w, high, cython.address(slope_high))
    margin = tolerance * (fabs(u.offset) + reach(u, low))
    if at_low < -margin and at_high < -margin:
        # The difference has at most one extremum: for two roots, where the line through both meets the half-edge.
        if slope_low <= 0.0 or slope_high >= 0.0:
            return U_NEARER
        a = u.x - w.x
        b = u.depth - w.depth
        return U_NEARER if is_point and difference <= 0.0 and a * a + b * b <= difference * difference else UNDECIDED
    if at_low > margin and at_high > margin:
        if slope_low >= 0.0 or slope_high <= 0.0:
            return W_NEARER
        a = u.x - w.x
        b = u.depth - w.depth
        return W_NEARER if is_point and difference >= 0.0 and a * a + b * b <= difference * difference else UNDECIDED
    if (at_low < -margin and at_high > margin) or (at_low > margin and at_high < -margin):
        x = _meeting(u, w, low, high, at_low, at_high, 0.0, cython.address(slope_low))
        # The difference grows to the margin within this, as it grows further before its extremum.
        b = 2.0 * margin / fabs(slope_low) if slope_low != 0.0 else high - low
        if at_low < 0.0:
            until[0] = min(x + b, high)
            until[1] = max(x - b, low)
            return U_THEN_W
        until[0] = max(x - b, low)
        until[1] = min(x + b, high)
        return W_THEN_U
    # Equally near at one end, or at both.
    if at_low < -margin or at_high > margin:
        until[0], until[1] = high, low
        if at_low < -margin and slope_high >= 0.0:
            until[1] = _meeting(u, w, low, high, at_low + margin, at_high + margin, margin, cython.address(slope_low))
        elif at_high > margin and slope_low >= 0.0:
            until[0] = _meeting(u, w, low, high, at_low - margin, at_high - margin, -margin, cython.address(slope_low))
        return U_THEN_W
    if at_low > margin or at_high < -margin:
        until[0], until[1] = low, high
        if at_low > margin and slope_high <= 0.0:
            until[0] = _meeting(u, w, low, high, at_low - margin, at_high - margin, -margin, cython.address(slope_low))
        elif at_high < -margin and slope_low <= 0.0:
            until[1] = _meeting(u, w, low, high, at_low + margin, at_high + margin, margin, cython.address(slope_low))
        return W_THEN_U
    return UNDECIDED


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _diverge(right: cython.pointer(Window), left: cython.pointer(Window), at: cython.double) -> cython.double:
    """Positive if the line of the left window through a point leads further right than that of the right one."""
    return lateral(left, at) * right.depth - lateral(right, at) * left.depth


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _holds_start(u: cython.pointer(Window), w: cython.pointer(Window)) -> cython.bint:
    """Whether the first line of u leads as far to the left as that of w, or u begins well before w."""
    return u.start < w.start - (w.stop - w.start) or (lateral(u, u.start) * w.depth <= lateral(w, w.start) * u.depth)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _holds_stop(u: cython.pointer(Window), w: cython.pointer(Window)) -> cython.bint:
    """Whether the last line of u leads as far to the right as that of w, or u ends well behind w."""
    return u.stop > w.stop + (w.stop - w.start) or (lateral(u, u.stop) * w.depth >= lateral(w, w.stop) * u.depth)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _gives_way(
    u: cython.pointer(Window), w: cython.pointer(Window), low: cython.double, high: cython.double, merges: cython.bint
) -> cython.int:
    """Cut w between two points where u is nearer. 2: w is gone, 4: what is left comes before u, 0: or behind.

    A search with a tolerance knows distances up to errors, so u can be nearer up to its last line, and w lead beyond
    this line: what would be left without a window stays.
    """
    if low <= w.start and (not merges or _holds_start(u, w)):
        if high >= w.stop:
            return 2 if not merges or _holds_stop(u, w) else 0
        if not merges or _diverge(w, u, high) >= 0.0:
            w.start = high
        return 0
    if high >= w.stop and low > w.start and (not merges or _holds_stop(u, w)):
        if not merges or _diverge(u, w, low) >= 0.0:
            w.stop = low
        return 4
    return 4 if w.start < u.start and w.stop < u.stop else 0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _settle(
    u: cython.pointer(Window), w: cython.pointer(Window), tolerance: cython.double, merges: cython.bint
) -> cython.int:
    """Cut two windows of one half-edge where the other is nearer. 1: u is gone, 2: w is gone, 4: w comes before u."""
    low: cython.double = u.start if u.start > w.start else w.start
    high: cython.double = u.stop if u.stop < w.stop else w.stop
    until: cython.double[2]
    order: cython.int
    first: cython.int = 4 if w.start < u.start and w.stop < u.stop else 0
    if low >= high:
        return first
    if high - low < OVERLAP * (u.stop - u.start) and high - low < OVERLAP * (w.stop - w.start):
        return first
    order = _compare(u, w, low, high, tolerance, until)
    if order == U_NEARER:
        return _gives_way(u, w, low, high, merges)
    if order == W_NEARER:
        order = _gives_way(w, u, low, high, merges)
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
@cython.exceptval(check=False)
def _cut_by_ends(w: cython.pointer(Window), a: cython.double, b: cython.double) -> cython.bint:
    """Cut what is nearer over the ends of the half-edge; whether anything is left.

    The way over the tail is longer than the offset of the window by `a` plus the place on the half-edge, the one over
    the head by `b` minus the place.
    """
    p: cython.double
    q: cython.double
    r: cython.double
    square: cython.double
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
    r = a + w.stop
    if r < 0.0 or q > r * r:
        return False
    r = b - w.start
    if r < 0.0 or p > r * r:
        return False
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
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _goes_on(u: cython.pointer(Window), w: cython.pointer(Window), length: cython.double) -> cython.bint:
    """Whether w continues u: two halves that passed a flat vertex."""
    return (
        fabs(u.x - w.x) <= SAME * (fabs(w.x) + w.depth)
        and u.root == w.root
        and fabs(u.offset - w.offset) <= (SAME * (fabs(w.offset) + length) if w.is_plane else 0.0)
        and fabs(u.depth - w.depth) <= SAME * (fabs(w.x) + w.depth)
        and u.start <= w.start <= u.stop + NARROW * length
    )


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _insert(
    windows: cython.pointer(Window),
    k: cython.int,
    w: cython.pointer(Window),
    length: cython.double,
    tolerance: cython.double,
    merges: cython.bint,
) -> cython.int:
    """Add a window to k that lie side by side, after cutting all where another is nearer; how many there are then.

    The window may stand in the same array, behind the k.
    """
    j: cython.int = k
    outcome: cython.int
    moved: Window
    narrow: cython.double = NARROW * length
    while j > 0:
        outcome = _settle(cython.address(windows[j - 1]), w, tolerance, merges)
        if outcome == 1 or windows[j - 1].stop - windows[j - 1].start <= narrow:
            # remove j - 1
            if j < k:
                memmove(windows + (j - 1), windows + j, (k - j) * cython.sizeof(Window))
            k -= 1
            j -= 1
            if outcome == 2:
                return k
            continue
        if outcome == 2 or w.stop - w.start <= narrow:
            return k
        if outcome == 4:
            j -= 1
            continue
        break
    if j < k:
        moved = w[0]
        memmove(windows + (j + 1), windows + j, (k - j) * cython.sizeof(Window))
        windows[j] = moved
        return k + 1
    if j > 0 and _goes_on(cython.address(windows[j - 1]), w, length):
        if w.stop > windows[j - 1].stop:
            windows[j - 1].stop = w.stop
        return k
    if w != windows + j:
        windows[j] = w[0]
    return k + 1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _merged(
    u: cython.pointer(Window), w: cython.pointer(Window), merging: cython.double, out: cython.pointer(Window)
) -> cython.bint:
    """Make one window of two side by side, u before w; false if its error would exceed a fraction of the distance.

    Its root is where the line of u through its start and that of w through its end meet, so that its lines cover those
    of both; if they do not meet behind the half-edge, or too far from it, it lies at a distance of FARTHEST lengths in
    the mean of both directions. The offset makes the largest and the smallest difference to u and w opposite.
    """
    width: cython.double = w.stop - u.start
    a: cython.double = reach(u, u.start)
    b: cython.double = reach(w, w.stop)
    error: cython.double = u.turn_x if u.turn_x > w.turn_x else w.turn_x
    budget: cython.double = merging * (min(u.offset + a, w.offset + b) - width) - error
    sine_a: cython.double = (u.start - u.x) / a
    cosine_a: cython.double = u.depth / a
    sine_b: cython.double = (w.stop - w.x) / b
    cosine_b: cython.double = w.depth / b
    between: cython.double = cosine_a * sine_b - sine_a * cosine_b
    far: cython.double
    low: cython.double
    high: cython.double
    value: cython.double
    i: cython.int
    is_met: cython.bint = between * FARTHEST > cosine_b
    if budget <= 0.0:
        return False
    out[0] = u[0]
    if is_met:
        far = width * cosine_b / between
        out.x, out.depth = u.start - far * sine_a, far * cosine_a
    else:
        far = FARTHEST * width
        sine_a, cosine_a = sine_a + sine_b, cosine_a + cosine_b
        value = sqrt(sine_a * sine_a + cosine_a * cosine_a)
        out.x = 0.5 * (u.start + w.stop) - far * sine_a / value
        out.depth = far * cosine_a / value
        if not (_covers(out, u, u.start, -1.0) and _covers(out, w, w.stop, 1.0)):
            return False
    out.stop = w.stop
    # The difference to either window has at most one extremum on the half-edge. With lines in common it is at the end.
    low = high = (u.offset + a) - reach(out, u.start)
    for i in range(3):
        if i == 0:
            value = (u.offset + reach(u, u.stop)) - reach(out, u.stop)
        elif i == 1:
            value = (w.offset + reach(w, w.start)) - reach(out, w.start)
        else:
            value = (w.offset + b) - reach(out, w.stop)
        low, high = min(low, value), max(high, value)
    if high - low > 2.0 * budget:
        return False
    if not is_met and not (_is_monotone(out, u) and _is_monotone(out, w)):
        return False
    out.offset = 0.5 * (low + high)
    out.turn_x = error + 0.5 * (high - low)
    return True


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _covers(
    out: cython.pointer(Window), w: cython.pointer(Window), at: cython.double, outward: cython.double
) -> cython.bint:
    """Whether the line of `out` through a point of the half-edge leads no further inward than that of w."""
    return outward * ((at - out.x) * w.depth - (at - w.x) * out.depth) >= 0.0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _is_monotone(out: cython.pointer(Window), w: cython.pointer(Window)) -> cython.bint:
    """Whether the difference of two windows has no extremum between the ends of w."""
    a: cython.double
    b: cython.double
    _excess(out, w, w.start, cython.address(a))
    _excess(out, w, w.stop, cython.address(b))
    return (a >= 0.0 and b >= 0.0) or (a <= 0.0 and b <= 0.0)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _merge(
    windows: cython.pointer(Window), n: cython.int, s: cython.pointer(Search), length: cython.double
) -> cython.int:
    """Merge windows side by side as far as the errors that they have taken on allow; how many are left.

    Over a gap nothing is merged: what covers it is not known here.
    """
    i: cython.int
    k: cython.int = 0
    u: cython.pointer(Window)
    w: cython.pointer(Window)
    one: Window
    for i in range(1, n):
        u, w = windows + k, windows + i
        if (
            not (u.is_plane or w.is_plane)
            and s.label[u.root] == s.label[w.root]
            and u.start <= w.start <= u.stop + NARROW * length
            and u.stop <= w.stop
            and _merged(u, w, s.merging, cython.address(one))
        ):
            u[0] = one
            continue
        k += 1
        if k < i:
            windows[k] = w[0]
    return k + 1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def trim(s: cython.pointer(Search), windows: cython.pointer(Window), n: cython.int, h: cython.int) -> cython.int:
    """Cut from windows what a path over an end of the half-edge or another window makes useless; how many are left."""
    i: cython.int
    k: cython.int = 0
    w: cython.pointer(Window)
    length: cython.double = s.length[h]
    from_tail: cython.double = s.upper[s.vertex[next_half_edge(h)]]
    from_head: cython.double = s.upper[s.vertex[previous_half_edge(h)]]
    # Of the length too: straight past a vertex near the root, both ways round to the same number.
    from_tail += s.tolerance * (from_tail + length)
    from_head += s.tolerance * (from_head + length)
    from_head += length
    for i in range(n):
        w = windows + i
        if not _cut_by_ends(w, from_tail - w.offset, from_head - w.offset):
            continue
        if w.stop - w.start > NARROW * length:
            k = _insert(windows, k, w, length, ROUNDING, s.merging > 0.0)
    if s.merging > 0.0 and k > 1:
        k = _merge(windows, k, s, length)
    return k


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
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
    at: cython.double
    reached: cython.double
    nearest: cython.double
    i: cython.int
    j: cython.int
    k: cython.int
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
