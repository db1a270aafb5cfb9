from heat_igl.kernels.paths.strips cimport Strip
from heat_igl.kernels.paths.surfaces cimport Place, Surface

# A crossing in the plane: its left (0) and right (1) end, and their vertices.
cdef struct Gate:
    double x[2]
    double y[2]
    int vertex[2]

# A corner of the shortest path: where it lies, on which side of the strip (-1 at the start and the end), and the first
# and the last crossing at it.
cdef struct Bend:
    double x, y
    int side, first, last

# The corners of a face in the plane.
cdef struct Corners:
    double x[3]
    double y[3]


cdef class Layout:
    cdef Gate[::1] gate
    cdef Bend[::1] bend
    cdef int n_gates, n_bends
    cdef Corners first, last
    cdef double x, y

    cdef int lay_out(self, Surface s, int face, const Place* start, Strip strip) except -1 nogil
    cdef void pull_tight(self, double x, double y) noexcept nogil
    cdef void _bend_at(self, int count, int side, int at) noexcept nogil
    cdef double length(self) noexcept nogil
    cdef double share(self, int j, int i) noexcept nogil


cdef inline double weighted(const Place* x, const double* p) noexcept nogil:
    return x.c[0] * p[0] + x.c[1] * p[1] + x.c[2] * p[2]
