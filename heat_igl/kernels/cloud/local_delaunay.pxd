cdef enum:
    # Columns of the neighbours of a point: angle around it, and the coordinates of the inverted neighbour.
    ANGLE = 0
    X = 1
    Y = 2
    # The star of so many nearest neighbours rules out most of the others. 6 and 16: 1 and 3 % more time for a cloud.
    FEW = 10
