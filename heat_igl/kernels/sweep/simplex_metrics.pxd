cdef void _add_misses(
    const int[:, ::1] corners, const double[:, ::1] W, const int[::1] group, const int[::1] first,
    double[::1] share, double[:, ::1] result, double[:, ::1] at
) noexcept nogil
cdef void _sum_products(
    const int[:, ::1] corners, const double[:, ::1] X, const double[:, ::1] W, const int[::1] group,
    const int[::1] component, const double[:, ::1] middle, double[:, ::1] at
) noexcept nogil
cdef double _sum_around(
    int v, const int[:, ::1] corners, const int[::1] first, const int[::1] incident, const double[:, ::1] at,
    int[::1] near, int[::1] met, double* mean
) noexcept nogil
