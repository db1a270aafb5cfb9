cdef extern from *:
    """
    /* Instructions that the processor has and the system supports. Compilers' __builtin_cpu_supports is not used: with
       some run-time libraries it answers no to everything. */
    #if defined(__x86_64__) || defined(_M_X64)
    #if defined(_MSC_VER)
    #include <intrin.h>
    static void heat_igl_cpuid(unsigned leaf, unsigned *r) { __cpuidex((int *) r, (int) leaf, 0); }
    static unsigned heat_igl_saved(void) { return (unsigned) _xgetbv(0); }
    #else
    #include <cpuid.h>
    static void heat_igl_cpuid(unsigned leaf, unsigned *r) { __cpuid_count(leaf, 0, r[0], r[1], r[2], r[3]); }
    static unsigned heat_igl_saved(void) {
        unsigned low, high;
        __asm__ volatile ("xgetbv" : "=a" (low), "=d" (high) : "c" (0));
        return low;
    }
    #endif
    #define HAS(word, bit) ((word) >> (bit) & 1)
    static int wide_vectors(void) {
        unsigned one[4], seven[4], none[4], saved;
        heat_igl_cpuid(0, none);
        if (none[0] < 7) return 0;
        heat_igl_cpuid(1, one);
        heat_igl_cpuid(7, seven);
        /* The system saves registers at a switch of threads; fused multiplications; AVX2. */
        if (!HAS(one[2], 27) || !HAS(one[2], 12) || !HAS(seven[1], 5)) return 0;
        saved = heat_igl_saved();
        if ((saved & 0x06) != 0x06) return 0;
        /* AVX-512 F, DQ, VL. */
        return (saved & 0xe6) == 0xe6 && HAS(seven[1], 16) && HAS(seven[1], 17) && HAS(seven[1], 31) ? 2 : 1;
    }
    #else
    static int wide_vectors(void) { return 0; }
    #endif
    """
    int wide_vectors() noexcept nogil
