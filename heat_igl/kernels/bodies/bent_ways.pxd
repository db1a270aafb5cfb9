cdef extern from *:
    """
    // A way is taken if it is shorter by more than this share of the value.
    #define GAIN 1e-9
    """
    double GAIN

# An edge of the body around which ways bend, and distance along it.
cdef struct Bend:
    double at[5]  # at the ends, the quarters and the middle
    double tangent[3]
    double outward[3]  # out of the body, halfway between its walls; zero where more than two walls meet
    double before[3]  # the point from which the way comes to the middle
    double length
    double start, along, height  # distance is start + |(x - along, height)|, x along the edge
    double wall  # cosine of the angle between `outward` and the walls
    int a, b
    int fits, has_before


cdef class BentWays:
    cdef Bend[::1] bends
    cdef const int[:, ::1] corners
    cdef const int[::1] first
    cdef const int[::1] incident
    cdef const double[:, ::1] positions
    cdef const int[::1] sources
    cdef const double[::1] offset
    cdef double[::1] d
    cdef double[::1] begin
    cdef int[::1] label
    cdef int[::1] way
    cdef double x[3]
    cdef double share, beyond

    cdef double value(self, int v, const double* x) noexcept nogil
    cdef double around(self, int i, const double* x) noexcept nogil
    cdef double away(self, int v) noexcept nogil
