from heat_igl.kernels.paths.face_table cimport FaceTable, corner_of, next_side, other_side

# From a half-edge of one face to a half-edge of the next on the same edge.
cdef struct Crossing:
    int leave, enter

# A step around a vertex enters a face: the half-edge that it enters through, the one to leave it through (-1 in the
# last face), and the step before it.
cdef struct Around:
    int enter, leave, before

# The last step of a way that goes on, and its length to the edge where the face is left.
cdef struct Tip:
    double length
    int step

# Angles from a half-edge at a vertex to where a path passes, and from the other half-edge there in the same face.
cdef struct Sides:
    double this, other


cdef class Strip:
    cdef Crossing[::1] crossing
    cdef int count

    cdef int push(self, int leave, int enter) except -1 nogil
    cdef int extend(self, Crossing[::1] crossing, int begin, int end) except -1 nogil
    cdef int copy(self, Strip other) except -1 nogil
    cdef void drop(self, int k) noexcept nogil


cdef class Detour:
    cdef Around[::1] step
    cdef Tip[::1] tip
    cdef Crossing[::1] way

    cdef int find(
        self, FaceTable s, int v, int h, Sides before, int goal, int end, Sides after, double limit
    ) noexcept nogil
    cdef int _crossings(self, int last) noexcept nogil
