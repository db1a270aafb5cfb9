from libc.math cimport sqrt

cdef extern from *:
    """
    // In 64 bytes: with 72, a search takes a tenth longer.
    typedef struct {
        double x, depth, turn_x, turn_y, start, stop, offset;
        int root : 31;
        unsigned is_plane : 1;
        int corner : 30;
        unsigned side : 2;
    } Window;

    // In the pieces that were written last: a processor waits for a wider copy of what it has just written.
    static inline void keep_root(const Window* w, Window* out) {
        out->offset = w->offset;
        memcpy((char*) out + 56, (const char*) w + 56, 4);
        memcpy((char*) out + 60, (const char*) w + 60, 4);
    }
    """
    # The part of a half-edge that straight lines from one root cross, in the frame of the half-edge: its tail is the
    # origin, its head lies at (length, 0), the face that the lines enter above. If it is a plane, the lines are
    # parallel, and the root is a segment all of whose points are sources (Bommes and Kobbelt 2007).
    ctypedef struct Window:
        double x, depth      # the root laid out in the plane lies at (x, -depth); of a plane, the direction of the lines
        # The half-edge as a unit vector in the frame of `corner`; of a plane, how far along the segment the line
        # through the tail starts, and 1 if lines leave the segment to the left, -1 to the right.
        double turn_x, turn_y
        double start, stop   # from where to where along the half-edge
        double offset        # distance of the root; of a plane, the distance that it gives the tail
        int root             # vertex, n + p for source point p, or after those, n + p + i for source segment i
        int corner           # of the root, out of which the lines leave it: see `relax`
        unsigned int side    # of the apex: see the sides below
        unsigned int is_plane

    # Copy what windows of one root share: offset, root, corner and the flags.
    void keep_root(const Window* w, Window* out) noexcept nogil

cdef struct Apex:
    # The corner opposite a half-edge in its frame, the directions of the two sides there, and how it is reached.
    double x, y
    double right_x       # how far before the head of the half-edge
    double length, left_length, right_length
    double excess        # the largest length of the last part of a path to it, times twice its rounding
    double cos_left, sin_left, cos_right, sin_right
    int best             # the window through which the apex is nearest, -1 if none sees it
    double best_at       # where the path crosses the half-edge
    double nearest

cdef struct List:
    # Windows that wait at one half-edge, from its tail to its head.
    Window* windows
    int count, capacity
    int half_edge
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
    int* vertex
    double* length
    int* twin
    unsigned char* aligned
    int* ring
    double* double_area
    double* bulge
    int *corner_of_vertex, *next_corner, *n_corners
    unsigned char* kind
    bint is_delaunay
    int n, n_half_edges
    # What is found.
    double* distance
    int* root
    int* label
    int* entered
    double* crossing
    int* corner          # NULL unless asked for, as the next
    double* leaving      # two for each vertex
    double* emitted
    double* upper        # the least distance known: `distance` itself, unless another search goes on beside this one
    int* touched
    int n_touched
    # Sources inside faces.
    int n_points
    int* point_face
    double* point
    double* point_offset
    # Segments inside faces.
    int n_segments
    int* segment_face
    double* segment      # both ends, one after the other
    double* segment_offset
    # Vertices, and points inside faces, whose distance is asked for.
    int n_goals, n_targets, n_found
    int* goal
    bint stops_early
    double slack
    # With one goal: which, -1 for none, positions of the vertices in the unit of the lengths, and what is longer, by more
    # than rounding, than a path to the goal.
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
    Window* to_left
    Window* to_right
    int n_out
    bint failed
    long long n_windows, n_lists_done
    double tolerance
    # Where the search ends: at a distance, or, if so many vertices are asked for, once the nearest are known.
    double cutoff
    double last_key      # what has a larger key can change nothing that is asked for
    int n_nearest, n_next
    double* ranked
    int n_all_ranked
    # Of two searches that share a surface, what each tells the other after a round: see `windows`.
    Search* other        # NULL if there is none
    bint is_first
    double round_length
    long long plenty, few  # with more than one on the front there is work for two threads, until it is less than the other
    int parity           # rounds write the two places of these by turns
    Entry* news[2]       # distances, and the vertices that they were found for
    int n_news[2]
    int n_all_news[2]
    double first_key[2]  # of what waits
    long long load[2]    # how much waits
    bint has_failed[2]
    bint met_flat[2]
    bint meets_flat       # whether a flat vertex was reached
    bint is_shared       # whether windows were handed over
    void* arrived[4]     # locks: the news of a round are there, windows can be handed over, or were

cdef enum Kind:
    UNKNOWN = 0
    PASSED = 1           # no shortest path runs through
    BENDS = 2            # total angle above 2 pi: paths bend here
    ENDS = 3             # on the boundary
    JOINS = 4            # several fans, or an edge of more than two faces: paths leave into all faces
    FLAT = 5             # passed, and the angles sum to 2 pi to rounding: windows that it splits are joined behind it

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
    // The largest angle, in radians, by which the directions from a bend are widened.
    #define WIDEST 0.01
    // What is narrower, as a fraction of a side, is no window.
    #define NARROW 1e-14
    // Windows whose roots are closer than this fraction of their distance have the same root.
    #define SAME 2e-14
    // Two halves of a window are turned against each other by less than this angle: a hundred flat vertices.
    #define TURNED 1e-10
    // Windows that overlap by less than this fraction of both are left as they are.
    #define OVERLAP 0.2
    // A search goes on beyond its cutoff by this fraction, more than rounding of a key.
    #define MARGIN 1e-12
    // A vertex is flat if its angles sum to 2 pi up to this: ten times what still lets halves of a window be joined.
    #define FLATNESS 1e-12
    // Overlaps of less than this fraction of a half-edge are left too: rays from bends are widened by so much.
    #define SLIVER 1e-5
    // What a list costs beside its windows, in windows.
    #define PER_LIST 4
    """
    double ROUNDING
    double WIDEST
    double NARROW
    double SAME
    double TURNED
    double OVERLAP
    double SLIVER
    double MARGIN
    double FLATNESS
    int PER_LIST


# Twice the scalar product of two sides p and q of a triangle, by the third side. The difference of squares is that of
# the two longest sides: on needles too, the cosine is off by no more than rounding of one.
cdef inline double twice_product(double p, double q, double opposite) noexcept nogil:
    cdef double longer = p if p > q else q
    cdef double shorter = p if q > p else q  # not by the same comparison: then compilers make a branch of both
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


# The point of a segment, given by the coordinates of its two ends, that is nearest to a point.
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


# What a window adds to its offset at a point of its half-edge.
cdef inline double reach(const Window* w, double at) noexcept nogil:
    if w.is_plane:
        return w.x * at
    return sqrt((at - w.x) * (at - w.x) + w.depth * w.depth)


# Length of the path of a window through a point of its half-edge to a point of the face.
cdef inline double bent(const Window* w, double at, double x, double y) noexcept nogil:
    return w.offset + reach(w, at) + sqrt((at - x) * (at - x) + y * y)


# Whether a length exceeds another by no more than rounding, of that and of the sides of its last face.
cdef inline bint is_within(double length, double other, double side) noexcept nogil:
    return length <= other + MARGIN * (other + side)


# How far the line of a window through a point of its half-edge goes along it while it rises by `depth`.
cdef inline double lateral(const Window* w, double at) noexcept nogil:
    return w.x if w.is_plane else at - w.x


# Where the line of a window through a point of the face meets the half-edge.
cdef inline double backward(const Window* w, double x, double y) noexcept nogil:
    if w.is_plane:
        return x - y * w.x / w.depth
    return w.x + w.depth * (x - w.x) / (y + w.depth)
