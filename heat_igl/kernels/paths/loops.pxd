from heat_igl.kernels.paths.passing cimport Saved
from heat_igl.kernels.paths.polylines cimport Polyline
from heat_igl.kernels.paths.settled_paths cimport SettledPath
from heat_igl.kernels.paths.straightening cimport Course

cdef extern from *:
    """
    // The base of a loop does not slide by a smaller share of its edge.
    #define SHORTEST_SLIDE 1e-4
    """
    double SHORTEST_SLIDE

cdef enum:
    # A loop whose length stays the same from this many bases, one after another, is straight at all of them.
    BOTH_WAYS = 2
    # From so many at most: a loop moves to the next vertex with each.
    MOST_BASES = 100000


cdef class Loop:
    cdef SettledPath path
    cdef Course course
    cdef Polyline polyline
    # The loop before the base slides, and before it moves.
    cdef Saved kept, ring

    cdef double shorten(self) except -1 nogil
    cdef int relax(self) except -1 nogil
    cdef double tighten(self) except -1 nogil
    cdef double slide(self, double length) except -1 nogil
    cdef void place_base(self, int f, int a, int b, int a_end, int b_end, double share) noexcept nogil
    cdef int move_base(self) except -1 nogil
    cdef int close(self) except -1 nogil
    cdef int turn_ring(self, int at) except -1 nogil
