from heat_igl.kernels.windows.structures cimport Search

cdef class Front:
    cdef Search state
    cdef object arrays
