cdef enum:
    # Rows of an update that are finished before the next ones: with the factor's rows they fit in the second cache.
    # 64 take as long, within 5 %.
    ROWS = 192
    # Entries of fronts after which a signal is asked for: some milliseconds of work.
    ASK = 1000000
