from heat_igl.kernels.mesh.segments cimport Segments
from heat_igl.kernels.paths.strips cimport Detour, FaceTable, Funnel, Place, Strip

cdef extern from *:
    """
    // A bend is worth repairing when the angle another way falls short of pi by more than this; it saves the square.
    #define NEARLY_STRAIGHT 1e-7
    // A curve that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_CURVE 1e-13
    // The other side of a vertex is tried on open paths unless it promises to lose more than this share of the square of
    // a straight part. The promise looks at one vertex alone: other vertices beside it change the length by some percent.
    #define LARGEST_LOSS 0.01
    // Cosine by which the angle that a path spans may fall short of half of those around the vertex.
    #define MARGIN_OF_TURN 0.03
    """
    double NEARLY_STRAIGHT
    double GAIN "GAIN_OF_CURVE"
    double LARGEST_LOSS
    double MARGIN_OF_TURN

cdef enum:
    # So many vertices are noted at a time, and tried altogether on one path.
    MOST_CHOICES = 64
    MOST_TRIED = 256

# A vertex to pass on the other side: the crossings at it, and the share of a squared length that this may save.
cdef struct Choice:
    double saved
    int vertex, first, last


cdef class Course:
    cdef FaceTable s
    cdef Strip strip, straighter
    cdef Detour detour
    cdef Funnel funnel
    cdef Segments segments
    cdef int face, vertex
    cdef Place start, end

    cdef void begin(self, int face, Place start) noexcept nogil
    cdef int last_face(self) noexcept nogil
    cdef bint turn(self, int v, int goal) except -1 nogil
    cdef double settle(self) except -1 nogil
    cdef double lay_out(self) except -1 nogil
    cdef int repair(self) except -1 nogil
    cdef int _shorter_way(self, int i) noexcept nogil
    cdef bint _is_one_way(self, int first, int last, int v) noexcept nogil
    cdef void _trim(self) noexcept nogil
    cdef int emit(self) except -1 nogil
    cdef Place _on(self, int j, int f, double share) noexcept nogil


cdef class Saved:
    cdef Strip strip
    cdef int face, vertex
    cdef Place start, end

    cdef int save(self, Course course) except -1 nogil
    cdef int restore(self, Course course) except -1 nogil


cdef class Passing:
    cdef Course course
    cdef Saved kept
    cdef const double[::1] half_turn
    cdef Choice[::1] choice
    cdef int count
    cdef int[::1] tried
    cdef int n_tried
    cdef double largest_loss

    cdef double improve(self, double length) except -1 nogil
    cdef int propose(self) except -1 nogil
    cdef int note(self, int j, int side, double saved) except -1 nogil
    cdef bint is_tried(self, int v) noexcept nogil
    cdef int lead(self, int i) except -1 nogil
