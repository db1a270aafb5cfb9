# The columns of a front, packed one after the other, each from its diagonal on down.

cdef extern from *:
    """
    #if defined(_MSC_VER)
    typedef double *__restrict numbers;
    typedef const double *__restrict entries;
    #else
    typedef double *__restrict__ numbers;
    typedef const double *__restrict__ entries;
    #endif
    """
    # Pointers to numbers that nothing else points to in the same function, so that loops over them become vectors.
    ctypedef double *numbers
    ctypedef const double *entries


cdef inline Py_ssize_t in_panel(Py_ssize_t column, Py_ssize_t row, Py_ssize_t size) noexcept nogil:
    # Where an entry on or below the diagonal is in the columns of a front with `size` rows.
    return column * size - column * (column + 1) // 2 + row
