from heat_igl.kernels.windows.structures cimport Search, Window

cdef int trim(Search* s, Window* windows, int n, int h) noexcept nogil
cdef int trim_by_kept(Search* s, Window* windows, int n, int h, int turns) noexcept nogil
cdef bint is_covered(Search* s, const Window* before, int n_before, const Window* windows, int n, int h) noexcept nogil
