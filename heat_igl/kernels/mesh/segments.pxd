cdef class SegmentList:
    cdef int[::1] face
    cdef double[:, :, ::1] place
    cdef long long n

    cdef int append(self, int f, const double* start, const double* end) except -1 nogil
