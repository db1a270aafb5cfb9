cdef class InnerSources:
    cdef int n, n_points
    cdef const int[::1] point_face
    cdef const double[:, ::1] point
    cdef const double[::1] point_offset
    cdef const int[::1] segment_face
    cdef const double[:, :, ::1] segment
    cdef const double[::1] segment_offset

    cdef int face(self, int root) noexcept nogil
    cdef double nearest(self, const double* side, int root, double* here, double* found) noexcept nogil
cdef class PathSegments:
    cdef int[::1] face
    cdef double[:, :, ::1] place
    cdef long long n

    cdef bint append(self, int f, double* start, double* end) noexcept nogil
cdef struct Bend:
    # Where the straight part of a path ends: barycentric coordinates in a face, and what the search found there.
    int face
    double x, y, z
    double distance
    int root
    int entered
    double crossing

cdef struct Line:
    # A line that enters the face of a half-edge at x from its tail, in a direction with dy > 0. In an outward frame, x
    # is measured from the head.
    int half_edge
    double x, dx, dy
    double walked        # from where the straight part of the path ends
    long long n_segments

cdef enum Outcome:
    AT_SOURCE = -1
    LOST = -2
    NO_ROOM = -3
    GO_ON = -4

cdef extern from *:
    """
    // A vertex on the line makes up the distance to this fraction of it: more than rounding, and so little that a path
    // through the vertex is as long.
    #define ON_LINE 1e-13
    // The same at the root, to which the line is known to lead.
    #define AT_ROOT 1e-9
    // A line is given up when it is too far from the source by this fraction of the distance.
    #define ASTRAY 1e-6
    // Lines that wait: more only where many edges of more than two faces follow one another.
    #define MOST_LINES 256
    // Faces that one path crosses at most.
    #define MOST_STEPS 4000000
    """
    double ON_LINE
    double AT_ROOT
    double ASTRAY
    enum: MOST_LINES
    enum: MOST_STEPS
