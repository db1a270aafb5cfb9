from heat_igl.kernels.windows.window_structures cimport Entry, Search

cdef void push(Search* s, double key, int what) noexcept nogil
cdef Entry pop(Search* s) noexcept nogil
