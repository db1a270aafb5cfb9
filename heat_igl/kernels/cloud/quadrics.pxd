cdef enum:
    # Sums over neighbours are taken in so many parts, which vectors hold.
    LANES = 4

cdef extern from *:
    """
    // Points on a line leave a quadric undetermined; so much on the diagonal, per neighbour, makes the smallest one.
    #define DIAGONAL 1e-9
    """
    double DIAGONAL
