# Half-edge 3 f + c is the side of face f opposite corner c.

cdef inline int next_half_edge(int h) noexcept nogil:
    return h - 2 if h % 3 == 2 else h + 1

cdef inline int previous_half_edge(int h) noexcept nogil:
    return h + 2 if h % 3 == 0 else h - 1

cdef inline double foot(double base, double left, double right) noexcept nogil:
    # How far along its base, from the end of the side `left`, the apex of a triangle lies.
    return 0.5 * (base + (left - right) * ((left + right) / base))
