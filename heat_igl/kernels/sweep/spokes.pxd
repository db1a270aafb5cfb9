# The structures that a sweep reads; what their fields mean stands in `heat_igl.sweep.sweep.Spokes`.

# One line of the processor's cache.
cdef struct Spoke:
    double length, along, height, base, beyond_along, beyond_depth
    int neighbour, next_neighbour, beyond, next

# A corner: the place of its vertex over the opposite side, in units of that side, and cosine and sine of half its angle.
cdef struct Corner:
    double x, y, cosine, sine

