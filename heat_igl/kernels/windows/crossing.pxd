from heat_igl.kernels.windows.structures cimport Search

cdef void cross(Search* s, int h) noexcept nogil
cdef void over_corners(Search* s, int j) noexcept nogil
