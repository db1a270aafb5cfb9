from heat_igl.kernels.windows.window_structures cimport Search

cdef void allocate(Search* s) noexcept nogil
cdef void more_room(Search* s, int n) noexcept nogil
cdef void empty_front(Search* s) noexcept nogil
cdef void free_front(Search* s) noexcept nogil
