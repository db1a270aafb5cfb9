cdef enum:
    # Thresholds tried per piece.
    BUCKETS = 64
    # Pieces of so few vertices are eliminated together.
    LEAF = 4
    # Rounds of averaging that straighten the cuts, and the size up to which it does not matter.
    SMOOTHING = 2
    ROUGH = 100
    # The two parts of a piece are 0 and 1.
    SEPARATOR = 2


cdef struct Piece:
    # order[low:high]; where its parent starts in the order, or -1; the number of the piece.
    Py_ssize_t low, high, above
    int number


cdef struct Cut:
    # The last bucket on the left, or -1 where there is no cut; the side that gives its rim as the separator.
    int bucket, side


cdef struct Rims:
    # Vertices by bucket; where intervals of cuts begin (+1) and end (-1) in whose rims vertices are, left and right.
    long long inside[BUCKETS]
    long long rim[2][BUCKETS]
