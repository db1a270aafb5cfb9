from heat_igl.kernels.mesh.segments cimport SegmentList

cdef extern from *:
    """
    // A point nearer to a vertex than this, in edge lengths, is at the vertex.
    #define SNAP 1e-9
    """
    double SNAP

# Edge lengths are opposite the corners; none is 0. Each corner c lies `along` of the way from corner c + 2 to corner
# c + 1, and `above` that edge, in lengths of this edge.
cdef struct Triangle:
    double length[3]
    double angle[3]
    double along[3]
    double above[3]
    int vertex[3]

# Barycentric coordinates of a point in a face.
cdef struct Place:
    double c[3]


cdef class FaceTable:
    cdef const Triangle[::1] triangle
    cdef const int[::1] twin, ring, first_corner, corner


# The corner of face f at vertex v, -1 if it has none.
cdef inline int corner_of(FaceTable s, int f, int v) noexcept nogil:
    cdef const Triangle* t = &s.triangle[f]
    if t.vertex[0] == v:
        return 0
    if t.vertex[1] == v:
        return 1
    return 2 if t.vertex[2] == v else -1


# The next half-edge of the same edge, in turn; of an edge of one face, h itself.
cdef inline int next_side(FaceTable s, int h) noexcept nogil:
    return s.twin[h] if s.twin[h] >= 0 else s.ring[h]


# The other half-edge of the face of h at its vertex v.
cdef inline int other_side(FaceTable s, int h, int v) noexcept nogil:
    return 3 * (h // 3) + 3 - h % 3 - corner_of(s, h // 3, v)


# The vertex at a point of face f, -1 if there is none.
cdef inline int vertex_at(FaceTable s, int f, const Place* x) noexcept nogil:
    cdef int c
    for c in range(3):
        if x.c[c] > 1.0 - SNAP:
            return s.triangle[f].vertex[c]
    return -1


# The side that a point lies on, -1 inside.
cdef inline int side_of(const Place* x) noexcept nogil:
    cdef int c, on = -1
    for c in range(3):
        if x.c[c] == 0.0:
            on = c
    return on


cdef inline Place at_corner(int c) noexcept nogil:
    cdef Place x
    x.c[0] = x.c[1] = x.c[2] = 0.0
    x.c[c] = 1.0
    return x


# A point x in the face of half-edge h on that edge, in the face of half-edge g on the same edge.
cdef inline Place moved(FaceTable s, int h, int g, const Place* x) noexcept nogil:
    cdef Place there
    cdef int c
    there.c[0] = there.c[1] = there.c[2] = 0.0
    for c in range(3):
        if c != h % 3:
            there.c[corner_of(s, g // 3, s.triangle[h // 3].vertex[c])] = x.c[c]
    return there


# From a half-edge of one face to a half-edge of the next on the same edge.
cdef struct Crossing:
    int leave, enter

# A step around a vertex enters a face: the half-edge that it enters through, the one to leave it through (-1 in the
# last face), and the step before it.
cdef struct Around:
    int enter, leave, before

# The last step of a way that goes on, and its length to the edge where the face is left.
cdef struct Tip:
    double length
    int step

# Angles from a half-edge at a vertex to where a path passes, and from the other half-edge there in the same face.
cdef struct Sides:
    double this, other


cdef class Strip:
    cdef Crossing[::1] crossing
    cdef int count

    cdef int push(self, int leave, int enter) except -1 nogil
    cdef int extend(self, Crossing[::1] crossing, int begin, int end) except -1 nogil
    cdef int copy(self, Strip other) except -1 nogil
    cdef void drop(self, int k) noexcept nogil


cdef class Detour:
    cdef Around[::1] step
    cdef Tip[::1] tip
    cdef Crossing[::1] way

    cdef int find(
        self, FaceTable s, int v, int h, Sides before, int goal, int end, Sides after, double limit
    ) noexcept nogil
    cdef bint _is_entered(self, int g, int n_steps) noexcept nogil
    cdef int _crossings(self, int last) noexcept nogil


# A crossing in the plane: its left (0) and right (1) end, and their vertices.
cdef struct Gate:
    double x[2]
    double y[2]
    int vertex[2]

# A corner of the shortest path: where it lies, on which side of the strip (-1 at the start and the end), and the first
# and the last crossing at it.
cdef struct FunnelCorner:
    double x, y
    int side, first, last

# The corners of a face in the plane.
cdef struct Corners:
    double x[3]
    double y[3]


cdef class Funnel:
    cdef Gate[::1] gate
    cdef FunnelCorner[::1] bend
    cdef int n_gates, n_bends
    cdef Corners first, last
    cdef double x, y

    cdef int lay_out(self, FaceTable s, int face, const Place* start, Strip strip) except -1 nogil
    cdef void pull_tight(self, double x, double y) noexcept nogil
    cdef FunnelCorner corner(self, int at, int side) noexcept nogil
    cdef double length(self) noexcept nogil
    cdef double share(self, int j, int i) noexcept nogil


cdef inline double weighted(const Place* x, const double* p) noexcept nogil:
    return x.c[0] * p[0] + x.c[1] * p[1] + x.c[2] * p[2]

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
