from heat_igl.kernels.bodies.bodies cimport Body

cdef extern from *:
    """
    // Part of a triangle by which a straight line may miss it, along its rim.
    #define ON_SIDE 1e-9
    // Part of the way to the middle of a tetrahedron by which the ends of a line are moved inside.
    #define NUDGE 1e-6
    """
    double ON_SIDE, NUDGE

cdef enum:
    # Tetrahedra along a line.
    MOST_STEPS = 1000000
    # Tetrahedra around a vertex that are walked through before all are tried one by one.
    MOST_TURNS = 20


cdef class Ray:
    cdef const int[:, ::1] corners
    cdef const int[::1] first
    cdef const int[::1] incident
    cdef const double[:, ::1] positions
    cdef const int[:, ::1] behind
    cdef double p[3]
    cdef double w[3]
    cdef int t, a, b, c, sign

    cdef int cone(self, int v, const double* goal) noexcept nogil
    cdef int worst_side(self, int k) noexcept nogil
    cdef bint begins(self, int k, const double* goal) noexcept nogil
    cdef void aim(self, int v, int t, const double* goal, int into, double nudge, int toward=*) noexcept nogil
    cdef bint enters(self, int t, int o) noexcept nogil
    cdef int cross(self) noexcept nogil
    cdef bint turn(self, int o) noexcept nogil
    cdef double side(self, int a, int b) noexcept nogil
    cdef int leaves(self, int o, int a, int b, int c, double part) noexcept nogil
    cdef double volume(self, int o, int a, int b, int c) noexcept nogil
