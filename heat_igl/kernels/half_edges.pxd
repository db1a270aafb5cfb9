# The structures that walks over a triangulation read; what their fields mean stands in heat_igl/intrinsic/fans.py.

# One line of the processor's cache.
cdef struct Spoke:
    double length, along, height, base, beyond_along, beyond_depth
    int neighbour, next_neighbour, beyond, next

cdef struct Turn:
    double here, there
    int fan_here, fan_there, corner, is_crowded

cdef struct Step:
    double x, y, angle
    int vertex, to_right, to_left, fan

# A half-edge and the corner opposite to it: the apex over the half-edge in units of the half-edge; the angle of the
# corner, the direction of the first of its two sides in its fan, that fan (-1: not known yet), and its vertex.
cdef struct Corner:
    double x, y, angle, direction
    int fan, vertex


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
