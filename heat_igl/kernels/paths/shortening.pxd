from heat_igl.kernels.mesh.segments cimport SegmentList
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
    // The base of a loop does not slide by a smaller share of its edge.
    #define SHORTEST_SLIDE 1e-4
    """
    double NEARLY_STRAIGHT
    double GAIN "GAIN_OF_CURVE"
    double LARGEST_LOSS
    double MARGIN_OF_TURN
    double SHORTEST_SLIDE

cdef enum:
    # So many vertices are noted at a time, and tried altogether on one path.
    MOST_CHOICES = 64
    MOST_TRIED = 256
    # A loop whose length stays the same from this many bases, one after another, is straight at all of them.
    BOTH_WAYS = 2
    # Before the loop is straightened from one, it is led past its bends from so many: with 3 and without bound, more loops
    # are longer than those of flips of edges.
    FIRST_BASES = 8
    # From so many at most: a loop moves to the next vertex with each.
    MOST_BASES = 100000

# A path starts at `start` in `face`, at `vertex` if that is not -1, and ends at `end` in the last face of its strip.
cdef struct Ends:
    int face, vertex
    Place start, end

# A vertex to pass on the other side: the crossings at it, and the share of a squared length that this may save.
cdef struct Choice:
    double saved
    int vertex, first, last


cdef class Shortener:
    cdef FaceTable s
    cdef Ends ends
    cdef Strip strip
    cdef Detour detour
    cdef Funnel funnel
    # A strip while it is made, and the path to return to.
    cdef Strip other, kept
    cdef Ends kept_ends
    # Vertices to pass on the other side, the most promising first, and those that were.
    cdef const double[::1] half_turn
    cdef Choice[::1] choice
    cdef int[::1] tried
    cdef int n_choices, n_tried
    cdef double largest_loss
    # The result.
    cdef SegmentList segments
    cdef double length

    cdef void begin(self, int face, Place start) noexcept nogil
    cdef int last_face(self) noexcept nogil
    cdef bint turn(self, int v, int goal) except -1 nogil
    cdef int save(self) except -1 nogil
    cdef int restore(self) except -1 nogil
    cdef int emit(self) except -1 nogil
    cdef Place on(self, int j, int f, double share) noexcept nogil

    cdef double settle(self) except -1 nogil
    cdef double lay_out(self) except -1 nogil
    cdef void trim(self) noexcept nogil
    cdef int repair(self) except -1 nogil
    cdef int shorter_way(self, int i) noexcept nogil
    cdef bint is_one_way(self, int first, int last, int v) noexcept nogil

    cdef double improve(self, double length) except -1 nogil
    cdef int propose(self) except -1 nogil
    cdef void note(self, int j, int side, double saved) noexcept nogil
    cdef bint is_tried(self, int v) noexcept nogil
    cdef bint lead(self, Choice choice) except -1 nogil

    cdef double shorten_loop(self) except -1 nogil
    cdef double slide(self, double length) except -1 nogil
    cdef void place_base(self, int f, int a, int b, int a_end, int b_end, double share) noexcept nogil
    cdef bint move_base(self) except -1 nogil
    cdef bint close(self) except -1 nogil
