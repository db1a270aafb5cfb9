# The updates of the sweep: distance from the source of one vertex, from those of the corners of triangles laid out flat.
#
# A spoke s of v has the triangle to its left: corners v, a = s.neighbour and b = s.next_neighbour. In the plane, a is
# the origin, b lies on the first axis at s.base, v above it at (s.along, s.height); w, the corner of the triangle beyond
# ab, lies below it at (s.beyond_along, -s.beyond_depth). da, db, dw, dv are distances from one source at these corners.

from heat_igl.kernels.sweep.spokes cimport Spoke
from libc.math cimport INFINITY, fabs, sqrt

cdef extern from *:
    """
    // Part of an edge by which a source has to lie beyond it: circles about its ends, nearly touching, lose digits.
    #define CLOSE 1e-3
    """
    double CLOSE


cdef inline bint crosses_side(double da, double db, const Spoke* s, double* squared) noexcept nogil:
    # Whether the straight line from a point source to v crosses ab; the squared distance at v, if it does.
    #
    # Without branches, which at random cost more than the arithmetic: the caller counts by the result, or discards it.
    cdef double x = 0.5 * ((da - db) * (da + db) / s.base + s.base)
    cdef double y_squared = da * da - x * x
    cdef double y = sqrt(fabs(y_squared))  # a choice of the larger of this and 0 would be a branch
    cdef double crossing = x * s.height + s.along * y  # times y + height
    squared[0] = (s.along - x) * (s.along - x) + (s.height + y) * (s.height + y)
    return (y_squared >= 0) & (crossing >= 0) & (crossing <= (y + s.height) * s.base)


cdef inline double across_side(double da, double db, const Spoke* s) noexcept nogil:
    # Squared distance at v from a point source: infinite unless the straight line between them crosses ab.
    cdef double squared
    return squared if crosses_side(da, db, s, &squared) else INFINITY


cdef inline double front_across_side(double da, double db, const Spoke* s) noexcept nogil:
    # Distance at v of a straight front: infinite unless the line along which it comes to v crosses ab.
    cdef double slope = (db - da) / s.base
    cdef double rise_squared = 1.0 - slope * slope
    cdef double rise = sqrt(max(rise_squared, 0.0))
    cdef double foot = s.along * rise - s.height * slope  # times rise
    cdef bint is_crossed = (foot >= 0) & (foot <= rise * s.base)
    return da + slope * s.along + rise * s.height if is_crossed else INFINITY


cdef inline bint comes_nearer_to_a(double da, double db, const Spoke* s) noexcept nogil:
    # Whether a straight front comes to v across ab nearer to a than to b.
    cdef double slope = (db - da) / s.base
    cdef double rise = sqrt(max(1.0 - slope * slope, 0.0))
    return s.along * rise - s.height * slope < 0.5 * rise * s.base


cdef inline double across_two(double da, double db, double dw, const Spoke* s) noexcept nogil:
    # Squared distance at v from a point source behind ab, as w and one of a and b know it.
    #
    # The line to the source as a and b know it leaves the farther triangle between w and p, one of them; it is drawn
    # anew to the intersection of circles about p and w. If that is on the other side of w, the path bends at w.
    # Infinite if a and b know better: the source lies in the farther triangle, or hidden by p.
    cdef double wx = s.beyond_along
    cdef double wy = s.beyond_depth
    cdef double x = 0.5 * ((da - db) * (da + db) / s.base + s.base)
    cdef double y = sqrt(max(da * da - x * x, 0.0))
    cdef double ux = s.along - wx
    cdef double uy = s.height + wy
    cdef bint is_right = ux * (y + s.height) < uy * (s.along - x)
    cdef double sign = 1.0 if is_right else -1.0
    cdef double px = 0.0 if is_right else s.base
    cdef double dp = da if is_right else db
    cdef double ex = wx - px
    cdef double square = ex * ex + wy * wy
    if not sign * (y * ex - (x - px) * wy) > CLOSE * square:
        return INFINITY
    cdef double along = 0.5 * ((dp - dw) * (dp + dw) / square + 1.0)
    cdef double h = sign * sqrt(max(dp * dp / square - along * along, 0.0))
    # From the source to v.
    cdef double sx = s.along - px - along * ex + h * wy
    cdef double sy = s.height + along * wy + h * ex
    cdef double bent
    if sign * (ux * sy - uy * sx) > 0:
        bent = sqrt(ux * ux + uy * uy) + dw
        return bent * bent
    return sx * sx + sy * sy if sign * ((s.along - px) * sy - s.height * sx) >= 0 else INFINITY


cdef inline double over_one(double dp, double dw, bint is_right, const Spoke* s) noexcept nogil:
    # Squared distance at v from a point source that w and one end p of ab know: a if `is_right`, else b.
    #
    # Infinite unless the straight line from v crosses ab, and then passes between p and w.
    cdef double sign = 1.0 if is_right else -1.0
    cdef double px = 0.0 if is_right else s.base
    cdef double ex = s.beyond_along - px
    cdef double wy = s.beyond_depth
    cdef double square = ex * ex + wy * wy
    cdef double along = 0.5 * ((dp - dw) * (dp + dw) / square + 1.0)
    cdef double h_squared = dp * dp / square - along * along
    if not (square > 0 and h_squared >= 0):
        return INFINITY
    cdef double h = sign * sqrt(h_squared)
    # From the source to v.
    cdef double sx = s.along - px - along * ex + h * wy
    cdef double sy = s.height + along * wy + h * ex
    cdef double ux = s.along - s.beyond_along
    cdef double uy = s.height + wy
    cdef double crossing = s.along * sy - s.height * sx  # of ab, times sy
    if (
        sy > 0
        and 0.0 <= crossing <= s.base * sy
        and sign * ((s.along - px) * sy - s.height * sx) >= 0
        and sign * (ux * sy - uy * sx) <= 0
    ):
        return sx * sx + sy * sy
    return INFINITY


cdef inline double beyond_side(
    double base, double along, double height, double side, double db, double dv
) noexcept nogil:
    # Squared distance at a from a point source by a straight line across vb, of length `side`; infinite if there is none.
    #
    # For b instead of a, the triangle is reflected: along is then counted from b, `side` is va, and da takes db's place.
    cdef double per_side = 1.0 / (side * side)
    cdef double x = 0.5 * ((dv - db) * (dv + db) * per_side + 1.0)
    cdef double y_squared = dv * dv * per_side - x * x
    if not y_squared >= 0:
        return INFINITY
    cdef double y = sqrt(y_squared)
    cdef double sx = along + x * (base - along) + y * height
    cdef double sy = height - x * height + y * (base - along)
    return sx * sx + sy * sy if sy >= 0 and along * sy <= height * sx else INFINITY
