from libc.math cimport sqrt

cdef extern from *:
    """
    // Part by which a way may be longer than a straight line and still be one.
    #define STRAIGHT_LINE 1e-6
    """
    double STRAIGHT_LINE

cdef inline double straight(const double* p, const double* q) noexcept nogil:
    # Length of the straight line between two positions.
    cdef double x = p[0] - q[0]
    cdef double y = p[1] - q[1]
    cdef double z = p[2] - q[2]
    return sqrt(x * x + y * y + z * z)
