cdef extern from *:
    """
    // A line or a way is taken if it is shorter by more than this share of its length.
    #define GAIN 1e-9
    // Part of the way to the middle of a tetrahedron by which the ends of a line are moved inside.
    #define NUDGE 1e-6
    // Part of a triangle by which a straight line may miss it, along its rim.
    #define ON_SIDE 1e-9
    """
    double GAIN, NUDGE, ON_SIDE


# A line on its way through tetrahedra. It goes `forward` or against the axis `up`, from p; seen along it, it is at the
# origin of `x` and `y`, where the corners are of the triangle through which it leaves tetrahedron t, in this order if
# `sign` is 1; `out` is the fourth corner of t. It arrives where a tetrahedron `has` the vertices `goal_a` and `goal_b`,
# bits 1 and 2. It meets the plane of the triangle that was last tried at `ahead` / `of_all` along `up`.
cdef struct Line:
    const double* origin
    const double* goal
    int goal_a, goal_b
    int up, east, north
    double p_x, p_y, p_z, tilt_x, tilt_y, forward
    int t, out
    int corner[3]
    int has[3]
    double x[3]
    double y[3]
    double sign, least, slack, ahead, of_all
    int side


cdef class Body:
    cdef readonly object _arrays
    cdef int[:, ::1] cells
    cdef const int[::1] first
    cdef const int[::1] incident
    cdef const double[:, ::1] positions
    cdef int[::1] first_neighbour
    cdef int[::1] neighbours
    cdef double[::1] reach

    cdef int across(self, int t, int o) noexcept nogil
    cdef int list_around(self, int v, int[::1] mark, int[::1] into, int at) noexcept nogil
    cdef double away(self, int v, const double* x) noexcept nogil
    cdef double apart(self, int v, int u) noexcept nogil


cdef class Ray:
    cdef Body body
    cdef const int[::1] sources
    cdef const double[::1] offset
    cdef double[::1] d
    cdef int[::1] label
    cdef int[::1] last_cone
    cdef int[::1] last_wall

    cdef bint follows(self, Line* line, int v) noexcept nogil
    cdef bint arrives_from(self, Line* line, int begin) noexcept nogil
    cdef int arrives(self, Line* line, int begin, int into, int toward) noexcept nogil
    cdef bint is_blocked(self, Line* line, double room) noexcept nogil
    cdef int cone(self, Line* line, int v) noexcept nogil
    cdef void aim(self, Line* line, int t, int into, double nudge, int toward) noexcept nogil
    cdef bint leaves(self, Line* line, int k, double part) noexcept nogil
