cdef class PathSegments:
    cdef int[::1] face
    cdef double[:, :, ::1] place
    cdef long long n

    cdef bint append(self, int f, double* start, double* end) noexcept nogil
