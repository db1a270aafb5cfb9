cdef class _Flips:
    cdef int[::1] vertex, twin, ring
    cdef double[::1] length
    # Twice that of each face.
    cdef double[::1] area
    # The angle opposite each half-edge; between two that are not, no edge is flipped.
    cdef unsigned char[::1] is_obtuse
    cdef int[::1] waiting
    cdef unsigned char[::1] is_waiting
    cdef int n_waiting
    # Of the flip that was found to improve: the new edge, and twice the areas of both new faces.
    cdef double diagonal, area_of_f, area_of_g

    cdef void compare(self, int h) noexcept nogil
    cdef void wait(self, int h) noexcept nogil
    cdef bint improves(self, int h, double tolerance) noexcept nogil
    cdef void flip(self, int h) noexcept nogil
    cdef void glue(self, int old, int new, int twin) noexcept nogil

cdef void _move(int[::1] ring, int old, int new) noexcept nogil
