# Take a microsecond, and longer while another thread runs Python: ask some hundred times a second.
cdef enum:
    # Visits of about a microsecond between two questions.
    ASK = 4096

cdef bint is_interrupted() noexcept nogil
