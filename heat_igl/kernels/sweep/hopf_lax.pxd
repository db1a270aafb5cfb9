from heat_igl.kernels.priority_queue cimport PriorityQueue
from heat_igl.kernels.sweep.adjacent_updates cimport AdjacentUpdate
from heat_igl.kernels.sweep.simplex_updates cimport SimplexUpdate

cdef extern from *:
    """
    // Relative error that changes below the threshold may add up to along a path, approximately.
    #define SETTLED 5e-4
    // Relative increase of a distance, without increase of those it depends on, at which its second order is halved.
    #define RISEN 0.1
    // A source is propagated from a vertex if others are nearer by at most so many mean edges: 0 to .25 measured.
    #define CLOSE 0.1
    """
    double SETTLED, RISEN, CLOSE


cdef class HopfLax:
    cdef SimplexUpdate update
    cdef AdjacentUpdate adjacent
    cdef PriorityQueue waiting
    # Updates by distance that are left, apart from the first one of each vertex.
    cdef Py_ssize_t left
    cdef const int[:, ::1] corners
    cdef const int[::1] first, incident
    # Distance; the same at updated vertices only; pending change; upper bound of the distance from all sources.
    cdef double[::1] d, known, pending, limit
    # Facets that have changed since their last evaluation; vertices that were propagated from.
    cdef unsigned char[::1] changed, leads
    # Labels, numbers of updates in sweeps, and the vertices that the source has reached, in this order.
    cdef int[::1] label, n_visits, reached
    cdef int n_reached
    # Initial distance of the source, threshold of changes, and change of the gradient in the last update.
    cdef double low, settled, turn[3]
    # Paths to each vertex across a facet between two metrics, see `HopfLax`.
    cdef const int[::1] begin
    cdef const int[:, ::1] ends
    cdef const double[::1] lengths
    # Of the last update of each vertex: the corner opposite the facet, the corner opposite a facet beyond it or -1,
    # barycentric coordinates of the minimizers on both, and distance minus linear T.
    cdef int[::1] facet, beyond
    cdef double[:, ::1] place
    cdef double[::1] step
    # Accumulated increase, see RISEN, and weight of the second order.
    cdef double[::1] risen, weight
    # Depth-first search: states 0 new, 1 open, 2 done; sums of steps over the open vertices.
    cdef int[::1] roots, order, stack
    cdef unsigned char[::1] state
    cdef double[::1] sum
    # Key of the last edge relaxed to each vertex: a count of velocities at starts, and the velocity at its end.
    cdef long long[::1] asked
    cdef long long n_asked

    cdef int support(self, int v, int i) noexcept nogil
    cdef double share(self, int v, int i) noexcept nogil
    cdef double above(self, int v, double value) noexcept nogil
    cdef bint is_too_short(self, int v) noexcept nogil
    cdef void forget(self, int v) noexcept nogil
    cdef void march(self) noexcept nogil
    cdef void lead_on(self, int v) noexcept nogil
    cdef void reach(self, int v) noexcept nogil
    cdef void wait(self, int v) noexcept nogil
    cdef void ask_again(self, int v) noexcept nogil
    cdef void sharpen(self) noexcept nogil
    cdef void renew(self, int v) noexcept nogil
    cdef void hand_on(self, int v, double old, double change) noexcept nogil
    cdef double through(self, int s, int c, double best, int far) noexcept nogil
    cdef void visit(self, int v) noexcept nogil
    cdef void arrange(self) noexcept nogil
    cdef void open_circle(self, int u, int n_open) noexcept nogil
