from heat_igl.kernels.paths.surfaces cimport Place, Surface

cdef extern from *:
    """
    // A straight way to a source is taken when it is not longer than the distance says, to rounding.
    #define PATH_ROUNDING 1e-9
    """
    double PATH_ROUNDING

# A segment in a face that paths may end on, and the distance at which it begins.
cdef struct Goal:
    double start[3]
    double end[3]
    double offset

# The nearest goal from a point, -1 if there is none; the face that it lies in; and the distance by it.
cdef struct Nearest:
    int goal, face
    double distance


cdef class Goals:
    cdef const int[::1] first_inside
    cdef const Goal[::1] inside

    cdef void ends(self, int goal, Place* ends) noexcept nogil
    cdef Nearest in_face(self, Surface s, int f, const Place* x, bint at_any_cost) noexcept nogil
    cdef Nearest around(self, Surface s, int v, bint at_any_cost) noexcept nogil
    cdef double _distance_to(self, Surface s, int f, int goal, const Place* x) noexcept nogil
