from heat_igl.kernels.window_structures cimport Search

cdef void run(Search* s) noexcept nogil
cdef void narrow(Search* s) noexcept nogil
cdef void forget(Search* s) noexcept nogil
