cdef extern from *:
    """
    // Share of the longest edge at a vertex by which a way to it may be too long, and the search still goes on behind it.
    #define SLACK 0.5
    """
    double SLACK

cdef enum:
    # Rounds over the edges around which ways bend.
    MOST_ROUNDS = 50
