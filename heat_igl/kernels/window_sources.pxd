from heat_igl.kernels.window_structures cimport Search

cdef void relax(
    Search* s, int v, double distance, int root, int entered, double crossing, int corner, double x, double y
) noexcept nogil
cdef void shed(Search* s, int v) noexcept nogil
cdef double apart(Search* s, int f, double* a, double* b) noexcept nogil
cdef void emit_point(Search* s, int p) noexcept nogil
cdef void aim_at(Search* s, int v, int goal) noexcept nogil
cdef void start_at(Search* s, int v, double offset, int label) noexcept nogil
cdef void take(Search* s, int j, double distance, int root) noexcept nogil
