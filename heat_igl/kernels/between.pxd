from heat_igl.kernels.walks cimport Limit, Query

cdef extern from *:
    """
    // Directions at the ends may differ by an angle with this cosine.
    #define LEAST_COSINE 0.9
    // More angle than this between both ends is no cone to interpolate in.
    #define WIDEST 1.5
    // How much more the directions may differ than the cubic part.
    #define TURN 100.0
    """
    double LEAST_COSINE, WIDEST, TURN

cdef bint take_between(Query q, const Limit* right, const Limit* left, int k, double roughness) noexcept nogil
