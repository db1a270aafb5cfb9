from heat_igl.kernels.paths.funnels cimport Layout
from heat_igl.kernels.paths.joints cimport Joints
from heat_igl.kernels.paths.straightening cimport Course
from heat_igl.kernels.paths.strips cimport Strip
from heat_igl.kernels.paths.surfaces cimport Surface

cdef extern from *:
    """
    // A part of a loop that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_PART 1e-13
    // Angles around a vertex that differ by less are the same: rounding.
    #define SAME_ANGLE 1e-6
    """
    double GAIN_OF_PART
    double SAME_ANGLE

cdef class Polyline:
    cdef Course course
    cdef Surface s
    cdef const double[::1] polar
    cdef const int[::1] across
    cdef bint is_oriented
    cdef Joints joints
    # The part that is made: the strip, out of `face`.
    cdef Strip strip
    cdef int face
    cdef Layout layout

    cdef bint read(self) except -1 nogil
    cdef int relax(self) except -1 nogil
    cdef int shorten(self, int k) except -1 nogil
    cdef bint turn(self, Strip strip, int v, int f, int goal, bint on_left, double angle) except -1 nogil
    cdef double lay_out(self, int v, int w) except -1 nogil
    cdef int link(self, int a, int b) except -1 nogil
    cdef int set_part(self, int a, int f, int begin, int end, int i) except -1 nogil
    cdef void trim(self, int v, int w) noexcept nogil
    cdef int write(self) except -1 nogil
    cdef bint lead(self, int v, int f, int goal) except -1 nogil
    cdef int last_face(self) noexcept nogil
