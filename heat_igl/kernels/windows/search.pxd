from heat_igl.kernels.windows.structures cimport Entry, Search

cdef void carry(Search* s, Entry entry) noexcept nogil
cdef void run(Search* s) noexcept nogil
cdef void narrow(Search* s) noexcept nogil
cdef void forget(Search* s) noexcept nogil
cdef void run_beside(Search* s) noexcept nogil
