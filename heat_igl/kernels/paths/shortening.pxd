from heat_igl.kernels.paths.straightening cimport Course, Passing, Saved
from heat_igl.kernels.paths.strips cimport Crossing, FaceTable, Strip
from heat_igl.kernels.priority_queue cimport PriorityQueue

cdef extern from *:
    """
    // A part of a loop that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_PART 1e-13
    // Angles around a vertex that differ by less are the same: rounding.
    #define SAME_ANGLE 1e-6
    // The base of a loop does not slide by a smaller share of its edge.
    #define SHORTEST_SLIDE 1e-4
    """
    double GAIN_OF_PART
    double SAME_ANGLE
    double SHORTEST_SLIDE

cdef enum:
    # A loop whose length stays the same from this many bases, one after another, is straight at all of them.
    BOTH_WAYS = 2
    # From so many at most: a loop moves to the next vertex with each.
    MOST_BASES = 100000

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


cdef class Polyline:
    cdef Course course
    cdef FaceTable s
    cdef const double[::1] polar
    cdef const int[::1] across
    cdef bint is_oriented
    cdef Joints joints
    # The part that is made.
    cdef Course part

    cdef bint read(self) except -1 nogil
    cdef int relax(self) except -1 nogil
    cdef int shorten(self, int k) except -1 nogil
    cdef int begin(self, int k, int face) except -1 nogil
    cdef double lay_out(self, int k) except -1 nogil
    cdef bint turn(self, int v, int goal, bint on_left, double angle) except -1 nogil
    cdef int link(self, int a, int b) except -1 nogil
    cdef int set_part(self, int a, int f, int begin, int end, int i) except -1 nogil
    cdef int write(self) except -1 nogil


cdef class Loop:
    cdef Course course
    cdef Passing passing
    cdef Polyline polyline
    # The loop before the base slides, and its strip before the base moves.
    cdef Saved kept
    cdef Strip ring

    cdef double shorten(self) except -1 nogil
    cdef int relax(self) except -1 nogil
    cdef double tighten(self) except -1 nogil
    cdef double slide(self, double length) except -1 nogil
    cdef void place_base(self, int f, int a, int b, int a_end, int b_end, double share) noexcept nogil
    cdef int move_base(self) except -1 nogil
    cdef int close(self) except -1 nogil


cdef class Shortener:
    cdef Course course
    cdef Passing passing
    cdef Loop loop
    cdef double length

    cdef int follow(
        self, const int[::1] face, const int[:, ::1] join, const double[:, ::1] ends, bint is_closed
    ) except -2 nogil
