cdef enum:
    # Right-hand sides that are solved together: the columns of a block.
    WIDTH = 8
