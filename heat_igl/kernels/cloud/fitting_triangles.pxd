cdef extern from *:
    """
    #define TURN 6.283185307179586476925286766559
    #define ROUNDING 1e-9
    """
    double TURN
    double ROUNDING
