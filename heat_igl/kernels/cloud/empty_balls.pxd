cdef enum:
    # Balls along so many directions at a time, which a vector holds.
    LANES = 4

cdef extern from *:
    """
    // Steps from the largest ball to the mean direction of its side.
    #define ROUNDS 3
    // Lengths are divided by no less.
    #define TINY 1e-300
    """
    double TINY
    int ROUNDS

cdef double _invert(const double[:, ::1] P, const int[::1] index, const double[:, ::1] axes,
                    float[:, ::1] inverted) noexcept nogil
cdef void _shares(float[:, ::1] inverted, const float[:, ::1] directions, float[:, ::1] share) noexcept nogil
cdef void _average(const float[:, ::1] directions, float[:, ::1] share, double[::1] normal) noexcept nogil
cdef bint _sees_the_same(Py_ssize_t i, Py_ssize_t j, const double[:, ::1] normals, const double[:, ::1] radii,
                         double[:, :, ::1] centre) noexcept nogil
