from heat_igl.kernels.sweep.spokes cimport Spoke

cdef enum:
    BANDS = 1024

# A vertex that waits in a band, and the place of the one that comes after it.
cdef struct Waiting:
    int vertex, following


cdef class VisitOrder:
    cdef const int[::1] first
    cdef const Spoke[::1] spoke
    cdef double[::1] d
    cdef int[::1] order
    cdef int[::1] rank
    cdef Py_ssize_t n_ordered, n_passed
    cdef double[::1] key
    cdef Waiting[::1] place
    cdef int n_places, n_waiting
    cdef double per_length, band
    cdef int head[BANDS]
    cdef int tail[BANDS]

    cdef Py_ssize_t advance(self, Py_ssize_t i, Py_ssize_t count) noexcept nogil
    cdef void reach_neighbours(self) noexcept nogil
    cdef void put(self, int v, double key) noexcept nogil
    cdef int take(self) noexcept nogil
    cdef void leap(self) noexcept nogil
    cdef void append(self, int place) noexcept nogil
