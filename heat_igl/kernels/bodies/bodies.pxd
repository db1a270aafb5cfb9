cdef enum:
    # What lies behind a side that has not been looked at.
    UNKNOWN = -2


cdef class Body:
    cdef readonly object _arrays
    cdef const int[:, ::1] corners
    cdef const int[::1] first
    cdef const int[::1] incident
    cdef const double[:, ::1] positions
    cdef int[:, ::1] behind
    cdef int[::1] first_neighbour
    cdef int[::1] neighbours
    cdef double[::1] reach

    cdef int across(self, int t, int o) noexcept nogil
    cdef int list_around(self, int v, int[::1] mark, int[::1] into, int at) noexcept nogil
    cdef double longest_edge(self, int v) noexcept nogil
