from heat_igl.kernels.paths.passing cimport Passing
from heat_igl.kernels.paths.straightening cimport Course
from heat_igl.kernels.paths.surfaces cimport Place

cdef extern from *:
    """
    // A curve that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_CURVE 1e-13
    """
    double GAIN "GAIN_OF_CURVE"


cdef class SettledPath:
    cdef Course course
    cdef Passing passing
    cdef Place end

    cdef double settle(self) except -1 nogil
    cdef int lay_out(self) except -1 nogil
    cdef double pass_better(self, double length) except -1 nogil
    cdef int vertex_at(self, int f, const Place* x) noexcept nogil
