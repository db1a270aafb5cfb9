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
