from heat_igl.kernels.paths.face_table cimport FaceTable, Place, corner_of, weighted
from heat_igl.kernels.paths.strips cimport Strip

# A crossing in the plane: its left (0) and right (1) end, and their vertices.
cdef struct Gate:
    double x[2]
    double y[2]
    int vertex[2]

# A corner of the shortest path: where it lies, on which side of the strip (-1 at the start and the end), and the first
# and the last crossing at it.
cdef struct FunnelCorner:
    double x, y
    int side, first, last

# The corners of a face in the plane.
cdef struct Corners:
    double x[3]
    double y[3]


cdef class Funnel:
    cdef Gate[::1] gate
    cdef FunnelCorner[::1] bend
    cdef int n_gates, n_bends
    cdef Corners first, last
    cdef double x, y

    cdef int lay_out(self, FaceTable s, int face, const Place* start, Strip strip) except -1 nogil
    cdef void pull_tight(self, double x, double y) noexcept nogil
    cdef FunnelCorner corner(self, int at, int side) noexcept nogil
    cdef double length(self) noexcept nogil
    cdef double share(self, int j, int i) noexcept nogil
