from heat_igl.kernels.window_structures cimport Search

cdef void emit_segment(Search* s, int i) noexcept nogil
