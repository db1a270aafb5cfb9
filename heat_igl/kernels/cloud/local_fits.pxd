cdef extern from *:
    """
    // Least weight of a neighbour.
    #define LEAST_WEIGHT 1e-3
    // Lengths are divided by no less.
    #define TINY 2.3e-308
    // Points on a line leave a quadric undetermined; so much on the diagonal, per neighbour, makes the smallest one.
    #define DIAGONAL 1e-9
    """
    double LEAST_WEIGHT, TINY, DIAGONAL

cdef double _around(const double[:, ::1] P, const int[::1] index, double[:, ::1] local) noexcept nogil
cdef double _along(double[::1] axis, double[::1] term) noexcept nogil
cdef void _moments(double[:, ::1] local, int n, double* moment) noexcept nogil
cdef void _eliminate(double* system) noexcept nogil
cdef double _principal(double[:, ::1] local, double[:, ::1] axes) noexcept nogil
