cdef extern from *:
    """
    // A smaller distance is handed on if it is shorter by more than this share of the way from the source.
    #define GAIN 1e-5
    // A front from this many edges away is straight: farther away, its curve is lost in the digits.
    #define STRAIGHT 1e4
    """
    double GAIN, STRAIGHT

cdef enum:
    # Visits per vertex after which the kernel gives up.
    MOST_VISITS = 100
    # Sources, and regions beside them, up to which fronts first stay in these regions.
    MOST_REGIONS = 8
