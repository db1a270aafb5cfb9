from heat_igl.kernels.windows.window_structures cimport Search, Window

cdef void append(Search* s, int t, Window* run, int n, bint in_front, bint mirrored) noexcept nogil
cdef void add(Search* s, int e, Window* run, int n, bint in_front) noexcept nogil
