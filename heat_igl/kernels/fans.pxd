from heat_igl.kernels.funnels cimport Layout
from heat_igl.kernels.passing cimport Saved
from heat_igl.kernels.straightening cimport Course
from heat_igl.kernels.strips cimport Strip
from heat_igl.kernels.surfaces cimport Place, Surface

cdef extern from *:
    """
    // Lines leave at most this far from the path, in radians.
    #define HALF_FAN 0.5
    // A line that is shorter by less than this share of the path is the same: rounding.
    #define GAIN_OF_LINE 1e-12
    """
    double HALF_FAN
    double GAIN_OF_LINE

cdef enum:
    # A line is followed over so many edges.
    MOST_STEPS = 100000


cdef class Fan:
    cdef Course course
    cdef Surface s
    cdef Layout layout
    cdef Strip strip
    cdef Saved kept
    cdef double half, spacing, most_rays
    cdef const double[:, ::1] apex
    cdef bint is_inside
    # The number of the bend at each vertex, -1 for none; and the length of the path from each bend on.
    cdef int[::1] bend_at
    cdef double[::1] remaining
    # What crossing an edge from a half-edge adds to the word of a strip; empty if all words are.
    cdef const int[::1] letter
    cdef int[::1] word
    cdef int end_face
    cdef Place end
    # The best line: what it saves, the bend it leads to, its first face with the corners at the bend and to the right,
    # its angle and that of the right corner from the path, and how many edges it crosses.
    cdef double saved, angle, beta
    cdef int goal, first_face, corner, right, n_steps

    cdef int shorten(self, int begin, const Place* end) except -2 nogil
    cdef void mark(self, int n, bint is_marked) noexcept nogil
    cdef int look(self, int i) except -1 nogil
    cdef int open(self, int i, int f, int c, int r, double beta) except -1 nogil
    cdef int across(self, int h) noexcept nogil
    cdef int follow(self, int i, int f, int c, int r, double beta, double angle, int n_steps) except -1 nogil
    cdef void aim(self, int i, int bend, double distance, int f, int c, double angle, double beta, int step, int r) noexcept nogil
    cdef bint replace(self, int i) except -1 nogil
    cdef bint keeps_class(self) except -1 nogil
