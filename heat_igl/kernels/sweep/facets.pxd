cdef extern from *:
    """
    // Share of a facet by which the place moves in the last step of Newton's method; the error is of second order in it.
    #define PLACED 1e-4
    // Squared volume of a flat tetrahedron, over that of three edges at right angles. Without this bound, single vertices
    // next to tetrahedra of 1e-7 are up to 40 % too short; with 1e-4 not more so than with first order.
    #define FLAT 1e-4
    """
    double PLACED, FLAT

cdef enum:
    MOST_STEPS = 12
    MOST_HALVINGS = 8


cdef class Facet:
    cdef int p, q
    cdef double start
    cdef double D[3]
    cdef double sag[3][3]
    cdef double product[36]
    cdef double share[3]
    cdef double g[3]
    cdef double H[3][3]
    # Of the last value: T and its derivatives; lengths at v, in the middle and at x, and what they came from.
    cdef double T, near, middle, far
    cdef double rise[3]
    cdef double square[4]
    cdef double log[3]
    cdef double by[4][3]
    cdef double bent[3]

    cdef bint is_flat(self) noexcept nogil
    cdef double dual(self, int k, const double* e) noexcept nogil
    cdef double along_edges(self) noexcept nogil
    cdef double length(self, const double* x) noexcept nogil
    cdef double lean(self, int i) noexcept nogil
    cdef double value(self, const double* x) noexcept nogil
    cdef void curve(self, const double* x) noexcept nogil
    cdef double newton(self, double limit) noexcept nogil
    cdef (double, double) on_triangle(self, double* x) noexcept nogil
