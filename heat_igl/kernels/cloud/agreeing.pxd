cdef double circumradius(const double[:, ::1] P, Py_ssize_t a, Py_ssize_t b, Py_ssize_t c) noexcept nogil
