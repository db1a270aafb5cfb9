cdef extern from *:
    """
    // A line or a way is taken if it is shorter by more than this share of its length.
    #define GAIN 1e-9
    // Part of the way to the middle of a tetrahedron by which the ends of a line are moved inside.
    #define NUDGE 1e-6
    """
    double GAIN, NUDGE


cdef class Body:
    cdef readonly object _arrays
    cdef const int[:, ::1] corners
    cdef const int[::1] first
    cdef const int[::1] incident
    cdef const double[:, ::1] positions
    cdef int[:, ::1] behind
    cdef int[::1] first_neighbour
    cdef int[::1] neighbours
    cdef double[::1] reach

    cdef int across(self, int t, int o) noexcept nogil
    cdef int list_around(self, int v, int[::1] mark, int[::1] into, int at) noexcept nogil
    cdef double longest_edge(self, int v) noexcept nogil
    cdef double apart(self, int v, int u) noexcept nogil


cdef class Ray:
    cdef Body body
    cdef const int[::1] sources
    cdef const double[::1] offset
    cdef double[::1] d
    cdef double[::1] begin
    cdef int[::1] label
    cdef const double* goal
    cdef double p[3]
    cdef double w[3]
    cdef int t, a, b, c, sign

    cdef bint sees(self, int v, const double* goal) noexcept nogil
    cdef bint is_there(self, int t) noexcept nogil
    cdef bint is_lit(self, int v) noexcept nogil
    cdef double away(self, int v, const double* x) noexcept nogil
    cdef bint arrives_from(self, int v, int begin) noexcept nogil
    cdef bint arrives(self, int v, int begin, int into, int toward) noexcept nogil
    cdef int cone(self, int v) noexcept nogil
    cdef int worst_side(self, int k) noexcept nogil
    cdef void aim(self, int v, int t, int into, double nudge, int toward) noexcept nogil
    cdef bint enters(self, int t, int o) noexcept nogil
    cdef int cross(self) noexcept nogil
    cdef bint turn(self, int o) noexcept nogil
