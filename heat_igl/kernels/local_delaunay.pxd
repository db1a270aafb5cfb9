cdef enum:
    # Columns of the neighbours of a point: angle around it, and the coordinates of the inverted neighbour.
    ANGLE = 0
    X = 1
    Y = 2

cdef struct InPlane:
    double x, y

cdef extern from *:
    """
    #define TURN 6.283185307179586476925286766559
    #define ROUNDING 1e-9
    #define STEEP 0.1
    """
    double STEEP
    double TURN
    double ROUNDING
