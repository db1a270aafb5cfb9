cdef extern from *:
    """
    // Cosine of the angle to the normal within which balls are on a side of the surface.
    #define ASIDE 0.3
    // Steps from the largest ball to the mean direction of its side.
    #define ROUNDS 3
    // Lengths are divided by no less.
    #define TINY 1e-300
    """
    double ASIDE, TINY
    int ROUNDS
