cdef enum:
    # Sides of the triangles at a vertex that straight lines cross: more are held only for a moment.
    SIDES = 16
