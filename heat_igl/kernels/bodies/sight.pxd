from heat_igl.kernels.bodies.rays cimport Line, Ray


cdef class Sight(Ray):
    cdef const unsigned char[::1] turns
    cdef bint is_concave, knows_walls
    cdef int[:, ::1] guess
    cdef unsigned char[::1] is_waiting
    cdef int[::1] lit
    cdef int sought
    cdef Line to_source
    cdef double[:, :, ::1] open

    cdef bint is_clear(self, int a, int b, bint hides) noexcept nogil
    cdef int look(self, int v) noexcept nogil
    cdef void take(self, int v, int label) noexcept nogil
    cdef int nearest_around(self, int centre, int v, double above, double below, int nearest) noexcept nogil
    cdef double line(self, int v, int label) noexcept nogil
    cdef bint sees_source(self, int v, int label) noexcept nogil
