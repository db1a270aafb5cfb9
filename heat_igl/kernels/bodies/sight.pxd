cdef extern from *:
    """
    // A line is taken if it is shorter by more than this share of the way from the source.
    #define GAIN 1e-9
    """
    double GAIN

cdef enum:
    # Sources that a vertex looks for each time, the nearest first.
    MOST_LOOKS = 4
    # Passes over the vertices that wait.
    MOST_PASSES = 100
