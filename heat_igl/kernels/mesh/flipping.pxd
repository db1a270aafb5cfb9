cdef enum:
    # Kinds of moves, as `heat_igl.intrinsic.Moved` has them.
    SPLIT = 0
    FLIP = 1

cdef class Flips:
    # As `HalfEdges` has them; there may be room for more faces.
    cdef int[::1] vertex, twin, ring
    cdef double[::1] length
    # Twice that of each face.
    cdef double[::1] area
    # The angle opposite each half-edge; between two that are not, no edge is flipped.
    cdef unsigned char[::1] is_obtuse
    cdef int[::1] waiting
    cdef unsigned char[::1] is_waiting
    cdef int n_waiting
    cdef double tolerance
    # Of the flip that was found to improve: the length of the new edge.
    cdef double diagonal
    # The moves so far, if they are recorded; there may be room for more.
    cdef bint records
    cdef long long[:, ::1] kind
    cdef double[:, ::1] numbers
    cdef int n_moves

    cdef void measure(self, int f) noexcept nogil
    cdef void wait(self, int h) noexcept nogil
    cdef int next(self) noexcept nogil
    cdef bint improves(self, int h) noexcept nogil
    cdef int flip(self, int h) except -1 nogil
    cdef void glue(self, int old, int new, int twin) noexcept nogil
    cdef int append_move(self, int kind, int h, int mate) except -1 nogil

cdef void _move(int[::1] ring, int old, int new) noexcept nogil
