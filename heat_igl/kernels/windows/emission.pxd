from heat_igl.kernels.windows.structures cimport Search, p_direction, p_search

cdef void emit_point(Search* s, int p) noexcept nogil
cdef void emit_segment(Search* s, int i) noexcept nogil
cdef void emit_vertex(Search* s, int v) noexcept nogil

cdef double _segment_distance(p_search s, int i, double* point) noexcept nogil
cdef void _emit_parallel(p_search s, int h, double* ends, int root, double offset) noexcept nogil
cdef void _emit_from_bend(p_search s, int k, double start, double stop, int root, double offset) noexcept nogil
cdef void _reach_ends(p_search s, int k, int v, double offset) noexcept nogil
cdef bint _straighten(p_search s, int k, int side, p_direction ray, double margin) noexcept nogil
cdef double _reach(p_search s, p_direction ray) noexcept nogil
cdef void _fill(p_search s, int v, p_direction first, p_direction last) noexcept nogil
