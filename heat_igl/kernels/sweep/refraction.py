"""Kernel of refraction: the fastest way through an edge that has one length before it and another behind it."""

import cython
from cython.cimports.heat_igl.kernels.sweep.refraction import Refracted
from cython.cimports.libc.math import INFINITY, sqrt

__all__: list[str] = []


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def refracted(
    x: cython.double,
    y: cython.double,
    base: cython.double,
    along: cython.double,
    height: cython.double,
    behind: cython.double,
) -> Refracted:
    """Snell's law at one edge, by Fermat's principle.

    Before the edge of length `base` the source lies `x` along it and `y` away from it. Behind the edge, which has the
    length `behind` there, the point lies `along` and `height` away. The length of the way is convex in the share of the
    edge at which it crosses, and least between the ends, or at one of them: then `share` is 0 or 1.
    """
    way: Refracted
    low: cython.double = 0.0
    high: cython.double = 1.0
    _k: cython.int
    way.share, way.length, way.behind, way.radius = 0.0, INFINITY, 0.0, 0.0
    if _slope(0.0, base, behind, x, along, y, height) >= 0:
        return way
    way.share = 1.0
    if _slope(1.0, base, behind, x, along, y, height) <= 0:
        return way
    way.share = 0.5
    for _k in range(60):
        slope: cython.double = _slope(way.share, base, behind, x, along, y, height)
        if slope > 0:
            high = way.share
        else:
            low = way.share
        first: cython.double = _far(way.share * base - x, y)
        second: cython.double = _far(way.share * behind - along, height)
        bend: cython.double = 0.0
        if first > 0:
            bend += (base * y / first) * (base * y / first) / first
        if second > 0:
            bend += (behind * height / second) * (behind * height / second) / second
        step: cython.double = slope / bend if bend > 0 else 2.0
        to: cython.double = way.share - step
        if not low < to < high:
            to = 0.5 * (low + high)
        if abs(to - way.share) <= 1e-12:
            break
        way.share = to
    first = _far(way.share * base - x, y)
    second = _far(way.share * behind - along, height)
    way.length, way.behind = first + second, second
    # The front keeps its second derivative along the edge: radius over the square of the sine of the angle to it.
    sine: cython.double = base * y * second
    if first > 0 and sine > 0:
        sine = behind * height * first / sine
        way.radius = first * sine * sine + second
    else:
        way.radius = INFINITY
    return way


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _far(a: cython.double, b: cython.double) -> cython.double:
    return sqrt(a * a + b * b)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _slope(
    share: cython.double,
    base: cython.double,
    behind: cython.double,
    x: cython.double,
    along: cython.double,
    y: cython.double,
    height: cython.double,
) -> cython.double:
    """Derivative of the length of the way by `share`; at a source on the edge, into the edge."""
    first: cython.double = _far(share * base - x, y)
    second: cython.double = _far(share * behind - along, height)
    slope: cython.double = base if share < 0.5 else -base
    if first > 0:
        slope = base * (share * base - x) / first
    if second > 0:
        slope += behind * (share * behind - along) / second
    return slope
