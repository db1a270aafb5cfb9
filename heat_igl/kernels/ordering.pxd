from libc.string cimport memcpy

cdef enum:
    # Sign, exponent and the first 21 bits of the mantissa, in three digits.
    BITS = 11
    MASK = (1 << BITS) - 1

cdef extern from *:
    """
    #define TOP 0x8000000000000000ULL
    """
    unsigned long long TOP
