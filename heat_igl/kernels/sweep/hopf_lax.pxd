from heat_igl.kernels.sweep.facets cimport Facet

cdef extern from *:
    """
    // By which share of a distance the changes along a path that are not handed on may add up, about.
    #define SETTLED 1e-3
    // Difference of values, as a share of them, that is rounding.
    #define EQUAL 1e-12
    // What a vertex may rise, as a share of its distance, though those it depends on do not: then its second order halves.
    #define RISEN 0.1
    """
    double SETTLED, EQUAL, RISEN


cdef class HopfLax(Facet):
    cdef const int[:, ::1] corners
    cdef const int[::1] first
    cdef const int[::1] incident
    cdef const double[:, ::1] velocity
    cdef const double[:, ::1] inverses
    cdef const int[:, ::1] rows
    cdef const double[:, ::1] mean
    cdef const double[:, ::1] V
    cdef double[::1] pending
    cdef int[::1] n_visits
    # Of the topological order: depth-first search has not seen a vertex, has it open, or is done with it.
    cdef int[::1] order
    cdef int[::1] roots
    cdef int[::1] stack
    cdef unsigned char[::1] state
    cdef double low
    cdef const unsigned char[::1] fixed
    cdef double[::1] d
    cdef int[::1] label
    cdef const double[::1] offset
    # The derivative of distance by the position of each vertex, where it is known.
    cdef double[:, ::1] slope
    cdef unsigned char[::1] is_sloped
    # What each vertex adds to T linear at its place, and the sum of this over the open vertices up to each.
    cdef double[::1] step
    cdef double[::1] sum
    # What each vertex rose though those at its place did not, and how far T is of second order for it.
    cdef double[::1] risen
    cdef double[::1] weight
    # The corner whose facet gave each vertex its distance, the place there, and what bounds the values through each
    # simplex.
    cdef int[::1] facet
    cdef double[:, ::1] place
    cdef double[::1] widest
    cdef double[::1] slack
    cdef double[::1] growths
    # The corners of the facet in the simplex, and distance at these.
    cdef int side[3]
    cdef double level[3]

    cdef double face(self, int s, int c) noexcept nogil
    cdef double linear(self, int s, int c, double room) noexcept nogil
    cdef double over_edge(self, int s, int c, int i, int j, double least) noexcept nogil
    cdef double across(self, int s, int c, double room) noexcept nogil
    cdef void sharpen(self) noexcept nogil
    cdef void arrange(self) noexcept nogil
    cdef void open_circle(self, int u, int n_open) noexcept nogil
    cdef void visit(self, int v) noexcept nogil
    cdef void lay(self, int s, int c) noexcept nogil
    cdef double through(self, int s, int c, double best) noexcept nogil
    cdef double curved(self, int s, int c, double limit) noexcept nogil
    cdef double sag_between(self, int s, int i, int j, double more, double trusted) noexcept nogil
    cdef double trust(self, int s, int c, int i) noexcept nogil
    cdef void find_slope(self, int s, int c) noexcept nogil
