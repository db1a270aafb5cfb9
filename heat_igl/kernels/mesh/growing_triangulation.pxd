cdef enum:
    # Kinds of moves, as `heat_igl.intrinsic.history` has them.
    SPLIT = 0
    FLIP = 1

cdef class GrowingTriangulation:
    cdef long long[:, ::1] F
    cdef double[:, ::1] l
    cdef long long[::1] twin
    cdef long long[:, ::1] kind
    cdef double[:, ::1] numbers
    cdef readonly long long n_faces, n_vertices, n_moves

    cdef bint is_full(self) noexcept nogil
    cdef bint is_delaunay(self, long long h) noexcept nogil
    cdef void flip(self, long long h) noexcept nogil
    cdef void split(self, long long f, double u, double v, double w) noexcept nogil
    cdef void _glue(self, long long h, long long t) noexcept nogil
    cdef long long _append_move(self, long long kind, long long h, long long mate) noexcept nogil
