from heat_igl.kernels.mesh.segments cimport Segments

cdef extern from *:
    """
    #define PI 3.14159265358979323846
    /* A geodesic meets a vertex that it would pass by less than this share of the way to it, or of the side that it
       crosses if that is shorter: across 10000 faces rounding moves it by some 1e-12. */
    #define ON_RAY 1e-10
    /* Angles that differ by less are equal: those of the faces around a vertex are rounded, and the direction is. */
    #define LEAST_ANGLE 1e-10
    """
    const double PI
    const double ON_RAY
    const double LEAST_ANGLE

cdef enum:
    # Steps without length, one after another, after which a geodesic ends: only in places where all edges have length 0.
    MOST_IDLE = 10000


# A point on the base of a face, and the direction in which it moves.
# The base is half-edge `h`, from the tail in the origin to the head on the first axis; the face is above it. The point
# is the share `s` of the base from the tail, unless it `is_inside` the face. `is_at_tail`: it is the tail, and leaves
# across the side opposite.
cdef struct Heading:
    long long h
    double s, dx, dy
    bint is_inside, is_at_tail

# Face `f` in the plane, with its corners (x, y) from the tail of side `side` on; the ray starts in the origin, and leaves
# at the share `share` of the side from point `k` to the next.
cdef struct FaceInPlane:
    long long f
    int side, k
    double x[3]
    double y[3]
    double share


cdef class _Tracer:
    cdef double[:, ::1] l
    cdef double[::1] area
    cdef double[:, ::1] angle
    cdef long long[::1] twin
    cdef double[:, ::1] half
    cdef Segments segments  # None if they are not asked for
    # Of the geodesic being traced: the ray, the face laid out around it, and where it enters and leaves that face in
    # barycentric coordinates.
    cdef Heading ray
    cdef FaceInPlane face
    cdef double entry[3], leave[3]

    cdef int trace_one(
        self, long long face, double* at, double turn, double length, long long* end_face, double* end,
        double* travelled
    ) except -1 nogil
    cdef bint start(self, long long f, double turn) noexcept nogil
    cdef bint leave_corner(self, long long corner, double turn) noexcept nogil
    cdef void lay_out(self) noexcept nogil
    cdef double find_exit(self, double travelled) noexcept nogil
    cdef bint pass_vertex(self) noexcept nogil
    cdef bint cross_side(self) noexcept nogil
    cdef int store(self, long long f) except -1 nogil
