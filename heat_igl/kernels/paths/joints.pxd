from heat_igl.kernels.priority_queue cimport PriorityQueue
from heat_igl.kernels.paths.strips cimport Crossing, Strip

# A vertex of a loop and the straight part to the joint after it: `count` crossings from `first` on, out of `face`. The
# part leaves at the angle `leave` around this vertex and comes to the next one at the angle `arrive` there.
cdef struct Joint:
    double length, leave, arrive
    int vertex, face, first, count, before, after


cdef class Joints:
    cdef const double[::1] total
    # Joints, the numbers that are free, how many joints there are, and the number of one of them.
    cdef Joint[::1] joint
    cdef int[::1] free
    cdef int n_free, count, some
    # Joints with an angle below pi, by how much it is below.
    cdef PriorityQueue queue
    cdef Crossing[::1] crossing
    cdef int n_crossings

    cdef int clear(self, int count) except -1 nogil
    cdef int make(self, int v) noexcept nogil
    cdef void remove(self, int k) noexcept nogil
    cdef bint remove_spur(self, int p, int k, int q) noexcept nogil
    cdef int sharpest(self) noexcept nogil
    cdef double angle(self, int k, bint* on_left) noexcept nogil
    cdef void check(self, int k) noexcept nogil
    cdef int set_crossings(self, int k, Strip strip, int begin, int end) except -1 nogil
    cdef int push(self, int k, Strip strip) except -1 nogil
