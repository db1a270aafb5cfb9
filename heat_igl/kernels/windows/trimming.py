"""Windows of a half-edge are trimmed to the points that no other path reaches at a smaller distance.

The other path may run over an end of the half-edge (Xin and Wang 2009) or through another window of its list.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.structures import (
    BEYOND,
    JOINS,
    MARGIN,
    OVERLAP,
    ROUNDING,
    SAME,
    TURNED,
    U_NEARER,
    U_THEN_W,
    UNDECIDED,
    W_NEARER,
    W_THEN_U,
    List,
    Window,
    grown,
    is_within,
    p_list,
    p_search,
    p_window,
    reach,
)
from cython.cimports.libc.math import INFINITY, fabs
from cython.cimports.libc.stdlib import calloc
from cython.cimports.libc.string import memmove


@cython.cfunc
@cython.nogil
def _slope(w: p_window, at: cython.double, reached: cython.double) -> cython.double:
    """Derivative along the half-edge of `reached`, the length that a window adds to its offset."""
    return w.x if w.is_plane else (at - w.x) / reached


@cython.cfunc
@cython.nogil
def _change(u: p_window, w: p_window, at: cython.double, a: cython.double, b: cython.double) -> cython.double:
    """Sign of the derivative of distance(u) - distance(w); a and b are their distances less the offsets."""
    if u.is_plane or w.is_plane:
        return _slope(u, at, a) - _slope(w, at, b)
    return (at - u.x) * b - (at - w.x) * a


@cython.cfunc
@cython.nogil
def _meeting(
    u: p_window,
    w: p_window,
    low: cython.double,
    high: cython.double,
    at_low: cython.double,
    at_high: cython.double,
    error: cython.p_double,
) -> cython.double:
    """The root of distance(u) - distance(w) in the bracket [low, high], and a bound on its error.

    Newton's method with bisection; `at_low` and `at_high` are the values at both ends, of opposite signs. It ends as
    soon as the step bounds the error: the second derivative of a distance is at most 1 / distance.
    """
    x: cython.double = low + (high - low) * at_low / (at_low - at_high)
    shift: cython.double = u.offset - w.offset
    for _ in range(8):
        a = reach(u, x)
        b = reach(w, x)
        y = shift + a - b
        if (y < 0.0) == (at_low < 0.0):
            low = x
        else:
            high = x
        slope = _slope(u, x, a) - _slope(w, x, b)
        # Twice the second derivative, a bound within steps below a quarter of both distances.
        bend = (0.0 if u.is_plane else 2.0 / a) + (0.0 if w.is_plane else 2.0 / b)
        step = -y / slope if slope != 0.0 else INFINITY
        x += step
        if 4.0 * bend * fabs(step) <= fabs(slope) and low <= x <= high:
            # Along this step, the derivative stays above half of its value.
            error[0] = bend * step * step / fabs(slope)
            return x
        if not (low < x < high):
            x = 0.5 * (low + high)
    error[0] = high - low
    return x


@cython.cfunc
@cython.nogil
def _is_farther(u: p_window, w: p_window) -> cython.bint:
    """Whether u reaches the root of w no later than w begins there, so u is nearer everywhere."""
    a: cython.double = u.x - w.x
    b: cython.double = u.depth - w.depth
    if u.is_plane:
        return u.offset + (u.x * w.x - u.depth * w.depth) <= w.offset and not w.is_plane
    return u.offset <= w.offset and a * a + b * b <= (u.offset - w.offset) ** 2 and not w.is_plane


@cython.cfunc
@cython.nogil
def _compare(
    s: p_search, u: p_window, w: p_window, low: cython.double, high: cython.double, until: cython.p_double
) -> cython.int:
    """Which of two windows to keep between two points of both: the nearer one, even if by less than rounding.

    If each is nearer at one end, `until` takes the points up to which u and w are needed.
    """
    at_low: cython.double
    at_high: cython.double
    slope_low: cython.double
    slope_high: cython.double
    margin: cython.double
    is_square: cython.bint = u.offset == w.offset and not (u.is_plane or w.is_plane)
    if is_square:
        # The difference of the squared distances is linear: |x - u|^2 - |x - w|^2 = b - a x.
        a = 2.0 * (u.x - w.x)
        b = (u.x - w.x) * (u.x + w.x) + (u.depth - w.depth) * (u.depth + w.depth)
        at_low, at_high = b - a * low, b - a * high
        slope_low = slope_high = -a
        c = fabs(low - u.x) + u.depth
        margin = 2.0 * ROUNDING * (u.offset + c) * c
    else:
        a, b, c, d = reach(u, low), reach(w, low), reach(u, high), reach(w, high)
        at_low, at_high = (u.offset - w.offset) + a - b, (u.offset - w.offset) + c - d
        slope_low, slope_high = _change(u, w, low, a, b), _change(u, w, high, c, d)
        margin = ROUNDING * (fabs(u.offset) + a)
    # Where distances are equal to rounding at an end, another list may decide for the other one. So one is kept there
    # only if it reaches all points ahead that the other reaches: it extends beyond, or its lines lean farther outward.
    # If both end at one vertex, points between their last lines might otherwise be reached by neither.
    beyond: cython.double = BEYOND * (high - low)
    is_tie: cython.bint = fabs(at_low) <= margin and fabs(at_high) <= margin
    u_low: cython.bint = at_low < -margin or slope_low <= 0.0 or u.start < w.start - beyond
    u_high: cython.bint = at_high < -margin or slope_high >= 0.0 or u.stop > w.stop + beyond
    w_low: cython.bint = at_low > margin or slope_low >= 0.0 or w.start < u.start - beyond
    w_high: cython.bint = at_high > margin or slope_high <= 0.0 or w.stop > u.stop + beyond
    is_safe: cython.bint
    # The difference has at most one extremum: where the line through both roots meets the half-edge.
    if at_low <= 0.0 and at_high <= 0.0:
        is_safe = u_low and u_high and (slope_low <= 0.0 or slope_high >= 0.0 or _is_farther(u, w))
        s.n_ties += is_tie and is_safe
        return U_NEARER if is_safe else UNDECIDED
    if at_low >= 0.0 and at_high >= 0.0:
        is_safe = w_low and w_high and (slope_low >= 0.0 or slope_high <= 0.0 or _is_farther(w, u))
        s.n_ties += is_tie and is_safe
        return W_NEARER if is_safe else UNDECIDED
    s.n_ties += is_tie
    error: cython.double = 0.0
    x: cython.double = b / a if is_square else _meeting(u, w, low, high, at_low, at_high, cython.address(error))
    if at_low < 0.0:
        until[0] = min(x + error, high) if w_high else high
        until[1] = max(x - error, low) if u_low else low
        return U_THEN_W
    until[1] = min(x + error, high) if u_high else high
    until[0] = max(x - error, low) if w_low else low
    return W_THEN_U


@cython.cfunc
@cython.nogil
def _gives_way(u: p_window, w: p_window, low: cython.double, high: cython.double) -> cython.int:
    """Remove from w the interval in which u is nearer. 2: nothing is left, 4: the rest precedes u, 0: it follows u."""
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
@cython.nogil
def _overlap_little(u: p_window, w: p_window) -> cython.bint:
    """Whether two windows overlap by too little of both to be worth a comparison, or not at all.

    Evaluated without branches, since the cases alternate unpredictably.
    """
    low: cython.double = u.start if u.start > w.start else w.start
    high: cython.double = u.stop if u.stop < w.stop else w.stop
    overlap: cython.double = high - low
    return (overlap < OVERLAP * (u.stop - u.start)) & (overlap < OVERLAP * (w.stop - w.start))


@cython.cfunc
@cython.nogil
def _settle(s: p_search, u: p_window, w: p_window) -> cython.int:
    """Trim two windows where the other is nearer. 1: nothing is left of u, 2: nothing of w, 4: w precedes u."""
    low: cython.double = u.start if u.start > w.start else w.start
    high: cython.double = u.stop if u.stop < w.stop else w.stop
    until: cython.double[2]
    first: cython.int = 4 * ((w.start < u.start) & (w.stop < u.stop))
    if _overlap_little(u, w):
        return first
    order = _compare(s, u, w, low, high, until)
    if order == U_NEARER:
        return _gives_way(u, w, low, high)
    if order == W_NEARER:
        order = _gives_way(w, u, low, high)
        if order == 2:
            return 1
        # The rest of u precedes w, unless w starts first.
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
def _cut_by_ends(w: p_window, a: cython.double, b: cython.double) -> cython.bint:
    """Trim a window where the path over an end of the half-edge is shorter; whether anything is left.

    At arc length s of the half-edge, the path over the tail is a + s longer than the offset of the window, and the path
    over the head b - s.
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
    # The usual case with one branch: the whole window is kept.
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
            # In this form, there is no cancellation if the root is near the line of the half-edge.
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
def _goes_on(u: p_window, w: p_window, length: cython.double, is_many: cython.bint) -> cython.bint:
    """Whether u and w are two halves of one window, split at a flat vertex, and can be merged.

    If the windows passed a vertex close to the root on its two sides, their roots may agree to rounding although their
    lines leave in directions that differ by the curvature of the vertex: (turn_x, turn_y) then differs. Faces at an
    edge of more than two (`is_many`) have no common orientation, so directions are not compared there.
    """
    if fabs(u.x - w.x) > SAME * (fabs(w.x) + w.depth):
        return False
    if not is_many and u.corner == w.corner and fabs(u.turn_x - w.turn_x) + fabs(u.turn_y - w.turn_y) > TURNED:
        return False
    return (
        u.root == w.root
        and fabs(u.offset - w.offset) <= (SAME * (fabs(w.offset) + length) if w.is_plane else 0.0)
        and fabs(u.depth - w.depth) <= SAME * (fabs(w.x) + w.depth)
        and u.start <= w.stop + ROUNDING * length
        and w.start <= u.stop + ROUNDING * length
    )


@cython.cfunc
@cython.nogil
def _is_next(u: p_window, w: p_window) -> cython.bint:
    """Whether w has another root, follows u and hardly overlaps it: then `_insert` would append it unchanged."""
    is_before: cython.bint = (w.start < u.start) & (w.stop < u.stop)
    is_other: cython.bint = fabs(u.x - w.x) > SAME * (fabs(w.x) + w.depth)
    return is_other & (not is_before) & _overlap_little(u, w)


@cython.cfunc
@cython.nogil
def _insert(
    s: p_search, windows: p_window, k: cython.int, w: p_window, length: cython.double, is_many: cython.bint
) -> cython.int:
    """Trim a window w and k trimmed windows against each other, and insert w; returns the new number of windows.

    The k windows are sorted along the half-edge. Over an edge of more than two faces (`is_many`) their order is
    arbitrary, so w is compared with all of them. `w` may point behind the k windows of the same array.
    """
    j: cython.int = k
    moved: Window
    u: p_window
    s.n_ties = 0
    while j > 0:
        u = windows + (j - 1)
        if (is_many or (j == k and u.start <= w.start)) and _goes_on(u, w, length, is_many):
            u.start, u.stop = min(u.start, w.start), max(u.stop, w.stop)
            return k
        outcome = _settle(s, u, w)
        # Which of three windows equal to rounding stays depends on the others in the list.
        s.meets_ties = s.meets_ties or s.n_ties > 1
        if outcome == 1 or u.stop <= u.start:
            if j < k:
                memmove(u, u + 1, (k - j) * cython.sizeof(Window))
            k -= 1
            j -= 1
            if outcome == 2:
                return k
            continue
        if outcome == 2 or w.stop <= w.start:
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
@cython.nogil
def _bound_over(s: p_search, v: cython.int, length: cython.double) -> cython.double:
    """The distance at an end of a half-edge that paths over this end have: that of vertex v, with slack for rounding.

    The slack has a share of the edge length too, since a straight path past a vertex near the root may have the length
    of the path over it to rounding. The slack is negative at vertices from which paths leave into all faces: if more
    than two faces meet at each of its edges, windows that pass it by rounding would multiply with the paths around it.
    """
    slack: cython.double = -MARGIN if not s.is_delaunay and s.kind[v] == JOINS else s.tolerance
    return s.upper[v] + slack * (s.upper[v] + length)


def trim(s, windows, n, h):
    """Trim windows where a path over an end of h or through another window is shorter; returns how many are left."""
    k: cython.int = 0
    w: p_window
    length: cython.double = s.length[h]
    # Over an edge of more than two faces, windows are not sorted, and those of one root may come along several paths.
    is_many: cython.bint = s.twin[h] == -2
    from_tail: cython.double = _bound_over(s, s.vertex[next_half_edge(h)], length)
    from_head: cython.double = _bound_over(s, s.vertex[previous_half_edge(h)], length) + length
    for i in range(n):
        w = windows + i
        if not _cut_by_ends(w, from_tail - w.offset, from_head - w.offset):
            continue
        if w.stop <= w.start:
            continue
        # The usual case: the window follows the last one, and is not a half of it.
        if k == 0 or (not is_many and _is_next(windows + (k - 1), w)):
            if k < i:
                windows[k] = w[0]
            k += 1
        else:
            k = _insert(s, windows, k, w, length, is_many)
    return k


def is_covered(s, before, n_before, windows, n, h):
    """Whether n trimmed windows, or paths over the ends, give the windows before trimming no larger distance."""
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
                if w.start - 2.0 * ROUNDING * length <= at <= w.stop + 2.0 * ROUNDING * length:
                    nearest = min(nearest, w.offset + reach(w, at))
            for k in range(s.kept[h].count if s.kept != cython.NULL else 0):
                w = s.kept[h].windows + k
                if w.start <= at <= w.stop:
                    nearest = min(nearest, w.offset + reach(w, at))
            if not is_within(nearest, reached, length):
                return False
    return True


def trim_by_kept(s, windows, n, h, turns):
    """Trim windows where one that crossed h before is shorter; returns how many are left.

    Far from the ends of a needle, lines that wind around it reach each half-edge after those of the winding before have
    crossed, and the ends are too far away to trim them. So the windows that cross are kept. Both are trimmed where the
    other is shorter, as in a list: of several paths to a point the shortest stays.

    Lines turn around a vertex less than once, so those that wind begin to turn around others again and again. Only
    where they do (`turns`, see `List`), and next to the ends of h, are windows compared and kept: in a fan of triangles
    each spoke is crossed by windows from all of them, most of which are the shortest somewhere.
    """
    j: cython.int
    k: cython.int = 0
    u: p_window
    w: p_window
    if s.kept == cython.NULL:
        s.kept = cython.cast(p_list, calloc(s.n_half_edges, cython.sizeof(List)))
        if s.kept == cython.NULL:
            s.failed = True
            return 0
    kept: p_list = s.kept + h
    if kept.count + n > kept.capacity:
        room: cython.p_int = cython.address(kept.capacity)
        more = grown(kept.windows, room, kept.count + n, cython.sizeof(Window), cython.address(s.failed))
        kept.windows = cython.cast(p_window, more)
        if s.failed:
            return 0
    for i in range(n):
        w = windows + i
        if not -1 <= turns <= 1 and w.start > 0.0 and w.stop < s.length[h]:
            windows[k] = w[0]
            k += 1
            continue
        j = 0
        while j < kept.count:
            s.n_compared += 1
            u = kept.windows + j
            outcome: cython.int = 0 if _overlap_little(u, w) else _settle(s, u, w)
            if outcome == 2 or w.stop <= w.start:
                break
            if outcome == 1 or u.stop <= u.start:
                kept.count -= 1
                u[0] = kept.windows[kept.count]
            else:
                j += 1
        else:
            kept.windows[kept.count] = windows[k] = w[0]
            kept.count += 1
            k += 1
    return k
