from heat_igl.kernels.sweep.band_queue cimport BandQueue, Waiting
from heat_igl.kernels.sweep.spokes cimport SpokeTable

cdef class VisitOrder:
    cdef SpokeTable t
    cdef double[::1] d
    cdef int[::1] order
    cdef int[::1] rank
    cdef double[::1] key
    cdef Waiting[::1] waiting
    cdef BandQueue ahead
    cdef Py_ssize_t n_ordered, n_passed

    cdef Py_ssize_t advance(self, Py_ssize_t i, Py_ssize_t count) noexcept nogil
    cdef void put_known(self, double width) noexcept nogil
    cdef void reach_neighbours(self) noexcept nogil
