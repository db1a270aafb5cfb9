from heat_igl.kernels.priority_queue cimport PriorityQueue
from heat_igl.kernels.sweep.simplex_updates cimport SimplexUpdate

cdef extern from *:
    """
    // By which share of a distance the changes along a path that are not handed on may add up, about.
    #define SETTLED 5e-4
    // What a vertex may rise, as a share of its distance, though those it depends on do not: then its second order halves.
    #define RISEN 0.1
    // By how many mean edges others may be nearer to a vertex from which a source is followed on: 0 to .25 measured.
    #define CLOSE 0.1
    // By which share of a distance paths must exceed it to show that it is too short. On eight images of 40 x 40 pixels the
    // mean error was .46, .42 and .52 % at .002, .01 and .04, and .58 without.
    #define TOO_SHORT 0.01
    """
    double SETTLED, RISEN, CLOSE, TOO_SHORT


cdef enum:
    NOT_FOUND = -2

cdef class HopfLax:
    cdef SimplexUpdate update
    cdef PriorityQueue waiting
    # Visits from near to far that are left, but for the first one to each vertex.
    cdef Py_ssize_t left
    cdef const int[:, ::1] corners
    cdef const int[::1] first, incident
    # Distance, the same of visited vertices alone, the change that visits have not taken in, and distance from all sources.
    cdef double[::1] d, known, pending, limit
    # Facets that have changed since they were asked.
    cdef unsigned char[::1] changed, leads
    # Which vertices lead on to those around them, and those that the source has reached, in this order.
    cdef int[::1] label, n_visits, reached
    cdef int n_reached
    # Distance at the source, the change that is not handed on, and that of the slope of the last vertex.
    cdef double low, settled, turn[3]
    # The paths to each vertex through a facet between two metrics: the corners at their ends, and their lengths.
    cdef const int[::1] begin
    cdef const int[:, ::1] ends
    cdef const double[::1] lengths
    # The mark of each simplex, 0 where the metric varies in it, and how many facets are joint.
    cdef const float[::1] mark
    cdef int n_joint
    # The corner whose facet gave each vertex its distance, that opposite a facet beyond if it comes from there, else -1,
    # the places on both, and what it adds to T linear.
    cdef int[::1] facet, beyond
    cdef double[:, ::1] place
    cdef double[::1] step
    # What each vertex rose though those at its place did not, and how far T is of second order for it.
    cdef double[::1] risen, weight
    # Depth-first search has not seen a vertex, has it open, or is done with it; sums of steps over the open ones.
    cdef int[::1] roots, order, stack
    cdef unsigned char[::1] state
    cdef double[::1] sum
    # Of each vertex, the velocities at both ends of the last edge that it was asked along.
    cdef long long[::1] asked
    cdef long long n_asked
    # By how much each distance may be wrong, and by how much of that at its last step.
    cdef double[::1] doubt, own

    cdef int support(self, int v, int i) noexcept nogil
    cdef double share(self, int v, int i) noexcept nogil
    cdef double above(self, int v, double value) noexcept nogil
    cdef double contradiction(self, int v) noexcept nogil
    cdef bint is_too_short(self, int v) noexcept nogil
    cdef int corner_over(self, int at) noexcept nogil
    cdef void forget(self, int v) noexcept nogil
    cdef void march(self) noexcept nogil
    cdef void lead_on(self, int v) noexcept nogil
    cdef void reach(self, int v) noexcept nogil
    cdef void wait(self, int v) noexcept nogil
    cdef void sharpen(self) noexcept nogil
    cdef void renew(self, int v) noexcept nogil
    cdef void hand_on(self, int v, double old, double change) noexcept nogil
    cdef void visit(self, int v) noexcept nogil
    cdef void arrange(self) noexcept nogil
    cdef void open_circle(self, int u, int n_open) noexcept nogil
