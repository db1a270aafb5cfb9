from heat_igl.kernels.windows.structures cimport Direction, Search

cdef int third(int k, int side) noexcept nogil
cdef int beyond(Search* s, int k, int side) noexcept nogil
cdef void turn(Search* s, int k, int side, Direction* ray) noexcept nogil
cdef unsigned char classify(Search* s, int v) noexcept nogil
