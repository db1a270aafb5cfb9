cdef class PriorityQueue:
    cdef double[::1] key
    cdef long long[::1] heap
    cdef long long[::1] place
    cdef readonly long long count

    cdef long long first(self) noexcept nogil
    cdef void set_key(self, long long i, double key) noexcept nogil
    cdef void _lift(self, long long k) noexcept nogil
    cdef void _sink(self, long long k) noexcept nogil
