cdef extern from *:
    """
    // Changes by less than this are not passed on: on a curved surface the sweep is wrong by more anyway.
    #define NEGLIGIBLE 3e-4
    // In a flat domain it is exact, provided that all changes are passed on.
    #define SWEEP_ROUNDING 1e-12
    """
    double NEGLIGIBLE, SWEEP_ROUNDING

cdef enum:
    # Visits per vertex up to which the sweep goes back at once, and after which it gives up. Heat's order takes 1.1 in
    # all, a random one 20 to 40.
    GO_BACK = 10
    GIVE_UP = 50
    # Spokes up to which it costs more to fetch them ahead of time than to wait for them.
    CACHED = 1 << 15
    # Sides of the triangles at a vertex that straight lines cross: more are held only for a moment.
    SIDES = 16
    # The order knows so many vertices in advance, whose data can be fetched meanwhile.
    AHEAD = 4
