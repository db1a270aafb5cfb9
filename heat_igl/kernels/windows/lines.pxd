cdef extern from *:
    """
    // A place is met if the straight line ends this near to it, as a fraction of the line's length.
    #define MEETS 1e-6
    // A vertex lies on a line within this angle.
    #define ON_LINE 1e-9
    // Lengths of a path by its line and the path of the line's end differ by less than this fraction.
    #define SAME_LENGTH 1e-7
    // The same for a vertex on the line: a path that is longer by a fraction x may leave at an angle of sqrt(x) to it.
    #define SAME_LINE 1e-12
    """
    double MEETS, ON_LINE, SAME_LENGTH, SAME_LINE

# An edge that a straight line crosses, in the plane: its right and its left end, their corners in the face before, the
# half-edge to leave that face by and the one to enter the next by; and whether the face before is counter-clockwise.
cdef struct Gate:
    double rx, ry, lx, ly
    int right, left, leave, enter
    bint turns_left

# Barycentric coordinates.
cdef struct Place:
    double c[3]

# Where a line ends: a vertex, or one of the source points; in which corner or at which place of the last face.
cdef struct End:
    double x, y
    Place at
    int row, entry, face

# How the path of a vertex begins: not at all, along an edge, to a source point in a face of the vertex, or across the
# half-edge opposite the vertex in one of its faces.
cdef enum:
    AT_SOURCE = 0
    ALONG_EDGE = 1
    IN_FACE = 2
    ACROSS = 3


cdef class Lines:
    cdef const int[::1] vertex, twin, ring, first_inside, following, entered
    cdef const double[::1] length, distance, share, reach
    cdef const unsigned char[::1] aligned, kind
    cdef const double[:, ::1] inside
    cdef Gate[::1] gate
    cdef int n_gates
    cdef End end
    # Of the line: the vertex that it begins at, its corner there, its direction and its length.
    cdef int v, corner
    cdef double ux, uy, extent

    cdef int follow(self, int v) except -1 nogil
    cdef int _cross(self) except -1 nogil
    cdef bint _enter(self, int j, int g) noexcept nogil
    cdef bint _turn_back(self) noexcept nogil
    cdef int _step(self) except -2 nogil
    cdef bint _meets(self, double x, double y, int f, int corner) noexcept nogil
    cdef bint _is_on_way(self, double x, double y, double apart, double behind) noexcept nogil
    cdef bint _meets_inside(
        self, int f, int apex, int right, int left, Gate* gate, double x, double y
    ) noexcept nogil
    cdef int _row_of(self, int entry) noexcept nogil
    cdef int _end_along(self, int h) noexcept nogil
    cdef int _end_inside(self, int v, double corner) noexcept nogil
    cdef double place_at(self, int j) noexcept nogil
