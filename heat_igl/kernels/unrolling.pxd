cdef struct InPlane:
    double x, y

cdef extern from *:
    """
    // Squared slope above which a neighbour is unrolled into the tangent plane, instead of projected.
    #define STEEP 0.1
    // Sine of the angle between two planes below which the line in which they meet is not known well.
    #define ALIKE 0.2
    """
    double ALIKE, STEEP

cdef InPlane in_plane(
    const double[:, ::1] P, const double[:, :, ::1] axes, Py_ssize_t i, Py_ssize_t j
) noexcept nogil
