from heat_igl.kernels.bodies.edge_distances cimport EdgeDistances
from heat_igl.kernels.priority_queue cimport PriorityQueue


cdef struct Offer:
    int fit, next, is_guess
    double value


# As large as what a processor reads at once.
cdef struct Met:
    int fits[14]
    int count, next


cdef class Bends(EdgeDistances):
    cdef int[::1] fit_of, newest, met
    cdef Offer* offers
    cdef Met* lists
    cdef int n_offers, n_lists
    cdef size_t most_offers, most_lists
    cdef bint failed, is_guess
    cdef PriorityQueue waiting
    cdef double[::1] bound

    cdef void begin_around(self, int i) noexcept nogil
    cdef bint is_source(self, int i) noexcept nogil
    cdef int wake_at(self, int v) noexcept nogil
    cdef void wake(self, int u, int v) noexcept nogil
    cdef void begin(self, int i, bint follows) noexcept nogil
    cdef void begin_at(self, int v) noexcept nogil
    cdef void offer_around(self, int i, int u) noexcept nogil
    cdef void offer_at(self, int a, int v, double least) noexcept nogil
    cdef void offer(self, int i, int v, double least) noexcept nogil
    cdef bint has_met(self, int v, int fit) noexcept nogil
    cdef bint lacks_room(self) noexcept nogil
    cdef double most(self, int v) noexcept nogil
    cdef int shortest(self, int v) noexcept nogil
    cdef void ask(self, int v) noexcept nogil
