# Take a microsecond, and longer while another thread runs Python: ask some hundred times a second.
cdef bint is_interrupted() noexcept nogil
