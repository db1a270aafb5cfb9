cdef enum:
    # Columns of the neighbours of a point: angle around it, and the coordinates of the inverted neighbour.
    ANGLE = 0
    X = 1
    Y = 2
    # Columns of the sides of a hull: on the side itself, ACROSS_X x + ACROSS_Y y = -1.
    ACROSS_X = 3
    ACROSS_Y = 4
    # The star of so many nearest neighbours rules out most of the others.
    FEW = 10

cdef extern from *:
    """
    // Part of the way from the centre to a side of the hull within which a point is inside beyond doubt.
    #define INSIDE (1 - 1e-9)
    """
    double INSIDE
