# The way from a source through an edge to a point behind it that takes least time: where it crosses, as a share of the
# edge; how long it is, in all and behind the edge; and the radius of the front at the point.
cdef struct Refracted:
    double share, length, behind, radius

cdef Refracted refracted(double x, double y, double base, double along, double height, double behind) noexcept nogil
