# A triangle as fronts read it; heat_igl/unfolding/curved_fronts.py fills it.
cdef struct Triangle:
    double side[3]
    double leaving[3]
    double ending[3]
    double double_area
    int vertex[3]
    int spare
