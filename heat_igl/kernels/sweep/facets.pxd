cdef extern from *:
    """
    // Share of a facet by which the place moves in the last step of Newton's method, which leaves about its square.
    #define PLACED 1e-4
    """
    double PLACED

cdef enum:
    MOST_STEPS = 12
    MOST_HALVINGS = 8


cdef inline void multiply(const double* W, const double* e, double* into) noexcept nogil:
    # Symmetric matrices have their entries on and above the diagonal, row by row.
    into[0] = W[0] * e[0] + W[1] * e[1] + W[2] * e[2]
    into[1] = W[1] * e[0] + W[3] * e[1] + W[4] * e[2]
    into[2] = W[2] * e[0] + W[4] * e[1] + W[5] * e[2]


cdef inline void invert(const double* W, double* into) noexcept nogil:
    cdef int k
    cdef double per
    into[0] = W[3] * W[5] - W[4] * W[4]
    into[1] = W[2] * W[4] - W[1] * W[5]
    into[2] = W[1] * W[4] - W[2] * W[3]
    into[3] = W[0] * W[5] - W[2] * W[2]
    into[4] = W[1] * W[2] - W[0] * W[4]
    into[5] = W[0] * W[3] - W[1] * W[1]
    per = 1.0 / (W[0] * into[0] + W[1] * into[1] + W[2] * into[2])
    for k in range(6):
        into[k] *= per


cdef inline double mean_velocity(const double* W) noexcept nogil:
    # Over directions; that across a triangle is the mean in its plane.
    return (W[0] + W[3] + W[5]) / 3.0



cdef class Facet:
    cdef int p, q
    cdef double start
    cdef double D[3]
    cdef double sag[3][3]
    cdef double product[9]
    cdef double share[3]
    cdef double g[3]
    cdef double H[3][3]
    # Vectors to the corners, and velocity at v and at the corners: the inverse root of the metric, and its mean.
    cdef double E[3][3]
    cdef const double* W[4]
    cdef double s[4]
    # The length of the gradient of the mean velocity, in the metric of the centre.
    cdef double growth
    # Of the last value.
    cdef double T, near, sx, even, bent, factor, factor_1
    cdef double rise[3]
    cdef double own[3]
    cdef double w[3]
    cdef double u[3]
    cdef double inverse[6]
    cdef double a[3][3]

    cdef double dual(self, int k, const double* e) noexcept nogil
    cdef double along_edges(self) noexcept nogil
    cdef double length(self, const double* x) noexcept nogil
    cdef double lean(self, int i) noexcept nogil
    cdef double value(self, const double* x) noexcept nogil
    cdef void curve(self) noexcept nogil
    cdef double newton(self, double limit) noexcept nogil
    cdef (double, double) on_triangle(self, double* x) noexcept nogil
