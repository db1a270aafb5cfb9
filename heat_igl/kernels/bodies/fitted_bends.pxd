from heat_igl.kernels.bodies.edge_sight cimport EdgeSight

cdef extern from *:
    """
    // Share of an edge by which the fitted distance may be wrong at its quarters.
    #define MISFIT 1e-3
    // Change of the slope along an edge below which a front is straight there.
    #define LEVEL 1e-7
    """
    double MISFIT, LEVEL


cdef class FittedBends(EdgeSight):
    cdef bint is_stale(self, int i) noexcept nogil
    cdef void fit(self, int i) noexcept nogil
    cdef void lay_flat(self, int i) noexcept nogil
