from heat_igl.kernels.priority_queue cimport PriorityQueue

cdef extern from *:
    """
    /* Barycentric coordinates of a new vertex are at least this, so that no split makes a triangle without area. */
    #define LEAST 0.01
    /* A cone of less than 60 degrees in all keeps the angle that it has. */
    #define SHARPEST 1.0471975511965976
    """
    const double LEAST
    const double SHARPEST

cdef enum:
    # Kinds of moves, as `heat_igl.intrinsic.history` has them.
    SPLIT = 0
    FLIP = 1
    # A walk to a circumcenter crosses few triangles, since the triangulation is Delaunay.
    MOST_STEPS = 200

# A point by the barycentric coordinates in a face; face -1 for no point.
cdef struct Location:
    long long face
    double u, v, w

# The straight walk in the plane of the first face: from, to, and the difference.
cdef struct Walk:
    double ox, oy, tx, ty, dx, dy

# The side by which the walk leaves a face: the half-edge, and the ends of it to the right (r) and left (s) of the ray.
cdef struct Exit:
    long long h
    double rx, ry, sx, sy


cdef class GrowingTriangulation:
    cdef long long[:, ::1] F
    cdef double[:, ::1] l
    cdef long long[::1] twin
    cdef long long[:, ::1] kind
    cdef double[:, ::1] numbers
    cdef long long n_faces, n_vertices, n_moves

    cdef bint is_full(self) noexcept nogil
    cdef bint is_delaunay(self, long long h) noexcept nogil
    cdef void flip(self, long long h) noexcept nogil
    cdef void split(self, long long f, double u, double v, double w) noexcept nogil
    cdef void _glue(self, long long h, long long t) noexcept nogil
    cdef long long _append_move(self, long long kind, long long h, long long mate) noexcept nogil


cdef class _Refinement:
    cdef GrowingTriangulation triangles
    cdef PriorityQueue bad
    cdef double[::1] unit
    cdef long long[::1] stack
    cdef unsigned char[::1] is_sharp
    cdef double least_sine, largest_radius

    cdef void run(self, long long most_vertices) noexcept nogil
    cdef void judge(self, long long f) noexcept nogil
    cdef double badness(self, long long f) noexcept nogil
    cdef bint insert(self, Location at) noexcept nogil
    cdef bint make_delaunay(self, long long n_stack) noexcept nogil

cdef void _find_sharp(GrowingTriangulation t, unsigned char[::1] seen, unsigned char[::1] is_sharp) noexcept nogil
cdef Location _circumcenter(GrowingTriangulation t, long long f) noexcept nogil
cdef Location _walk(GrowingTriangulation t, Walk ray, Exit way) noexcept nogil
