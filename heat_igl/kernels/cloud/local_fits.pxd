cdef extern from *:
    """
    // Least weight of a neighbour.
    #define LEAST_WEIGHT 1e-3
    // Lengths are divided by no less.
    #define TINY 2.3e-308
    // Points on a line leave a quadric undetermined; so much on the diagonal, per neighbour, makes the smallest one.
    #define DIAGONAL 1e-9
    """
    double LEAST_WEIGHT, TINY, DIAGONAL
