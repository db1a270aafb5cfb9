cdef class Dependencies:
    cdef const int[:, ::1] corners
    # The corner whose facet gave each vertex its distance, the place there, and what it adds to T linear.
    cdef int[::1] facet
    cdef double[:, ::1] place
    cdef double[::1] step, weight, pending
    # Depth-first search has not seen a vertex, has it open, or is done with it; sums of steps over the open ones.
    cdef int[::1] order, stack
    cdef unsigned char[::1] state
    cdef double[::1] sum

    cdef void arrange(self) noexcept nogil
    cdef void open_circle(self, int u, int n_open) noexcept nogil
