from heat_igl.kernels.windows.structures cimport Search

cdef void emit_point(Search* s, int p) noexcept nogil
cdef void emit_segment(Search* s, int i) noexcept nogil
cdef void emit_vertex(Search* s, int v) noexcept nogil
