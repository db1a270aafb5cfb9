from heat_igl.kernels.bodies.rays cimport Line, Ray


cdef struct Piece:
    double begin, value, slope, lean


# All that is known of an edge stands together, in the order in which it is read, in nine lines of the processor's cache:
# for most candidates, the first one tells that they are too far. What stands before `pieces` is set when it is made.
cdef struct Edge:
    double end[3]
    double tangent[3]
    double least
    int count, fits
    double outward[3]
    double across[3]
    double before[2]
    double wall, length, along, height, start
    double at[5]
    # Between five points, and one more between each two.
    Piece pieces[9]
    int label[9]
    # Up to the end of a line.
    double unused[5]


cdef class EdgeDistances(Ray):
    cdef const int[:, ::1] edges
    cdef int n_edges
    cdef double[::1] table
    cdef Edge* edge
    cdef int[::1] way
    cdef double bend[3]
    cdef double place, whole, share, slope
    cdef int[::1] at_end, first_at_end, last_at_end, point_of
    cdef unsigned char[::1] followed
    cdef int refuted, front, origin, point, n_near
    cdef Line line
    cdef int near[258]
    cdef double near_value[258]

    cdef void fit(self, int i, bint follows) noexcept nogil
    cdef void meet(self, int i, int j, double one, double other, bint hidden) noexcept nogil
    cdef bint is_hidden(self, int i, int j, int f) noexcept nogil
    cdef double slope_along(self, int i) noexcept nogil
    cdef void add_piece(self, int i, double begin, double value, int label) noexcept nogil
    cdef int label_at(self, int i) noexcept nogil
    cdef int front_at(self, int v) noexcept nogil
    cdef double from_front(self, int f, const double* x) noexcept nogil
    cdef void point_along(self, int i, double j, double* x) noexcept nogil
    cdef bint holds(self, int i) noexcept nogil
    cdef void lay_flat(self, int i, int a, int b) noexcept nogil
    cdef double shortest_to(self, int i, const double* x, double most) noexcept nogil
    cdef void add_at(self, int e, int v, const double* x, double most) noexcept nogil
    cdef int next_around(self, int e, int k) noexcept nogil
    cdef void add_beside(self, int e, const double* x, double most) noexcept nogil
    cdef void add(self, int e, int i, const double* x, double most) noexcept nogil
    cdef double around(self, int i, const double* x, double most) noexcept nogil
    cdef void look_back(self, int f, const double* x) noexcept nogil
    cdef bint is_lit(self, int e, int f, const double* x) noexcept nogil
    cdef bint leaves_at_once(self, int e, const double* x) noexcept nogil
    cdef bint is_hidden_from_before(self, int i, const double* x, double size) noexcept nogil
