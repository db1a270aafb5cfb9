# A triangle as fronts read it, one line of the processor's cache; heat_igl/unfolding/curved_fronts.py fills it.
cdef struct Triangle:
    double side[3]
    double leaving[3]
    int vertex[3]
    int spare
