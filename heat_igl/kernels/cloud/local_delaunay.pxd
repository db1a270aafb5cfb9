cdef enum:
    # Columns of the neighbours of a point: angle around it, and the coordinates of the inverted neighbour.
    ANGLE = 0
    X = 1
    Y = 2
    # The star of so many nearest neighbours rules out most of the others. 6 and 16: 1 and 3 % more time for a cloud.
    FEW = 10

cdef Py_ssize_t _neighbours_around(Py_ssize_t i, const double[:, ::1] P, const double[:, :, ::1] axes,
                                   const int[:, ::1] neighbours, const double[::1] least_cosine, double[:, ::1] star, int[::1] members, int[::1] stack) noexcept nogil
cdef Py_ssize_t _visible_hull(Py_ssize_t size, double[:, ::1] star, int[::1] stack) noexcept nogil
cdef double _reach(Py_ssize_t top, double[:, ::1] star, int[::1] stack) noexcept nogil
cdef Py_ssize_t _triangles(Py_ssize_t i, Py_ssize_t top, double[:, ::1] star, int[::1] members, int[::1] stack,
                           double largest, int[:, ::1] found, Py_ssize_t m) noexcept nogil
cdef double _square(double[:, ::1] star, Py_ssize_t a) noexcept nogil
cdef bint _is_hidden(double[:, ::1] star, Py_ssize_t p, Py_ssize_t q, Py_ssize_t r) noexcept nogil
