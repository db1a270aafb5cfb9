cdef extern from *:
    """
    /* Barycentric coordinates of a new vertex are at least this, so that no split makes a triangle without area. */
    #define LEAST 0.01
    /* A cone of less than 60 degrees in all keeps the angle that it has. */
    #define SHARPEST 1.0471975511965976
    """
    const double LEAST
    const double SHARPEST

cdef enum:
    # A walk to a circumcenter crosses few triangles, since the triangulation is Delaunay.
    MOST_STEPS = 200
