cdef extern from *:
    """
    // A point nearer to a vertex than this, in edge lengths, is at the vertex. From 1e-12 to 1e-7 the paths and loops
    // of shortening.py have the same bits.
    #define SNAP 1e-9
    """
    double SNAP

# Edge lengths are opposite the corners; none is 0. Each corner c lies `along` of the way from corner c + 2 to corner
# c + 1, and `above` that edge, in lengths of this edge.
cdef struct Triangle:
    double length[3]
    double angle[3]
    double along[3]
    double above[3]
    int vertex[3]

# Barycentric coordinates of a point in a face.
cdef struct Place:
    double c[3]


cdef class FaceTable:
    cdef const Triangle[::1] triangle
    cdef const int[::1] twin, ring, first_corner, corner


# The corner of face f at vertex v, -1 if it has none.
cdef inline int corner_of(FaceTable s, int f, int v) noexcept nogil:
    cdef const Triangle* t = &s.triangle[f]
    if t.vertex[0] == v:
        return 0
    if t.vertex[1] == v:
        return 1
    return 2 if t.vertex[2] == v else -1


# The next half-edge of the same edge, in turn; of an edge of one face, h itself.
cdef inline int next_side(FaceTable s, int h) noexcept nogil:
    return s.twin[h] if s.twin[h] >= 0 else s.ring[h]


# The other half-edge of the face of h at its vertex v.
cdef inline int other_side(FaceTable s, int h, int v) noexcept nogil:
    return 3 * (h // 3) + 3 - h % 3 - corner_of(s, h // 3, v)


# The vertex at a point of face f, -1 if there is none.
cdef inline int vertex_at(FaceTable s, int f, const Place* x) noexcept nogil:
    cdef int c
    for c in range(3):
        if x.c[c] > 1.0 - SNAP:
            return s.triangle[f].vertex[c]
    return -1


# The side that a point lies on, -1 inside.
cdef inline int side_of(const Place* x) noexcept nogil:
    cdef int c, on = -1
    for c in range(3):
        if x.c[c] == 0.0:
            on = c
    return on


cdef inline Place at_corner(int c) noexcept nogil:
    cdef Place x
    x.c[0] = x.c[1] = x.c[2] = 0.0
    x.c[c] = 1.0
    return x


# A point x in the face of half-edge h on that edge, in the face of half-edge g on the same edge.
cdef inline Place moved(FaceTable s, int h, int g, const Place* x) noexcept nogil:
    cdef Place there
    cdef int c
    there.c[0] = there.c[1] = there.c[2] = 0.0
    for c in range(3):
        if c != h % 3:
            there.c[corner_of(s, g // 3, s.triangle[h // 3].vertex[c])] = x.c[c]
    return there


cdef inline double weighted(const Place* x, const double* p) noexcept nogil:
    return x.c[0] * p[0] + x.c[1] * p[1] + x.c[2] * p[2]
