cdef extern from *:
    """
    // A line is taken if it is shorter by more than this share of the way from the source.
    #define GAIN 1e-9
    // Part of a triangle by which a straight line may miss it, along its rim.
    #define ON_SIDE 1e-9
    // Part of the way to the middle of a tetrahedron by which the ends of a line are moved inside.
    #define NUDGE 1e-6
    """
    double GAIN, ON_SIDE, NUDGE

cdef enum:
    # Sources that a vertex looks for each time, the nearest first.
    MOST_LOOKS = 4
    # Passes over the vertices that wait.
    MOST_PASSES = 100
    # Tetrahedra along a line.
    MOST_STEPS = 1000000
