cdef enum:
    # Rows of a ring: points, and the corners opposite to the edges after them.
    POINT = 0
    BEYOND = 1

cdef class _Gaps:
    cdef const double[:, ::1] P
    cdef const int[:, ::1] F
    cdef const int[::1] twin
    cdef const unsigned char[::1] is_gap
    cdef const double[::1] largest
    cdef double most_bent, most_folded
    cdef int[:, ::1] triangles, ring, fans, link
    cdef unsigned char[::1] is_whole, seen
    cdef Py_ssize_t count
    cdef int[::1] partner, joints, head
    cdef double[::1] cost

    cdef int at_end(self, Py_ssize_t end) noexcept nogil
    cdef void find_loops(self) noexcept nogil
    cdef void in_one_round(self, Py_ssize_t k) noexcept nogil
    cdef double square(self, Py_ssize_t a, Py_ssize_t b) noexcept nogil
    cdef Py_ssize_t loop(self, Py_ssize_t start) noexcept nogil
    cdef void fill(self, Py_ssize_t size) noexcept nogil
    cdef double ear(self, Py_ssize_t size, Py_ssize_t i, Py_ssize_t flat) noexcept nogil
    cdef void enter(self, Py_ssize_t e, int a, int b) noexcept nogil
    cdef bint is_edge(self, int a, int b) noexcept nogil
    cdef double fold(self, Py_ssize_t a, Py_ssize_t b, Py_ssize_t c, Py_ssize_t d) noexcept nogil

cdef double _circumradius(const double[:, ::1] P, Py_ssize_t a, Py_ssize_t b, Py_ssize_t c) noexcept nogil
