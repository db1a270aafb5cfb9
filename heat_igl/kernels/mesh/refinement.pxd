cdef extern from *:
    """
    /* Barycentric coordinates of a new vertex are at least this, so that no split makes a triangle without area. */
    #define LEAST 0.01
    /* A cone of less than 60 degrees in all keeps the angle that it has. */
    #define SHARPEST 1.0471975511965976
    """
    const double LEAST
    const double SHARPEST

cdef enum:
    # Kinds of moves, as `heat_igl.intrinsic.history` has them.
    SPLIT = 0
    FLIP = 1
    # A walk to a circumcenter crosses few triangles, since the triangulation is Delaunay.
    MOST_STEPS = 200

# A point by the barycentric coordinates in a face; face -1 for no point.
cdef struct Location:
    long long face
    double u, v, w

# The straight walk in the plane of the first face: from, to, and the difference.
cdef struct Ray:
    double ox, oy, tx, ty, dx, dy

# The side by which the walk leaves a face: the half-edge, and the ends of it to the right (r) and left (s) of the ray.
cdef struct Exit:
    long long h
    double rx, ry, sx, sy
