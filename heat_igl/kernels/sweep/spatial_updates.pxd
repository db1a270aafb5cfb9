# Distance across one triangle or tetrahedron with edge lengths of its own, from those of the corners from one source.

from libc.math cimport INFINITY, sqrt

cdef extern from *:
    """
    // Height of a triangle over its base below which spheres about the corners lose too many digits where they meet.
    #define FLAT 1e-3
    """
    double FLAT

# Lengths of the edges of a tetrahedron with corners a, b, c and v.
cdef struct Edges:
    double ab, ac, bc, va, vb, vc


cdef inline double foot(double here, double there, double base) noexcept nogil:
    # Where the perpendicular from a point meets the line of the base: from the end at distance `here`, to that at `there`.
    return 0.5 * ((here - there) * (here + there) / base + base)


cdef inline double across_base(const Edges* e, double da, double db, double dc) noexcept nogil:
    # Distance at v if the straight line passes the triangle abc, else inf.
    #
    # a in the origin, b on the first axis, c in the plane of the first two, v above it. The source lies below, where
    # the spheres about the corners meet.
    cdef double cx = foot(e.ac, e.bc, e.ab)
    cdef double cy = sqrt(max(e.ac * e.ac - cx * cx, 0.0))
    if not cy > FLAT * e.ab:
        return INFINITY
    cdef double x = foot(da, db, e.ab)
    cdef double y = 0.5 * ((da - dc) * (da + dc) + e.ac * e.ac - 2 * cx * x) / cy
    cdef double z_squared = da * da - x * x - y * y
    if not z_squared >= 0:
        return INFINITY
    cdef double z = sqrt(z_squared)
    cdef double vx = foot(e.va, e.vb, e.ab)
    cdef double vy = 0.5 * ((e.va - e.vc) * (e.va + e.vc) + e.ac * e.ac - 2 * cx * vx) / cy
    cdef double vz = sqrt(max(e.va * e.va - vx * vx - vy * vy, 0.0))
    # The straight line meets the plane in (px, py), times z + vz.
    cdef double height = z + vz
    cdef double px = x * vz + vx * z
    cdef double py = y * vz + vy * z
    cdef double of_c = py / cy
    cdef double of_b = (px - of_c * cx) / e.ab
    if of_c >= 0 and of_b >= 0 and of_b + of_c <= height:
        return sqrt((vx - x) * (vx - x) + (vy - y) * (vy - y) + height * height)
    return INFINITY
