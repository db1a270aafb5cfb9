# Entries are those of factors of six surfaces of 3k to 41k vertices and a box of 11k; time is that of the dissection.
cdef enum:
    # Thresholds tried per piece. 16: up to 4 % more entries; 128: as many, within 2 %.
    BUCKETS = 64
    # Pieces of so few vertices are eliminated together. 1: 2 to 5 % fewer entries, in 1.08 of the time; 8: 3 to 13 %
    # more.
    LEAF = 4
    # Rounds of averaging that straighten the cuts, and the size up to which it hardly matters. 0: up to 5 % more
    # entries; 4 and 8: as many, within 2 %, in 1.1 and 1.2 of the time. Size 30: .4 % fewer, in 1.05; 400: 1 % more.
    SMOOTHING = 2
    ROUGH = 100
    # The two parts of a piece are 0 and 1.
    SEPARATOR = 2


cdef struct Piece:
    # order[low:high]; where its parent starts in the order, or -1; the number of the piece.
    Py_ssize_t low, high, above
    int number


cdef struct Cut:
    # The last bucket on the left, or -1 where there is no cut; the side that gives its rim as the separator.
    int bucket, side


cdef struct Rims:
    # Vertices by bucket; where intervals of cuts begin (+1) and end (-1) in whose rims vertices are, left and right.
    long long inside[BUCKETS]
    long long rim[2][BUCKETS]


cdef class Dissecting:
    cdef const int[::1] ends, neighbours
    cdef int[::1] order
    cdef unsigned char[::1] is_start
    cdef long long[::1] parent
    # Of each vertex, the place in the order, and the piece that it is in, -1 in separators.
    cdef int[::1] position, piece
    cdef int n_pieces
    # The pieces left to do.
    cdef Piece[::1] stack
    cdef Py_ssize_t depth
    # Distances from both ends of the piece; of `near` then buckets, then parts as -1 - part.
    cdef int[::1] near, far, queue
    # The function that the vertices are sorted by.
    cdef float[::1] f, smooth

cdef void _push(Dissecting d, Py_ssize_t low, Py_ssize_t high, Py_ssize_t above, int number) noexcept nogil
cdef void _dissect_piece(Dissecting d, Piece piece) noexcept nogil
cdef Py_ssize_t _line_up(Dissecting d, Py_ssize_t low, Py_ssize_t high) noexcept nogil
cdef Py_ssize_t _breadth_first(Dissecting d, int root, int[::1] distance) noexcept nogil
cdef void _average(Dissecting d, Py_ssize_t low, Py_ssize_t high, float[::1] f, float[::1] smooth) noexcept nogil
cdef bint _fill_buckets(Dissecting d, Py_ssize_t first, Py_ssize_t end) noexcept nogil
cdef Cut _best_cut(Dissecting d, Py_ssize_t first, Py_ssize_t end) noexcept nogil
cdef void _assign(Dissecting d, Py_ssize_t low, Py_ssize_t high, Cut cut) noexcept nogil
cdef int _side(int code, Cut cut) noexcept nogil
cdef Py_ssize_t _arrange(Dissecting d, Py_ssize_t position, Py_ssize_t low, Py_ssize_t high, int part) noexcept nogil
