from heat_igl.kernels.paths.straightening cimport Course, Passing, Saved
from heat_igl.kernels.paths.strips cimport Strip

cdef extern from *:
    """
    // The base of a loop does not slide by a smaller share of its edge.
    #define SHORTEST_SLIDE 1e-4
    """
    double SHORTEST_SLIDE

cdef enum:
    # A loop whose length stays the same from this many bases, one after another, is straight at all of them.
    BOTH_WAYS = 2
    # Before the loop is straightened from one, it is led past its bends from so many: with 3 and without bound, more loops
    # are longer than those of flips of edges.
    FIRST_BASES = 8
    # From so many at most: a loop moves to the next vertex with each.
    MOST_BASES = 100000


cdef class Loop:
    cdef Course course
    cdef Passing passing
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
