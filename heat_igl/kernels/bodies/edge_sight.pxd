from heat_igl.kernels.bodies.bent_ways cimport BentWays
from heat_igl.kernels.bodies.rays cimport Ray


cdef class EdgeSight(BentWays):
    cdef Ray ray
    cdef int[::1] lit
    cdef int stamp

    cdef bint has_end(self, int t, int i) noexcept nogil
    cdef bint sees(self, int i, int v) noexcept nogil
    cdef bint arrives(self, int i) noexcept nogil
    cdef bint arrives_from(self, int v, int begin, int i) noexcept nogil
    cdef bint is_lit_from(self, int v, int i, const double* x, double share) noexcept nogil
