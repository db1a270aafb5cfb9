from heat_igl.kernels.windows.structures cimport Entry, p_search

cdef int* _ints(int[::1] array) noexcept
cdef double* _doubles(double[::1] array) noexcept
cdef unsigned char* _bytes(unsigned char[::1] array) noexcept
cdef int _write_within(p_search s, long long* name, int* to, double* value, int* way, double* line) noexcept nogil
cdef int _write_nearest(p_search s, long long* name, int* to, double* value) noexcept nogil
cdef bint _all_found(p_search s, double key) noexcept nogil
cdef void _carry(p_search s, Entry entry) noexcept nogil
cdef Entry _first(p_search s) noexcept nogil
cdef void _run(p_search s) noexcept nogil
cdef void _narrow(p_search s) noexcept nogil
cdef void _forget(p_search s) noexcept nogil
cdef void _advance(p_search s, double until) noexcept nogil
cdef void _run_beside(p_search s) noexcept nogil
