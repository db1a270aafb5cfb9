# The structures that walks over a triangulation read; what their fields mean stands in heat_igl/intrinsic/fans.py.

# Spokes and steps are one line of the processor's cache, turns half of one.
cdef struct Spoke:
    double length, along, height, base, beyond_along, beyond_depth
    int neighbour, next_neighbour, beyond, next

cdef struct Turn:
    double here, there
    int fan_here, fan_there, corner, across

cdef struct Step:
    double x, y, direction, angle
    int vertex, fan, to_right, to_left
    double spare[2]


cdef class HalfEdges:
    cdef const int[::1] first
    cdef const Spoke[::1] spoke
    cdef const Turn[::1] turn
    cdef const Step[::1] step
    cdef const double[::1] total


# The half-edges after and before `h` in its face.
cdef inline int following(int h) noexcept nogil:
    return h + 1 if h % 3 < 2 else h - 2


cdef inline int preceding(int h) noexcept nogil:
    return h - 1 if h % 3 else h + 2
