from heat_igl.kernels.mesh.flipping cimport Flips
from heat_igl.kernels.priority_queue cimport PriorityQueue

# A point by the barycentric coordinates in a face; face -1 for no point.
cdef struct Location:
    int face
    double u, v, w


cdef class _Refinement:
    cdef Flips flips
    cdef int n_faces, n_vertices
    cdef PriorityQueue bad
    cdef double[::1] unit, largest
    cdef unsigned char[::1] is_sharp
    cdef double least_sine

    cdef int run(self, long long most_vertices) except -1 nogil
    cdef void judge(self, int f) noexcept nogil
    cdef double badness(self, int f) noexcept nogil
    cdef int insert(self, Location at) except -1 nogil
    cdef int split(self, int f, double u, double v, double w) except -1 nogil
    cdef void glue(self, int h, int t) noexcept nogil

cdef void _find_sharp(Flips t, int n_faces, unsigned char[::1] seen, unsigned char[::1] is_sharp) noexcept nogil
cdef Location _circumcenter(Flips t, int f) noexcept nogil
