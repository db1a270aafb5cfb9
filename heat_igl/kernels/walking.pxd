from heat_igl.kernels.walks cimport Query

cdef extern from *:
    """
    // How much more may be lost on a part of a path, in proportion, than on the whole.
    #define SHARE 1.5
    """
    double SHARE

# An end of the cone of a walk: where it lies, how far away, and by how much its path misses being straight; -1 if it
# is not passed on the side of the cone. `there` is the direction back at a neighbour; at others it is not needed.
cdef struct Limit:
    double x, y, length, saving, there
    int vertex

cdef double look_around(Query q, int v) noexcept nogil
cdef int walk_through(Query q, int v, int k) noexcept nogil
cdef void cross_crowded(Query q, int k) noexcept nogil
