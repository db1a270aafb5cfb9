cdef extern from *:
    """
    #if defined(__GNUC__) || defined(__clang__)
    #define HEAT_IGL_PREFETCH(address) __builtin_prefetch(address)
    #else
    #define HEAT_IGL_PREFETCH(address) ((void) 0)
    #endif
    """
    # Begin to fetch the cache line at an address while other work is done. Nothing need be there.
    void prefetch "HEAT_IGL_PREFETCH"(const void* address) noexcept nogil
