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

cdef struct InPlane:
    double x, y

cdef extern from *:
    """
    #define TURN 6.283185307179586476925286766559
    #define ROUNDING 1e-9
    // Part of the way from the centre to a side of the hull within which a point is inside beyond doubt.
    #define INSIDE (1 - 1e-9)
    // Squared slope above which a neighbour is unrolled into the tangent plane, instead of projected.
    #define STEEP 0.1
    // Sine of the angle between two planes below which the line in which they meet is not known well.
    #define ALIKE 0.2
    """
    double ALIKE, STEEP
    double TURN
    double ROUNDING
    double INSIDE
