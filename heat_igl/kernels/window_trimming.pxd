from heat_igl.kernels.window_structures cimport Search, Window

cdef int trim(Search* s, Window* windows, int n, int h) noexcept nogil
