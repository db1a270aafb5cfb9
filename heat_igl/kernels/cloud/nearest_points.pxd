cdef enum:
    # Points in a box of the lowest level.
    IN_A_BOX = 8
    # Points are sorted into so many equal parts of the squared distance first, and the numbers of these need two more.
    PARTS = 62
    # As many boxes wait to be searched at most: one for each level, of which there are no more than bits in a number.
    ROOM = 64

cdef extern from *:
    """
    // Bounds of squares of distances are this much larger than they need be.
    #define ROUNDED_UP (1 + 1e-9)
    // Boxes are this much larger, in shares of the coordinates.
    #define ROUNDING 1e-15
    // Squares are divided by no less.
    #define TINY 1e-290
    """
    double ROUNDED_UP, ROUNDING, TINY
