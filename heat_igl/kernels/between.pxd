from heat_igl.kernels.walks cimport Limit, Query

cdef extern from *:
    """
    // Directions at the ends may differ by an angle with this cosine.
    #define LEAST_COSINE 0.9
    """
    double LEAST_COSINE

cdef bint take_between(Query q, const Limit* right, const Limit* left, int k) noexcept nogil
