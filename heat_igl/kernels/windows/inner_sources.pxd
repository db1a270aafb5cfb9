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
