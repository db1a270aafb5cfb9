from heat_igl.kernels.walks cimport Limit, Query

cdef extern from *:
    """
    // Directions at the ends may differ by an angle with this cosine.
    #define LEAST_COSINE 0.9
    // More angle than this between both ends is no cone to interpolate in.
    #define WIDEST 1.5
    // How much more the directions may differ than the cubic part, and what is taken if a walk cannot go on.
    #define TURN 100.0
    #define ROUGHEST 0.1
    """
    double LEAST_COSINE, WIDEST, TURN, ROUGHEST

cdef bint take_between(Query q, const Limit* right, const Limit* left, int k, double roughness) noexcept nogil
