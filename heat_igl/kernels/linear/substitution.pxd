cdef enum:
    # Right-hand sides that are solved together: the columns of a block.
    WIDTH = 8
    # Bytes of the factor, which lie behind on the way forward, that are fetched before they are needed.
    AHEAD = 4096
