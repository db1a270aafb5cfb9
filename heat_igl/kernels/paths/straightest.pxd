from heat_igl.kernels.mesh.segments cimport SegmentList
from heat_igl.kernels.mesh.straight cimport Exit, Heading


cdef class _Tracer:
    cdef double[:, ::1] l
    cdef double[::1] area
    cdef double[:, ::1] angle
    cdef long long[::1] twin
    cdef double[:, ::1] half
    cdef SegmentList segments  # None if they are not asked for
    # Of the geodesic being traced: the ray into a face, and where it leaves that, by the share of the side. In
    # barycentric coordinates, where it enters and leaves. How far it came, and the face there.
    cdef Heading ray
    cdef Exit exit
    cdef double share, entry[3], leave[3], travelled
    cdef long long end_face

    cdef int trace_one(self, long long face, const double* at, double turn, double length) except -1 nogil
    cdef bint start(self, long long f, double turn) noexcept nogil
    cdef bint leave_corner(self, long long corner, double turn) noexcept nogil
    cdef double find_exit(self) noexcept nogil
    cdef bint pass_vertex(self) noexcept nogil
    cdef bint cross_side(self) noexcept nogil
    cdef int store(self, long long f) except -1 nogil
