from heat_igl.kernels.walks cimport Query

cdef extern from *:
    """
    // How much more may be lost on a part of a path, in proportion, than on the whole.
    #define SHARE 1.5
    """
    double SHARE

cdef double look_around(Query q, int v) noexcept nogil
cdef int walk_through(Query q, int v, int k) noexcept nogil
cdef void cross_crowded(Query q, int k) noexcept nogil
