cdef enum:
    # Rows of an update that are finished before the next ones: with the factor's rows they fit in the second cache.
    ROWS = 192
