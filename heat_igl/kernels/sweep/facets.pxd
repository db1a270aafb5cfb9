cdef extern from *:
    """
    // Share of |v - x| by which the value falls, to first order, in the last step of Newton's method; its square stays.
    #define PLACED 1e-5
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

cdef inline int entry(int i, int j) noexcept nogil:
    # Which of these is in row i and column j.
    return i * (5 - i) // 2 + j if i < j else j * (5 - j) // 2 + i

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

cdef inline void cross(const double* a, const double* b, double* into) noexcept nogil:
    cdef int x
    for x in range(3):
        into[x] = a[(x + 1) % 3] * b[(x + 2) % 3] - a[(x + 2) % 3] * b[(x + 1) % 3]

cdef inline int simplex_of(int at, int size) noexcept nogil:
    # Of a corner ``simplex * size + corner``; divisions by a constant take a tenth of the time.
    return at // 4 if size == 4 else at // 3

cdef inline int pair(int i, int j) noexcept nogil:
    # The number of the pair of two of four corners, as np.tril_indices counts them below the diagonal.
    return i + j - 1 + (i == 3) + (j == 3)

cdef inline void squares_of(const double* I, const double* e, int n, double* into) noexcept nogil:
    # The squares of |I e| for n vectors e.
    cdef int k
    cdef double w[3]
    for k in range(n):
        multiply(I, e + 3 * k, w)
        into[k] = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]

cdef inline void gradient(double* E, double* rise, int p, double* into) noexcept nogil:
    # The vector with the products rise (p,) with p vectors E (3, 3), in the plane of two; 0 if they span nothing.
    cdef int i, x
    cdef double volume
    cdef double across[9]
    if p == 2:
        cross(E, E + 3, E + 6)
        rise[2] = 0.0
    for i in range(3):
        cross(E + 3 * ((i + 1) % 3), E + 3 * ((i + 2) % 3), across + 3 * i)
    volume = E[0] * across[0] + E[1] * across[1] + E[2] * across[2]
    for x in range(3):
        into[x] = rise[0] * across[x] + rise[1] * across[3 + x] + rise[2] * across[6 + x]
        into[x] = into[x] / volume if volume != 0.0 else 0.0

cdef inline double on_interval(double slope, double bend, double low, double high) noexcept nogil:
    # Where slope x + bend x^2 / 2 is least between two bounds.
    if bend > 0.0:
        return min(max(-slope / bend, low), high)
    return low if slope * low + 0.5 * bend * low * low < slope * high + 0.5 * bend * high * high else high

cdef inline double model(double gb, double ge, double bb, double be, double ee, double b, double e) noexcept nogil:
    return gb * b + ge * e + 0.5 * (bb * b * b + ee * e * e) + be * b * e

cdef class Facet:
    cdef int p, q
    cdef double start
    cdef double D[3], sag[3][3], product[9], share[3]
    cdef double g[3], H[3][3]
    # Vectors to the corners, and velocity at v and at the corners: the inverse root of the metric, and its mean.
    cdef double E[3][3]
    cdef const double* W[4]
    cdef double s[4]
    # The length of the gradient of the mean velocity, in the metric of the centre.
    cdef double growth
    # Of the last value.
    cdef double T, near, sx, even, bent, factor, factor_1
    cdef double rise[3], own[3], w[3], u[3], inverse[6], a[3][3]

    cdef double along_edges(self) noexcept nogil
    cdef double length(self, const double* x) noexcept nogil
    cdef double lean(self, int i) noexcept nogil
    cdef double value(self, const double* x, double L) noexcept nogil
    cdef void curve(self) noexcept nogil
    cdef double newton(self, double L, double limit) noexcept nogil
    cdef (double, double) on_triangle(self, double* x) noexcept nogil
