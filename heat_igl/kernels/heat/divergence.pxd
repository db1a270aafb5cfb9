cdef enum:
    # Columns of the numbers of a face; `heat_igl.heat.steps._divergence_tables` says what they are.
    PER_BASE = 0
    FOOT = 1
    PER_HEIGHT = 2
    AREA = 3
    PER_RATE = 4
