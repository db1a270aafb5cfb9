from heat_igl.kernels.windows.window_structures cimport Entry, Search

cdef void carry(Search* s, Entry entry) noexcept nogil
cdef void run(Search* s) noexcept nogil
cdef void narrow(Search* s) noexcept nogil
cdef void forget(Search* s) noexcept nogil
