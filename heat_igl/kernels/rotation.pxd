from libc.math cimport fabs, sqrt

cdef enum:
    MOST_SWEEPS = 30


cdef inline bint rotate(double* work, int p, int q) noexcept nogil:
    # One rotation of Jacobi's eigenvalue algorithm on the symmetric matrix in the first three rows of `work` (6, 3);
    # the other three gather the eigenvectors. False if entry (p, q) is zero already.
    cdef int x, r = 3 - p - q
    cdef double entry = work[3 * p + q]
    cdef double half, tangent, cosine, sine, along, across
    if fabs(entry) <= 1e-17 * (fabs(work[4 * p]) + fabs(work[4 * q])):
        return False
    half = 0.5 * (work[4 * q] - work[4 * p]) / entry
    tangent = 1.0 / (fabs(half) + sqrt(half * half + 1.0))
    if half < 0.0:
        tangent = -tangent
    cosine = 1.0 / sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    work[4 * p] -= tangent * entry
    work[4 * q] += tangent * entry
    work[3 * p + q] = work[3 * q + p] = 0.0
    along, across = work[3 * r + p], work[3 * r + q]
    work[3 * r + p] = work[3 * p + r] = cosine * along - sine * across
    work[3 * r + q] = work[3 * q + r] = sine * along + cosine * across
    for x in range(3):
        along, across = work[9 + 3 * p + x], work[9 + 3 * q + x]
        work[9 + 3 * p + x] = cosine * along - sine * across
        work[9 + 3 * q + x] = sine * along + cosine * across
    return True


cdef inline void diagonalize(double* work) noexcept nogil:
    # Eigenvalues in the diagonal of the matrix in the first three rows of `work` (6, 3), eigenvectors in the others.
    cdef int x
    for x in range(9):
        work[9 + x] = x % 4 == 0
    for x in range(MOST_SWEEPS):
        if not (rotate(work, 0, 1) | rotate(work, 0, 2) | rotate(work, 1, 2)):
            break
