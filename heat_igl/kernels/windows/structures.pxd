from libc.math cimport sqrt
from libc.stdlib cimport realloc

cdef extern from *:
    """
    // 64 bytes, a cache line: with 72 bytes, a search takes 10 % longer.
    typedef struct {
        double x, depth, turn_x, turn_y, start, stop, offset;
        int root : 31;
        unsigned is_plane : 1;
        int corner : 30;
        unsigned side : 2;
    } Window;

    // Copied in the sizes in which the fields were written: a wider load after narrower stores stalls the processor.
    static inline void keep_root(const Window* w, Window* out) {
        out->offset = w->offset;
        memcpy((char*) out + 56, (const char*) w + 56, 4);
        memcpy((char*) out + 60, (const char*) w + 60, 4);
    }
    """
    # The interval of a half-edge that straight lines from one root cross, in the frame of the half-edge: the tail is
    # the origin, the head is at (length, 0), the lines enter the face above. With `is_plane`, the lines are parallel (a
    # plane wave), and the root is a segment whose points are all sources (Bommes and Kobbelt 2007).
    ctypedef struct Window:
        double x, depth      # the unfolded root is at (x, -depth); for a plane wave, the direction of the lines
        # The half-edge as a unit vector in the frame of `corner`. For a plane wave: the arc length on the segment at
        # which the line through the tail starts, and 1 if lines leave the segment to the left, -1 to the right.
        double turn_x, turn_y
        double start, stop   # the interval, in arc length from the tail
        double offset        # distance of the root; for a plane wave, distance of the tail
        int root             # vertex, n + p for source point p, or after those, n + p + i for source segment i
        int corner           # the corner through which the lines leave the root: see `relax`
        unsigned int side    # on which side of the apex the lines pass: see `Side`
        unsigned int is_plane

    # Copy the fields that all windows of a root share: offset, root, corner and the flags.
    void keep_root(const Window* w, Window* out) noexcept nogil

cdef struct Apex:
    # The corner opposite a half-edge in the frame of the half-edge, the directions of the two sides, and its path.
    double x, y
    double right_x       # length minus x
    double length, left_length, right_length
    double longest       # the longest side of the face, the scale of rounding on its sides
    double cos_left, sin_left, cos_right, sin_right
    int best             # the window that contains the shortest straight line to the apex, -1 if there is none
    double best_at       # where the path crosses the half-edge
    double nearest

cdef struct List:
    # Windows waiting at one half-edge, sorted from its tail to its head.
    Window* windows
    int count, capacity
    int half_edge
    int turns            # faces that all windows crossed last around one end: > 0 around the tail, < 0 around the head
    double key

cdef struct Entry:
    double key
    int what             # a half-edge, or 3 m + v for vertex v

cdef struct Direction:
    # A direction at a vertex: in a corner, at an angle from one of its sides.
    int corner, side
    double cosine, sine

cdef struct Search:
    # The surface: see `shapes`.
    int *vertex, *twin, *ring
    double *length, *double_area, *bulge
    int *corner_of_vertex, *next_corner, *n_corners
    unsigned char *aligned, *kind
    bint is_delaunay
    int n, n_half_edges
    # What is found.
    double *distance, *crossing
    int *root, *label, *entered
    int* corner          # NULL unless asked for, as the next
    double* leaving      # two for each vertex
    double* emitted
    double* upper        # smallest known distance: `distance` itself, unless another thread shares the search
    int* touched
    int n_touched
    # Sources inside faces.
    int n_points
    int* point_face
    double *point, *point_offset
    # Segments inside faces.
    int n_segments
    int* segment_face
    double *segment, *segment_offset  # both ends, one after the other
    # Vertices (goals) and points inside faces (targets) whose distances are requested.
    int n_goals, n_targets, n_found
    int* goal
    bint stops_early
    double slack
    # With a single goal: its vertex (-1 for none), the positions of all vertices in the unit of the lengths, and an
    # upper bound of its distance, with slack for rounding.
    int aim
    double* position
    double within
    int *target_face, *first_target, *next_target
    double* target
    double *target_distance, *target_crossing
    int *target_root, *target_entered
    # The front.
    int* slot
    List* lists
    int n_lists, n_all_lists, n_made_lists
    long long n_waiting  # windows in lists
    int free_list
    Entry* heap
    int n_heap, n_all_heap
    Window *to_left, *to_right
    int n_out
    List* kept           # for each half-edge, see `trim_by_kept`, or NULL
    long long n_crossed  # lists that crossed a face in this search
    bint failed
    long long n_windows, n_lists_done, n_compared
    # How many windows and comparisons there were before this search, and after how many signals are checked next; whether
    # this search had too many.
    long long before, next_question
    bint is_endless
    double tolerance
    # The search ends at the cutoff, or once the `n_nearest` nearest vertices are known.
    double cutoff
    double last_key      # entries with larger keys cannot change a requested distance
    int n_nearest, n_next
    double* ranked
    # Two searches that share a surface exchange these after each round: see `windows`.
    Search* other        # NULL if there is none
    bint is_first
    double round_length
    long long plenty, few  # loads above which two threads share the front, and below which one thread takes it all
    int parity           # rounds write the two entries of the next arrays alternately
    Entry* news[2]       # new distances and their vertices
    int n_news[2]
    int n_all_news[2]
    double first_key[2]  # smallest key in the queue
    long long load[2]    # amount of waiting work
    bint has_failed[2]
    bint met_ties[2]
    int n_ties           # windows of one list that were trimmed against the last one and are equal to it to rounding
    bint meets_ties      # whether the result may depend on which windows wait together: see `windows`
    bint is_shared       # whether windows were handed over
    void* arrived[4]     # locks: two for the news of alternate rounds, then before and after windows are handed over

# Pointers to these, as `cython.p_int` is one to an int.
ctypedef Window* p_window
ctypedef Apex* p_apex
ctypedef List* p_list
ctypedef Entry* p_entry
ctypedef Direction* p_direction
ctypedef Search* p_search

cdef enum Kind:
    UNKNOWN = 0
    PASSED = 1           # total angle below 2 pi: no shortest path runs through the vertex
    BENDS = 2            # total angle above 2 pi: paths bend here
    ENDS = 3             # on the boundary
    JOINS = 4            # several fans, or an edge of more than two faces: paths leave into all faces
    FLAT = 5             # total angle 2 pi to rounding: windows that are split at the vertex are merged behind it

cdef enum Order:
    UNDECIDED = 0        # which of two windows is nearer
    U_NEARER = 1
    W_NEARER = 2
    U_THEN_W = 3
    W_THEN_U = 4

cdef enum Side:
    RIGHT_OF_APEX = 0
    LEFT_OF_APEX = 1
    AROUND_APEX = 2


cdef extern from *:
    """
    // Two paths are equally long if they differ by less than this fraction: fifty times the rounding of one step.
    #define ROUNDING 1e-14
    // The largest angle, in radians, by which the range of directions from a bend is widened.
    #define WIDEST 0.01
    // Windows whose roots are closer than this fraction of their distance have the same root.
    #define SAME 2e-14
    // The directions of two halves of a window differ by less than this angle, the sum over a hundred flat vertices.
    #define TURNED 1e-10
    // Windows that overlap by less than this fraction of both are not trimmed against each other. With 0.2 queries take
    // 1.01 to 1.07 of the time on scans and spheres, with 0 up to 1.8; the number of windows is the same to 1 %.
    #define OVERLAP 0.5
    // Of two windows equal to rounding, one extends beyond the other if by more than this fraction of their overlap. From
    // 1e-14 to 0.1, 12 348 searches on needles take the same number of windows to 5 %; with 0, 12 miss a vertex.
    #define BEYOND 1e-3
    // A search continues beyond its cutoff by this fraction, more than the rounding of a key.
    #define MARGIN 1e-12
    // A vertex is flat if its angles sum to 2 pi up to this, ten times the error up to which halves can be merged.
    #define FLATNESS 1e-12
    // The work per list in addition to its windows, as a number of windows.
    #define PER_LIST 4
    """
    double ROUNDING, WIDEST, SAME, TURNED, OVERLAP, BEYOND, MARGIN, FLATNESS
    int PER_LIST


# An array moved to where there is room for at least n entries; as it is, and `failed` is set, if memory runs out.
cdef inline void* grown(void* entries, int* room, int n, size_t n_bytes, bint* failed) noexcept nogil:
    cdef void* more = realloc(entries, (2 * <size_t> n + 4) * n_bytes)
    if more == NULL:
        failed[0] = True
        return entries
    room[0] = 2 * n + 4
    return more


# Twice the scalar product of two sides p and q of a triangle, from the three lengths. The squares that are subtracted
# are those of the opposite and the longer side, so that the cosine is accurate to rounding of 1 on needles as well.
cdef inline double twice_product(double p, double q, double opposite) noexcept nogil:
    cdef double longer = p if p > q else q
    cdef double shorter = p if q > p else q  # with the same comparison twice, compilers would create a branch
    return (longer - opposite) * (longer + opposite) + shorter * shorter


# Scalar product of two differences of barycentric coordinates, in a face with these sides opposite its corners.
cdef inline double product(const double* side, const double* u, const double* v) noexcept nogil:
    return -0.5 * (
        side[0] * side[0] * (u[1] * v[2] + u[2] * v[1])
        + side[1] * side[1] * (u[2] * v[0] + u[0] * v[2])
        + side[2] * side[2] * (u[0] * v[1] + u[1] * v[0])
    )


# Barycentric coordinates of a corner.
cdef inline void at_corner(int c, double* found) noexcept nogil:
    found[0] = found[1] = found[2] = 0.0
    found[c] = 1.0


# Distance between two points of a face.
cdef inline double apart(const double* side, const double* a, const double* b) noexcept nogil:
    cdef double u = a[0] - b[0]
    cdef double v = a[1] - b[1]
    cdef double w = a[2] - b[2]
    cdef double square = -(
        side[0] * side[0] * v * w + side[1] * side[1] * w * u + side[2] * side[2] * u * v
    )
    return sqrt(square) if square > 0.0 else 0.0


# The point of a segment nearest to a given point; `ends` holds the barycentric coordinates of both ends.
cdef inline void nearest_on(const double* side, const double* ends, const double* point, double* found) noexcept nogil:
    cdef double along[3]
    cdef double off[3]
    cdef double share = 0.0, square
    cdef int c
    for c in range(3):
        along[c] = ends[3 + c] - ends[c]
        off[c] = point[c] - ends[c]
    square = product(side, along, along)
    if square > 0.0:
        share = min(max(product(side, off, along) / square, 0.0), 1.0)
    for c in range(3):
        found[c] = ends[c] + share * along[c]


# Length of the straight line in space from a vertex to the goal.
cdef inline double straight(const Search* s, int v) noexcept nogil:
    cdef double x = s.position[3 * v] - s.position[3 * s.aim]
    cdef double y = s.position[3 * v + 1] - s.position[3 * s.aim + 1]
    cdef double z = s.position[3 * v + 2] - s.position[3 * s.aim + 2]
    return sqrt(x * x + y * y + z * z)


# The length that a window adds to its offset at a point of its half-edge.
cdef inline double reach(const Window* w, double at) noexcept nogil:
    if w.is_plane:
        return w.x * at
    return sqrt((at - w.x) * (at - w.x) + w.depth * w.depth)


# Length of the path from the root of a window through a point `at` of its half-edge to a point (x, y) of the face.
cdef inline double bent(const Window* w, double at, double x, double y) noexcept nogil:
    return w.offset + reach(w, at) + sqrt((at - x) * (at - x) + y * y)


# Whether a length exceeds another by no more than rounding of that length and of the sides of its last face.
cdef inline bint is_within(double length, double other, double side) noexcept nogil:
    return length <= other + MARGIN * (other + side)


# The component along the half-edge of the line through `at`, over a height of `depth`.
cdef inline double lateral(const Window* w, double at) noexcept nogil:
    return w.x if w.is_plane else at - w.x


# The point of the half-edge that the line from the root to a point of the face crosses.
cdef inline double backward(const Window* w, double x, double y) noexcept nogil:
    if w.is_plane:
        return x - y * w.x / w.depth
    return w.x + w.depth * (x - w.x) / (y + w.depth)
