# A vertex on the heap, by the length of the best way to it and of the straight line from there to the goal.
cdef struct Entry:
    double key
    int vertex
