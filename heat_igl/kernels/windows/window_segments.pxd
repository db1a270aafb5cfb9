from heat_igl.kernels.windows.window_structures cimport Search

cdef void emit_segment(Search* s, int i) noexcept nogil
