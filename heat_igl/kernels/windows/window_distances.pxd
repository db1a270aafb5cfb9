from heat_igl.kernels.windows.window_structures cimport Search

cdef void relax(
    Search* s, int v, double distance, int root, int entered, double crossing, int corner, double x, double y
) noexcept nogil
cdef void take(Search* s, int j, double distance, int root) noexcept nogil
cdef void tell(Search* s, int v, double distance) noexcept nogil
