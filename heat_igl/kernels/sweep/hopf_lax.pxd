cdef extern from *:
    """
    // First order ends once no distance falls by more than GAIN of itself; it begins with the larger FIRST_GAIN. In metrics
    // of 1:17, falls that are handed on at once, however small, make a vertex fall a hundred times as often.
    #define FIRST_GAIN 1e-2
    #define GAIN 0.9e-6
    // Second order ends once no distance changes by more than SETTLED of itself; it begins with the larger one.
    #define FIRST_SETTLED 1e-2
    #define SETTLED 0.9e-4
    // Share of a facet by which the place moves in the last step of Newton's method; the error is of second order in it.
    #define PLACED 1e-6
    // Squared volume of a flat tetrahedron, over that of three edges at right angles. Without this bound, single vertices
    // next to tetrahedra of 1e-7 are up to 40 % too short; with 1e-4 not more so than with first order.
    #define FLAT 1e-4
    """
    double FIRST_GAIN, GAIN, FIRST_SETTLED, SETTLED, PLACED, FLAT

cdef enum:
    # Of a vertex, in the second order.
    MOST_VISITS = 20
    MOST_STEPS = 12
    MOST_HALVINGS = 8
