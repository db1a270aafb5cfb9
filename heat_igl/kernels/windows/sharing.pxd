from heat_igl.kernels.windows.structures cimport Search, p_search

cdef long long load(Search* s) noexcept nogil
cdef void meet(Search* s, int which) noexcept nogil
cdef bint balance(Search* s) noexcept nogil

cdef int _next_seed(p_search s) noexcept nogil
cdef long long _give_list(p_search s, p_search o, int h) noexcept nogil
cdef long long _give_vertex(p_search s, p_search o, int v) noexcept nogil
cdef void _hand_over(p_search s, p_search o, long long amount) noexcept nogil
