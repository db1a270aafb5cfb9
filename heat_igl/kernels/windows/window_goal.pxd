from heat_igl.kernels.windows.window_structures cimport Search, Window

cdef void aim_at(Search* s, int v, int goal) noexcept nogil
cdef int towards_goal(Search* s, int e, Window* run, int n) noexcept nogil


# A little more than a distance: by more than rounding, and than needles are made longer by. Edges are about 1.
cdef inline double with_rounding(double distance) noexcept nogil:
    return distance * (1.0 + 1e-9) + 1e-10
