"""Windows lose the parts of their half-edge that another path reaches sooner.

That path leads over an end of the half-edge (Xin and Wang 2009), or through another window of the list.
"""

import cython
from cython.cimports.heat_igl.kernels.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.window_structures import NARROW, OVERLAP, SAME, Search, Window
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.libc.string import memmove


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
def trim(s: cython.pointer(Search), windows: cython.pointer(Window), n: cython.int, h: cython.int) -> cython.int:
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
