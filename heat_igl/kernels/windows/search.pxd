from heat_igl.kernels.windows.window_structures cimport Search

cdef void run_beside(Search* s) noexcept nogil
