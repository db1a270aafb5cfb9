cdef enum:
    # Rows of a ring: points, and the corners opposite to the edges after them.
    POINT = 0
    BEYOND = 1
