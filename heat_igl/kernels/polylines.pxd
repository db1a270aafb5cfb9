from heat_igl.kernels.funnels cimport Layout
from heat_igl.kernels.priority_queue cimport PriorityQueue
from heat_igl.kernels.straightening cimport Course
from heat_igl.kernels.strips cimport Crossing, Strip
from heat_igl.kernels.surfaces cimport Surface

cdef extern from *:
    """
    // A part of a loop that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_PART 1e-13
    // Angles around a vertex that differ by less are the same: rounding.
    #define SAME_ANGLE 1e-6
    """
    double GAIN_OF_PART
    double SAME_ANGLE

# A vertex of a loop and the straight part to the joint after it: `count` crossings from `first` on, out of `face`. The
# part leaves at the angle `leave` around this vertex and comes to the next one at the angle `arrive` there.
cdef struct Joint:
    double length, leave, arrive
    int vertex, face, first, count, before, after


cdef class Polyline:
    cdef Course course
    cdef Surface s
    cdef const double[::1] polar
    cdef const double[::1] total
    cdef const int[::1] across
    cdef bint is_oriented
    # Joints, the numbers that are free, one joint that is not, and those to shorten at by how much their angles lack.
    cdef Joint[::1] joint
    cdef int[::1] free
    cdef int n_free, n_joints, some
    cdef PriorityQueue queue
    cdef Crossing[::1] crossing
    cdef int n_crossings
    # The part that is made: the strip, out of `face`.
    cdef Strip strip
    cdef int face
    cdef Layout layout

    cdef bint read(self) except -1 nogil
    cdef int clear(self, int count) except -1 nogil
    cdef int make(self, int v) noexcept nogil
    cdef void remove(self, int k) noexcept nogil
    cdef int relax(self) except -1 nogil
    cdef int shorten(self, int k) except -1 nogil
    cdef double angle(self, int k, bint* on_left) noexcept nogil
    cdef void check(self, int k) noexcept nogil
    cdef bint turn(self, Strip strip, int v, int f, int goal, bint on_left, double angle) except -1 nogil
    cdef double lay_out(self, int v, int w) except -1 nogil
    cdef int link(self, int a, int b) except -1 nogil
    cdef int set_part(self, int a, int f, int begin, int end, int i) except -1 nogil
    cdef int meet(self, int p, int k, int q) noexcept nogil
    cdef void trim(self, int v, int w) noexcept nogil
    cdef int write(self) except -1 nogil
    cdef bint lead(self, int v, int f, int goal) except -1 nogil
    cdef int push(self, int k, Strip strip) except -1 nogil
    cdef int last_face(self) noexcept nogil
