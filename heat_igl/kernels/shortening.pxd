cdef extern from *:
    """
    // A loop that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_LOOP 1e-13
    // The other side of a vertex is tried if it promises to save this share of the square of a straight part.
    #define LEAST_SAVING 1e-9
    """
    double GAIN "GAIN_OF_LOOP"
    double LEAST_SAVING

cdef enum:
    # A loop whose length stays the same from this many bases, one after another, is straight at all of them.
    BOTH_WAYS = 2
    # From so many at most: a loop moves to the next vertex with each.
    MOST_BASES = 100000
    # So many vertices are tried one after another without success.
    MOST_TRIALS = 100
