from heat_igl.kernels.paths.descent cimport Departure
from heat_igl.kernels.paths.surfaces cimport Place, Surface

# A point on an axis or off it: how far along, and how high above.
cdef struct Apex:
    double along, height

# Where a way crosses a side, as a share of it, and its length.
cdef struct Aim:
    double share, length

cdef double aim(Surface s, int f, const Place* x, double left, double best, Place* out) noexcept nogil
cdef Departure aim_from_vertex(Surface s, int v) noexcept nogil
