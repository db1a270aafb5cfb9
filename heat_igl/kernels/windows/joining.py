"""Neighbouring windows become one, as far as the tolerance allows.

A joined window has the first line of its first part and the last line of its last part, so that its lines lead to the
same places: its neighbours end where it begins, before and behind every face. The two lines meet in a point, the root;
they may meet ahead of the half-edge, since a front behind which there is positive curvature contracts, and distance
is then the offset less the distance of that point. The offset grows linearly along the half-edge, such that distance
stays what it was at both ends: it is continuous from one window to the next, and no window takes from its neighbour
what its neighbour's lines lead to.

What a window has lost of distance by joining is carried along: the largest difference on the half-edge, and what the
offset may change when lines are no longer crossed at equal shares of their side. A window is not joined beyond the
fraction `accuracy` of its distance. Where lines of two windows separate behind a cut, neither is cut there.
"""

import cython
from cython.cimports.heat_igl.kernels.windows.front import has_room
from cython.cimports.heat_igl.kernels.windows.structures import (
    AROUND_APEX,
    CROSSED_AROUND_APEX,
    FARTHEST_MEETING,
    FEW_JOINED,
    FIRST,
    LONG,
    LONG_LISTS,
    NARROW,
    NEAR,
    NEAREST_FOCUS,
    OFTEN,
    ONE_IN,
    PAIRS,
    SELDOM,
    Apex,
    List,
    Search,
    Window,
    as_joined,
    backward,
    direction,
    reach,
)
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.libc.string import memmove

# Each step makes the error of a place smaller by how fast the offset changes along the half-edge, some thousandths.
_STEPS = cython.declare(cython.int, 4)


@cython.cfunc
@cython.inline
@cython.nogil
def _distance(w: cython.pointer(cython.const[Window]), at: cython.double) -> cython.double:
    return w.offset + reach(w, at)


def may_join(s: cython.pointer(Search)) -> cython.bint:
    """Whether windows are joined, or it is not yet decided that they are not."""
    return s.accuracy > 0.0 and (s.is_joining or FIRST * s.n_lists_done < s.n_half_edges)


def join(s: cython.pointer(Search), one: cython.pointer(List), n: cython.int, h: cython.int) -> cython.int:
    """Join the n windows of a list on half-edge h where it pays, and close gaps; how many there are then."""
    if not s.is_joining:
        if not may_join(s):
            return n
        s.n_long += n >= LONG
        s.is_joining = s.n_long > LONG_LISTS and ONE_IN * s.n_long > s.n_lists_done
        if not s.is_joining:
            return n
        _begin(s)
    n = _fill_gaps(s, one, n, h)
    if s.n_lists_done % s.join_every == 0 and not s.failed:
        n = _join_neighbours(s, one.windows, n, h)
    return n


@cython.cfunc
@cython.nogil
def _begin(s: cython.pointer(Search)) -> cython.void:
    """Give all windows that wait, those of the list that is crossed among them, the form of joined ones."""
    for i in range(s.n_lists):
        if s.lists[i].half_edge >= 0:
            for j in range(s.lists[i].count):
                as_joined(s, s.lists[i].windows + j)


@cython.cfunc
@cython.nogil
def _join_neighbours(
    s: cython.pointer(Search), windows: cython.pointer(Window), n: cython.int, h: cython.int
) -> cython.int:
    """Join windows that lie side by side on half-edge h; how many are left."""
    k: cython.int = 1
    length: cython.double = s.length[h]
    for i in range(1, n):
        if _join(s, windows + (k - 1), windows + i, length):
            continue
        if k < i:
            windows[k] = windows[i]
        k += 1
    s.n_pairs += n - 1
    s.n_joined += n - k
    if s.n_pairs > PAIRS:
        s.join_every = min(2 * s.join_every, SELDOM) if FEW_JOINED * s.n_joined < s.n_pairs else OFTEN
        s.n_pairs = s.n_joined = 0
    return k


@cython.cfunc
@cython.nogil
def _span(
    u: cython.pointer(Window),
    start: cython.double,
    w: cython.pointer(Window),
    stop: cython.double,
    length: cython.double,
    one: cython.pointer(Window),
) -> cython.double:
    """Make the window between a line of u and one of w, with the distances of both; the change of its offset between.

    -1 if the lines are parallel to rounding, or meet ahead before a few faces are crossed. `turn_y` takes the smaller
    one of the distances at both ends.
    """
    rise: cython.double = direction(u, start)
    other_rise: cython.double = direction(w, stop)
    spread: cython.double = other_rise - rise
    # How much longer a line is than what it rises, and the offsets at which the lines come.
    slant: cython.double = sqrt(1.0 + rise * rise)
    other_slant: cython.double = sqrt(1.0 + other_rise * other_rise)
    first: cython.double = u.offset + u.turn_x * start
    last: cython.double = w.offset + w.turn_x * stop
    one[0] = u[0]
    one.start, one.stop = start, stop
    one.turn_y = min(first + u.depth * slant, last + w.depth * other_slant)
    if fabs(spread) * FARTHEST_MEETING * length <= stop - start:
        return -1.0
    one.depth = (stop - start) / spread
    if -NEAREST_FOCUS * length < one.depth < 0.0:
        return -1.0
    one.x = start - rise * one.depth
    first += (u.depth - one.depth) * slant
    last += (w.depth - one.depth) * other_slant
    one.turn_x = (last - first) / (stop - start)
    one.offset = first - one.turn_x * start
    return fabs(last - first)


@cython.cfunc
@cython.nogil
def _join(
    s: cython.pointer(Search), u: cython.pointer(Window), w: cython.pointer(Window), length: cython.double
) -> cython.bint:
    """Let u take the place of both, if distance stays within the tolerance."""
    one: Window
    at: cython.double = 0.5 * (u.stop + w.start)
    error: cython.double = max(u.turn_y, w.turn_y)
    # Side by side: neither is inside the other.
    if w.start - u.stop > NEAR * length or w.start <= u.start or w.stop <= u.stop:
        return False
    more = _span(u, u.start, w, w.stop, length, cython.address(one))
    room: cython.double = s.accuracy * one.turn_y - error
    if more < 0.0 or room <= 0.0:
        return False
    # Where the lines diverge, or meet ahead, equal shares of a side do not stay equal.
    if one.depth > 0.0:
        more *= min(1.0, (one.stop - one.start) / one.depth)
    if more > room:
        return False
    more = max(more, fabs(_distance(cython.address(one), at) - min(_distance(u, at), _distance(w, at))))
    if more > room:
        return False
    more = max(more, _change_at(cython.address(one), u, 0.5 * (u.start + at)))
    more = max(more, _change_at(cython.address(one), w, 0.5 * (w.stop + at)))
    if more > room:
        return False
    one.turn_y = error + more
    u[0] = one
    return True


@cython.cfunc
@cython.nogil
def _fill_gaps(s: cython.pointer(Search), one: cython.pointer(List), n: cython.int, h: cython.int) -> cython.int:
    """Windows between neighbours on half-edge h whose lines separate: how many there are then.

    Errors may shift distances against each other so that what lay between is gone. As in a joined window, the lines
    are those between the last line of one and the first of the other.
    """
    i: cython.int = 1
    last: cython.int = 0
    w: cython.pointer(Window)
    gap: Window
    while i < n:
        if _between(s, one.windows, n, last, i, s.length[h], cython.address(gap)):
            if not has_room(one, n - one.count + 1):
                s.failed = True
                return n
            w = one.windows + i
            memmove(w + 1, w, (n - i) * cython.sizeof(Window))
            w[0] = gap
            n += 1
            i += 1
        if one.windows[i].stop > one.windows[last].stop:
            last = i
        i += 1
    return n


@cython.cfunc
@cython.nogil
def _is_covered(
    windows: cython.pointer(Window), n: cython.int, start: cython.double, stop: cython.double
) -> cython.bint:
    """Whether a window reaches into an interval: lists are nearly in order."""
    for j in range(n):
        if windows[j].start < stop and windows[j].stop > start:
            return True
    return False


@cython.cfunc
@cython.nogil
def _between(
    s: cython.pointer(Search),
    windows: cython.pointer(Window),
    n: cython.int,
    before: cython.int,
    behind: cython.int,
    length: cython.double,
    gap: cython.pointer(Window),
) -> cython.bint:
    """Whether two of n windows have a gap between whose lines separate; makes the window that closes it."""
    u: cython.pointer(Window) = windows + before
    w: cython.pointer(Window) = windows + behind
    if w.start <= u.stop + NEAR * length:
        return False
    if direction(w, w.start) <= direction(u, u.stop) or _is_covered(windows, n, u.stop, w.start):
        return False
    more = _span(u, u.stop, w, w.start, length, gap)
    # Nothing is known of distance between, but that it has no larger kink than that of the lines.
    gap.turn_y = max(u.turn_y, w.turn_y) + more
    gap.turn_y += 0.125 * (w.start - u.stop) * (direction(w, w.start) - direction(u, u.stop))
    return more >= 0.0 and gap.turn_y < 2.0 * s.accuracy * _distance(u, u.stop)


@cython.cfunc
@cython.inline
@cython.nogil
def _change_at(u: cython.pointer(Window), w: cython.pointer(Window), at: cython.double) -> cython.double:
    return fabs(_distance(u, at) - _distance(w, at))


def cut_joined_by_ends(w: cython.pointer(Window), a: cython.double, b: cython.double) -> cython.bint:
    """Cut what is nearer over the ends of the half-edge, see `crossing._cut_by_ends`; whether anything is left."""
    at_start: cython.double = reach(w, w.start)
    at_stop: cython.double = reach(w, w.stop)
    if at_stop > a + w.stop or at_start > b - w.start:
        return False
    if at_start > a + w.start:
        w.start = _as_long(w, a, 1.0, w.start)
    if at_stop > b - w.stop:
        w.stop = _as_long(w, b, -1.0, w.stop)
    return True


@cython.cfunc
@cython.nogil
def _as_long(
    w: cython.pointer(cython.const[Window]), more: cython.double, sign: cython.double, at: cython.double
) -> cython.double:
    """Where the way over an end is as long, starting from `at`: with a fixed offset it is a point of a hyperbola."""
    for _ in range(_STEPS):
        constant = more - w.turn_x * at
        at = constant + sign * w.x
        if at == 0.0:
            break
        at = 0.5 * (w.x + sign * (w.depth * w.depth / at - constant))
    return min(max(at, w.start), w.stop)


@cython.cfunc
@cython.inline
@cython.nogil
def _along_side(
    at: cython.double,
    along: cython.double,
    depth: cython.double,
    cosine: cython.double,
    sine: cython.double,
    length: cython.double,
    otherwise: cython.double,
) -> cython.double:
    """Where a line that goes `along` while it rises by `depth` meets a side, from its lower end; at most the apex.

    A line along the side meets it anywhere, and to rounding before its end or not at all: then it is taken for
    `otherwise`, such that the window becomes wider.
    """
    place: cython.double = at * depth / (cosine * depth - along * sine)
    return min(place, length) if place >= 0.0 else otherwise


def carry_joined(
    w: cython.pointer(cython.const[Window]),
    apex: cython.pointer(cython.const[Apex]),
    to_left: cython.bint,
    out: cython.pointer(Window),
) -> cython.bint:
    """Make the window over the side to the left or right of the apex; true if there is one.

    Each line keeps its offset. If the lines meet inside the face, they are in reverse order behind.
    """
    # Of the first line over this side, from its lower end, and of the last: places, and offsets.
    of_low: cython.double = w.offset + w.turn_x * w.start
    of_high: cython.double = w.offset + w.turn_x * w.stop
    is_around: cython.bint = w.side == AROUND_APEX or w.side == CROSSED_AROUND_APEX
    out[0] = w[0]
    if to_left:
        length = apex.left_length
        out.x = w.x * apex.cos_left - w.depth * apex.sin_left
        out.depth = w.x * apex.sin_left + w.depth * apex.cos_left
        low = _along_side(w.start, w.start - w.x, w.depth, apex.cos_left, apex.sin_left, length, 0.0)
        high = _along_side(w.stop, w.stop - w.x, w.depth, apex.cos_left, apex.sin_left, length, length)
    else:
        length = apex.right_length
        at = apex.length - w.x
        out.x = length - (at * apex.cos_right - w.depth * apex.sin_right)
        out.depth = at * apex.sin_right + w.depth * apex.cos_right
        at = apex.length - w.start
        low = length - _along_side(at, w.x - w.start, w.depth, apex.cos_right, apex.sin_right, length, length)
        at = apex.length - w.stop
        high = length - _along_side(at, w.x - w.stop, w.depth, apex.cos_right, apex.sin_right, length, 0.0)
    # Lines that come from their root do not go back to it.
    if out.depth == 0.0 or (w.depth > 0.0 and out.depth < 0.0):
        return False
    if is_around:
        at = min(max(backward(w, apex.x, apex.y), w.start), w.stop)
        if to_left:
            if w.side == CROSSED_AROUND_APEX:
                low, of_low = high, of_high
            high, of_high = length, w.offset + w.turn_x * at
        else:
            if w.side == CROSSED_AROUND_APEX:
                high, of_high = low, of_low
            low, of_low = 0.0, w.offset + w.turn_x * at
    elif low > high:
        low, high, of_low, of_high = high, low, of_high, of_low
    out.start, out.stop = low, high
    if not out.stop - out.start > NARROW * length:
        return False
    out.turn_x = (of_high - of_low) / (high - low)
    out.offset = of_low - out.turn_x * low
    return True
