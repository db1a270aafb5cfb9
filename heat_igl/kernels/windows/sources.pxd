from heat_igl.kernels.windows.window_structures cimport Search

cdef void emit_vertex(Search* s, int v) noexcept nogil
