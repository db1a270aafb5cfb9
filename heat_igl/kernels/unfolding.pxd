cdef enum:
    # Vertices that may wait for one another when the order is wrong.
    MAX_WAITING = 64
