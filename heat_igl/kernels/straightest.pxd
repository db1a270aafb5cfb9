cdef extern from *:
    """
    #define PI 3.14159265358979323846
    /* A geodesic that crosses a side so near its end, as a share of the side, passes the vertex: across 10000 faces
       rounding moves it by some 1e-12. */
    #define ON_SIDE 1e-10
    /* Angles that differ by less are equal: those of the faces around a vertex are rounded, and the direction is. */
    #define LEAST_ANGLE 1e-10
    """
    const double PI
    const double ON_SIDE
    const double LEAST_ANGLE

cdef enum:
    # Steps without length, one after another, after which a geodesic ends: only in places where all edges have length 0.
    MOST_IDLE = 10000
