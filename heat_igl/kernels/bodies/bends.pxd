cdef extern from *:
    """
    // Share of the longest edge at a vertex by which a way to it may be too long, and the search still goes on behind it.
    #define SLACK 0.2
    // Share of that edge by which a vertex may lie below the plane of a wall and still be on it.
    #define LEVEL 1e-6
    """
    double SLACK, LEVEL

cdef enum:
    # Rounds over the edges around which ways bend.
    MOST_ROUNDS = 50
