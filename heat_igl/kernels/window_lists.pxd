from heat_igl.kernels.window_structures cimport Entry, Search, Window

cdef void push(Search* s, double key, int what) noexcept nogil
cdef Entry pop(Search* s) noexcept nogil
cdef void tell(Search* s, int v, double distance) noexcept nogil
cdef void append(Search* s, int t, Window* run, int n, bint in_front, bint mirrored) noexcept nogil
cdef void add(Search* s, int e, Window* run, int n, bint in_front) noexcept nogil
cdef void more_room(Search* s, int n) noexcept nogil
cdef void allocate(Search* s) noexcept nogil
cdef void free_front(Search* s) noexcept nogil
cdef void empty_front(Search* s) noexcept nogil
