cdef enum:
    # Right-hand sides that are solved together: the columns of a block.
    WIDTH = 8
    # Bytes of the factor, which lie behind on the way forward, that are fetched before they are needed. 1024 and 16384
    # take as long, within 5 %.
    AHEAD = 4096
