from heat_igl.kernels.window_structures cimport Search

cdef void run_beside(Search* s) noexcept nogil
