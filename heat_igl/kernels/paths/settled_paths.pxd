from heat_igl.kernels.paths.fans cimport Fan
from heat_igl.kernels.paths.passing cimport Passing
from heat_igl.kernels.paths.straightening cimport Course
from heat_igl.kernels.paths.surfaces cimport Place

cdef extern from *:
    """
    // A curve that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_CURVE 1e-13
    // Settled curves whose lengths differ by a smaller share are one curve.
    #define SAME_LENGTH 1e-11
    """
    double GAIN "GAIN_OF_CURVE"
    double SAME_LENGTH


cdef class SettledPath:
    cdef Course course
    cdef Passing passing
    cdef Fan fan
    cdef Place end

    cdef double settle(self) except -1 nogil
    cdef int lay_out(self) except -1 nogil
    cdef double pass_better(self, double length) except -1 nogil
    cdef double shortcut(self, double length) except -1 nogil
    cdef int vertex_at(self, int f, const Place* x) noexcept nogil
