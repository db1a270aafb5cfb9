cdef enum:
    # Radii that are tried for the points of a leaf, and points that may be within one.
    MOST_TRIES = 8
    MOST_POINTS = 4096
    # Neighbours are put into so many shells of equal area, and sorted then.
    SHELLS = 64

cdef extern from *:
    """
    // Factors from the farthest neighbour in the last leaf to the radius of the next; from there to a larger one, more
    // each time, and to a smaller one.
    #define WIDER 1.03
    #define LARGER 1.1
    #define SMALLER 0.6
    // Squares of smaller radii lose digits to underflow.
    #define LEAST_RADIUS 1e-140
    """
    double WIDER, LARGER, SMALLER, LEAST_RADIUS

cdef class LeafSearch:
    cdef const double[:, ::1] P
    cdef const int[::1] first
    cdef const double[:, ::1] boxes
    cdef Py_ssize_t k, n_leaves
    cdef double radius
    # Points within the radius of the box: coordinates in columns, numbers, and the squared distances from one point.
    cdef double[:, ::1] near
    cdef int[::1] number
    cdef double[::1] square
    # Those of them that are sorted.
    cdef int[::1] kept
    cdef double[::1] keys
    cdef int[::1] values

    cdef Py_ssize_t gather(self, const double* box) noexcept nogil
    cdef Py_ssize_t append(self, Py_ssize_t leaf, Py_ssize_t count, const double* box) noexcept nogil
    cdef int sort_around(self, Py_ssize_t i, Py_ssize_t count, int[::1] index, double[::1] square) noexcept nogil
    cdef Py_ssize_t fill_shells(self, Py_ssize_t kept) noexcept nogil
    cdef void search(
        self,
        Py_ssize_t leaf,
        const long long[::1] chosen,
        int[:, ::1] index,
        double[:, ::1] square,
        unsigned char[::1] found,
    ) noexcept nogil
    cdef double first_guess(self, Py_ssize_t leaf) noexcept nogil
    cdef void sort(self, Py_ssize_t size) noexcept nogil
    cdef Py_ssize_t shell_of(self, Py_ssize_t j, double scale) noexcept nogil
    cdef void enclose(self, const long long[::1] chosen, double* box) noexcept nogil
