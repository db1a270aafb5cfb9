cdef extern from *:
    """
    #if defined(__GNUC__) || defined(__clang__)
    // The empty statement keeps GCC from dropping calls of functions that do nothing but prefetch.
    #define HEAT_IGL_PREFETCH(address) do { __asm__ volatile (""); __builtin_prefetch(address); } while (0)
    #else
    #define HEAT_IGL_PREFETCH(address) ((void) 0)
    #endif
    """
    # Begin to fetch the cache line at an address while other work is done. Nothing need be there.
    void prefetch "HEAT_IGL_PREFETCH"(const void* address) noexcept nogil
