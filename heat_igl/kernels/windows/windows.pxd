from heat_igl.kernels.windows.window_structures cimport Search

cdef class Front:
    cdef Search state
    cdef object arrays
