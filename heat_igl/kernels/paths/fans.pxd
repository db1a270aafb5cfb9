from heat_igl.kernels.paths.funnels cimport Layout
from heat_igl.kernels.paths.passing cimport Saved
from heat_igl.kernels.paths.straightening cimport Course
from heat_igl.kernels.paths.strips cimport Strip
from heat_igl.kernels.paths.surfaces cimport Place, Surface

cdef extern from *:
    """
    // Lines leave at most this far from the path, in radians.
    #define HALF_FAN 0.4
    // Lines next to one another leave at an angle of at least this; more lines find little more.
    #define SPACING (HALF_FAN / 12)
    // A line that is shorter by less than this share of the path is the same: rounding.
    #define GAIN_OF_LINE 1e-12
    """
    double HALF_FAN
    double SPACING
    double GAIN_OF_LINE

# The face behind a half-edge through which a line enters: its corner opposite that edge, along the edge from the right
# end and above it, in edge lengths; this vertex; and the half-edges through which the line enters the next face, past the
# corner on the right or on the left, -1 for none.
cdef struct Ahead:
    double along, above
    int after[2]
    int vertex

# A line from a corner of a face at an angle from the path, with that of the right corner.
cdef struct Line:
    int face, corner
    double angle, right


cdef class Fan:
    cdef Course course
    cdef Surface s
    cdef Layout layout
    cdef Strip strip
    cdef Saved kept
    cdef const Ahead[::1] ahead
    # The number of the bend at each vertex, -1 for none; and the length of the path from each bend on.
    cdef int[::1] bend_at
    cdef double[::1] remaining
    cdef const int[::1] letter
    cdef int[::1] word
    # Where the path ends, and the vertex there, -1 for none.
    cdef Place end
    cdef int end_face, end_vertex
    # The best line: what it saves, the bend that it leads to, and how many edges it crosses.
    cdef Line best
    cdef double saved
    # Lines end at this share of the length of the path; with a smaller one there are fewer.
    cdef double most
    cdef int goal, n_steps

    cdef int shorten(self, int begin, const Place* end) except -2 nogil
    cdef void mark(self, int n, bint is_marked) noexcept nogil
    cdef int look(self, int i) except -1 nogil
    cdef int spread(self, int i, int f, int c, double right, double spacing) except -1 nogil
    cdef int across(self, int h) noexcept nogil
    cdef int follow(self, int i, const Line* line, int n_steps) except -1 nogil
    cdef void aim(self, int i, int bend, double distance, const Line* line, int step) noexcept nogil
    cdef bint replace(self, int i) except -1 nogil
    cdef bint keeps_class(self) except -1 nogil
