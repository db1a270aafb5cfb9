cdef enum:
    # Balls along so many directions at a time, which a vector holds.
    LANES = 4

cdef extern from *:
    """
    // Steps from the largest ball to the mean direction of its side.
    #define ROUNDS 3
    // Lengths are divided by no less.
    #define TINY 1e-300
    """
    double TINY
    int ROUNDS
