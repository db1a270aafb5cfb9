from heat_igl.kernels.windows.structures cimport Apex, List, Search, Window

cdef bint may_join(Search* s) noexcept nogil
cdef int join(Search* s, List* one, int n, int h) noexcept nogil
cdef bint cut_joined_by_ends(Window* w, double a, double b) noexcept nogil
cdef bint carry_joined(const Window* w, const Apex* apex, bint to_left, Window* out) noexcept nogil
