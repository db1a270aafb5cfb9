from heat_igl.kernels.mesh.segments cimport SegmentList
from heat_igl.kernels.mesh.straight cimport Exit, Heading

cdef struct LineEnd:
    # Where a straight part of a path ends: barycentric coordinates in a face, and what the search found there.
    int face
    double x, y, z
    double distance
    int root
    int entered
    double crossing

cdef struct Line:
    Heading ray
    double walked        # from where the straight part of the path ends
    long long n_segments

cdef enum Outcome:
    AT_SOURCE = -1
    LOST = -2
    GO_ON = -3

cdef enum:
    # Lines that wait. On 106 shapes 8 are enough, and with 2 paths on five are lost: more are needed only where many
    # edges of more than two faces follow one another.
    MOST_LINES = 256


# A surface, what a search found on it, and the segments so far.
cdef class PathTracer:
    cdef const int[::1] vertex, twin, ring, root, entered
    cdef const unsigned char[::1] aligned
    cdef const double[::1] length, double_area, distance, crossing
    # Sources inside faces.
    cdef int n, n_points
    cdef const int[::1] point_face
    cdef const double[:, ::1] point
    cdef const double[::1] point_offset
    cdef const int[::1] segment_face
    cdef const double[:, :, ::1] segment
    cdef const double[::1] segment_offset
    cdef SegmentList segments
    cdef long long n_steps
    # Lines to be tried, the next one last.
    cdef Line[MOST_LINES] line
    cdef int n_lines

    cdef int source_face(self, int root) noexcept nogil
    cdef double nearest_source(self, const double* side, int root, double* here, double* found) noexcept nogil
    cdef int along_bends(self, int v) except -4 nogil
    cdef int from_vertex(self, int v) except -4 nogil
    cdef int straight(self, const LineEnd* begin) except -4 nogil
    cdef bint leads(self, const LineEnd* begin, int v, double left) noexcept nogil
    cdef int go_through(self, const LineEnd* begin, const Line* line) except -4 nogil
    cdef bint is_too_far(self, const LineEnd* begin, const Line* line) noexcept nogil
    cdef void go_over(self, const Line* line) noexcept nogil
    cdef void note(self, int t, const Line* line, bint mirrored) noexcept nogil
    cdef bint is_at_source(self, const LineEnd* begin, int f, double* here, double walked) noexcept nogil
    cdef int add(self, int f, double* here, int h, double x) except -1 nogil
    cdef int add_to_source(self, int f, double* here, int root) except -4 nogil
