from heat_igl.kernels.mesh.segments cimport SegmentList
from heat_igl.kernels.paths.face_table cimport SNAP, FaceTable, Place, at_corner, corner_of, moved, side_of, vertex_at, weighted
from heat_igl.kernels.paths.funnel cimport Funnel, FunnelCorner
from heat_igl.kernels.paths.strips cimport Detour, Sides, Strip

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
    cdef bint is_loop
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
    cdef bint lead(self, Choice choice) except -1 nogil

    cdef double shorten_loop(self) except -1 nogil
    cdef double slide(self, double length) except -1 nogil
    cdef void place_base(self, int f, int a, int b, int a_end, int b_end, double share) noexcept nogil
    cdef bint move_base(self) except -1 nogil
    cdef bint close(self) except -1 nogil
