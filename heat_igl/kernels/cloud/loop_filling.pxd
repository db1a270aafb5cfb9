cdef extern from *:
    """
    #define MOST 40
    """
    Py_ssize_t MOST
