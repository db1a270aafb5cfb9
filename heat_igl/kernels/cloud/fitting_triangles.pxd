cdef extern from *:
    """
    // What measures angles grows by so much in a turn, and by half in half a turn.
    #define TURN 4.0
    #define ROUNDING 1e-9
    """
    double TURN
    double ROUNDING
