from libc.math cimport sqrt

# Half-edge 3 f + c is the side of face f opposite corner c. Without a branch: corners come in any order.

cdef inline int next_half_edge(int h) noexcept nogil:
    return h + 1 - 3 * (h % 3 == 2)

cdef inline int previous_half_edge(int h) noexcept nogil:
    return h - 1 + 3 * (h % 3 == 0)

cdef inline double foot(double base, double left, double right) noexcept nogil:
    # How far along its base, from the end of the side `left`, the apex of a triangle lies.
    return 0.5 * (base + (left - right) * ((left + right) / base))

cdef inline double area(double a, double b, double c) noexcept nogil:
    # Area of a triangle by its sides in Kahan's order of operations, which keeps all digits of needles (Kahan 2014).
    cdef double swapped
    if a < b:
        swapped = a; a = b; b = swapped
    if b < c:
        swapped = b; b = c; c = swapped
    if a < b:
        swapped = a; a = b; b = swapped
    cdef double product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))
    return 0.25 * sqrt(product) if product > 0.0 else 0.0
