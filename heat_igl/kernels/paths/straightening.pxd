from heat_igl.kernels.paths.funnels cimport Layout
from heat_igl.kernels.paths.strips cimport Detour, Strip
from heat_igl.kernels.paths.surfaces cimport Place, Surface

cdef extern from *:
    """
    // A bend is worth repairing when the angle another way falls short of pi by more than this; it saves the square.
    #define NEARLY_STRAIGHT 1e-7
    """
    double NEARLY_STRAIGHT

# A part of a path that lies in one face, by barycentric coordinates.
cdef struct Segment:
    double start[3]
    double end[3]
    int face


cdef class Course:
    cdef Surface s
    cdef Strip strip, straighter
    cdef Detour detour
    cdef Layout layout
    cdef Segment[::1] segment
    cdef int n_segments
    cdef int face, vertex
    cdef Place start

    cdef void begin(self, int face, int vertex, const Place* start) noexcept nogil
    cdef int last_face(self) noexcept nogil
    cdef int turn(self, int v, int f, int goal) except -1 nogil
    cdef double straighten(self, int end_vertex) except -1 nogil
    cdef double settle(self, int end_vertex, Place* end) except -1 nogil
    cdef int lay_out(self, int end_vertex, Place* end) except -1 nogil
    cdef int _repair(self) except -1 nogil
    cdef int _shorter_way(self, int i) noexcept nogil
    cdef void _trim(self, int end_vertex, Place* end) noexcept nogil
    cdef Place _on(self, int j, int f, double share) noexcept nogil
    cdef int emit(self, const Place* end) except -1 nogil
    cdef bint _is_one_way(self, int first, int last, int v) noexcept nogil
