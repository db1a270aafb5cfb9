from libc.math cimport sqrt

from heat_igl.kernels.sweep.facets cimport Facet, pair, squares_of

cdef extern from *:
    """
    // Difference of values, as a share of them, that is rounding.
    #define EQUAL 1e-12
    #ifdef __GNUC__
    #define FETCH(place) __builtin_prefetch(place)
    #else
    #define FETCH(place)
    #endif
    """
    double EQUAL
    void FETCH(const void* place) noexcept nogil

cdef class SimplexUpdate(Facet):
    cdef const int[:, ::1] corners, rows
    cdef const double[:, ::1] mean, velocity, inverses, V
    # The corners of the facet in the simplex, their vertices, and distance at these.
    cdef int side[3], at[3]
    cdef double level[3]
    cdef double* d
    # What bounds the values through each simplex.
    cdef const double[::1] widest, slack, growths
    # The derivative of distance by position, where known, and its trust in the metric of one row or simplex.
    cdef double[:, ::1] slope
    cdef double[::1] trusted
    cdef int[::1] trusted_in
    cdef unsigned char[::1] is_sloped
    # How far T is of second order for each vertex.
    cdef double[::1] weight

    cdef double face(self, int s, int c) noexcept nogil
    cdef double linear(self, int s, int c, double limit) noexcept nogil
    cdef double over_edge(self, int s, int c, int i, int j, double least) noexcept nogil
    cdef bint across(self, int s, int c, double* least) noexcept nogil
    cdef double through(self, int s, int c, double best, int far) noexcept nogil
    cdef void lay(self, int s, int c) noexcept nogil
    cdef double sagging(self, int s, double weight, double limit, double least) noexcept nogil
    cdef double sag_between(self, int s, int i, int j, double more, double trusted) noexcept nogil
    cdef double trust(self, int s, int i) noexcept nogil
    cdef void find_slope(self, int s, int c) noexcept nogil


cdef inline double edge_length(SimplexUpdate of, int s, int i, int j) noexcept nogil:
    # By Simpson's rule from the metrics at both ends, with their geometric mean in the middle.
    cdef int k
    cdef double one, two
    cdef double e[3]
    if of.q == 1:
        return sqrt(of.mean[s, pair(i, j)])
    for k in range(3):
        e[k] = of.V[of.corners[s, i], k] - of.V[of.corners[s, j], k]
    squares_of(&of.inverses[of.rows[s, i], 0], e, 1, &one)
    squares_of(&of.inverses[of.rows[s, j], 0], e, 1, &two)
    one, two = sqrt(one), sqrt(two)
    return (one + 4.0 * sqrt(one * two) + two) / 6.0
