from heat_igl.kernels.paths.straightening cimport Course
from heat_igl.kernels.paths.strips cimport Strip
from heat_igl.kernels.paths.surfaces cimport Place

cdef extern from *:
    """
    // The other side of a vertex is tried on open paths unless it promises to lose more than this share of the square of
    // a straight part. The promise looks at one vertex alone: other vertices beside it change the length by some percent.
    #define LARGEST_LOSS 0.01
    // Cosine by which the angle that a path spans may fall short of half of those around the vertex.
    #define MARGIN 0.03
    """
    double LARGEST_LOSS "LARGEST_LOSS"
    double MARGIN_OF_TURN "MARGIN"

cdef enum:
    # So many vertices are noted at a time, and tried altogether on one path.
    MOST_CHOICES = 64
    MOST_TRIED = 256

# A vertex to pass on the other side: the crossings at it, and the share of a squared length that this may save.
cdef struct Choice:
    double saved
    int vertex, first, last


cdef class Saved:
    cdef Strip strip
    cdef int face, vertex
    cdef Place start

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

    cdef int propose(self) except -1 nogil
    cdef int note(self, int j, int side, double saved) except -1 nogil
    cdef bint is_tried(self, int v) noexcept nogil
    cdef int lead(self, int i) except -1 nogil


cdef int copy(Strip this, Strip there) except -1 nogil
