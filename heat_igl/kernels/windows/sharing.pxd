from heat_igl.kernels.windows.structures cimport Search

cdef long long load(Search* s) noexcept nogil
cdef void meet(Search* s, int which) noexcept nogil
cdef bint balance(Search* s) noexcept nogil
