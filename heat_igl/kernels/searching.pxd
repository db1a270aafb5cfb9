from heat_igl.kernels.walks cimport Query

cdef void search(Query q, int v) noexcept nogil
