cdef extern from *:
    """
    // A loop that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_LOOP 1e-13
    // Settled paths whose lengths differ by a smaller share are one path.
    #define SAME_LENGTH 1e-11
    """
    double GAIN "GAIN_OF_LOOP"
    double SAME_LENGTH

cdef enum:
    # A loop whose length stays the same from this many bases, one after another, is straight at all of them.
    BOTH_WAYS = 2
    # From so many at most: a loop moves to the next vertex with each.
    MOST_BASES = 100000
