from heat_igl.kernels.paths.surfaces cimport Place, Surface, at_corner

# The steepest descent in a face: its slope, and up to a factor how fast each barycentric coordinate grows.
cdef struct Descent:
    double slope
    double rate[3]

# Where a way leaves a vertex: through `face`, to `at` where it leaves that face again, or, if `vertex` is not -1, along
# an edge of it to that one. Face -1: nowhere.
cdef struct Departure:
    int face, vertex
    Place at

cdef Descent steepest(Surface s, int f) noexcept nogil
cdef Departure leave_vertex(Surface s, int v) noexcept nogil
cdef void leave_face(Place* x, const double* rate) noexcept nogil


cdef inline Departure nowhere() noexcept nogil:
    cdef Departure way
    way.face = way.vertex = -1
    way.at = at_corner(0)
    return way
