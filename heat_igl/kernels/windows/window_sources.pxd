from heat_igl.kernels.windows.window_structures cimport Search

cdef void start_at(Search* s, int v, double offset, int label) noexcept nogil
cdef void emit_point(Search* s, int p) noexcept nogil
