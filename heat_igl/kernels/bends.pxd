cdef extern from *:
    """
    // A way is taken if it is shorter by more than this share of the value.
    #define GAIN 1e-9
    // Share of an edge by which the fitted distance may be wrong at its quarters.
    #define MISFIT 1e-3
    // Change of the slope along an edge below which a front is straight there.
    #define LEVEL 1e-7
    // Share of the longest edge at a vertex by which a way to it may be too long, and the search still goes on behind it.
    #define SLACK 0.5
    """
    double GAIN, MISFIT, LEVEL, SLACK

cdef enum:
    # Rounds over the edges around which ways bend.
    MOST_ROUNDS = 50

# An edge of the body around which ways bend, and distance along it.
cdef struct Bend:
    double at[5]  # at the ends, the quarters and the middle
    double tangent[3]
    double outward[3]  # out of the body, halfway between its walls; zero where more than two walls meet
    double before[3]  # the point from which the way comes to the middle
    double length
    double start, along, height  # distance is start + |(x - along, height)|, x along the edge
    int a, b
    int fits, has_before
