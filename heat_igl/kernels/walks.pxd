from libc.math cimport M_PI, atan2, sqrt

from heat_igl.kernels.half_edges cimport HalfEdges

cdef extern from *:
    """
    // Bends by less than this are rounding.
    #define STRAIGHT 1e-9
    // In place of an angle, for a path that cannot be pulled tight.
    #define REAL_BEND 100.0
    // For a path through a place between two vertices, whose lengths and directions give the one there.
    #define BETWEEN 200.0
    """
    double STRAIGHT, REAL_BEND, BETWEEN

cdef enum:
    # A vertex without a fan has no direction: sources, and vertices not yet visited.
    NO_FAN = -1

# What is known of the path of a vertex; the fields stand in heat_igl/unfolding/walks.py. One line of the processor's
# cache, which is a twelfth faster than without the spare room.
cdef struct Walk:
    double distance, offset, reach, angle, total
    int fan, label
    double departure
    int root, spare

# A source inside a face; on a side, once for the face beyond, whose side of corners 0 and 1 is turned by `turn`.
cdef struct Inside:
    double barycentric[3]
    double turn
    int following, row

# The best path found so far for the vertex v that is visited: its length; straight to the vertex `end` at (x, y) and on
# by that one's own path; what pulling it tight saves in angle, positive when `end` is passed on its left and negative
# on its right, REAL_BEND where it bends there for good; (ax, ay) is the direction of v's spoke. If the path bends
# or ends at `end`, `there` is the direction in which it leaves that: an angle in its fan, or in its face.
cdef struct Way:
    double distance, x, y, saving, ax, ay, there
    int end, spoke

# What a neighbour says of the way to v's source: SAYS_LEFT if its own path is shorter passing left of it; the angle
# that this saves, and the length that it promises.
cdef struct Advice:
    double saving, promise
    int side

cdef enum:
    SAYS_RIGHT = -1
    BENDS = 0
    SAYS_LEFT = 1
    NOT_VISITED = 2

# What v, in the origin, sees over its `spoke` and through an edge from a (right) to b (left): the cone between R and L,
# and the half-edge h beyond that edge, negative if there is none.
cdef struct View:
    double ax, ay, bx, by, rx, ry, lx, ly
    int h, spoke

# A part of a search: its view, the shortest that a path through it may be, and the vertices a and b.
cdef struct Cone:
    View view
    double forecast
    int a, b

# An end of the cone of a walk: where it lies, how far away, and by how much its path misses being straight; -1 if it
# is not passed on the side of the cone. `there` is the direction back at a neighbour; at others it is not needed.
cdef struct Limit:
    double x, y, length, saving, there
    int vertex

# By how much less than pi a path turns on the right and on the left side of a vertex.
cdef struct Savings:
    double right, left


cdef class Query:
    cdef HalfEdges t
    cdef Walk[::1] walk
    cdef const int[::1] first_inside
    cdef const Inside[::1] inside
    cdef const unsigned char[::1] barrier
    cdef double tolerance, shortfall, roughness
    cdef int max_steps
    cdef bint has_holes
    cdef Way found
    cdef Advice[::1] advice
    cdef Cone[::1] cone


cdef bint arrive(Query q, View view, double wx, double wy) noexcept nogil


# Note the path of length `distance` if it is the shortest so far.
cdef inline void take(
    Query q, double distance, int end, double x, double y, double saving, int spoke, double ax, double ay, double there
) noexcept nogil:
    if distance < q.found.distance:
        q.found.distance, q.found.end, q.found.x, q.found.y = distance, end, x, y
        q.found.saving, q.found.spoke, q.found.ax, q.found.ay, q.found.there = saving, spoke, ax, ay, there


# The path comes from the direction `incoming` and leaves in that of `walk`, angles in a fan that sums to ``walk.total``
# (negative: open, and there is no way around through the boundary). A positive saving: passing the vertex on that side
# is shorter.
cdef inline Savings savings(double incoming, const Walk* walk) noexcept nogil:
    cdef Savings turned
    cdef double right = walk.angle - incoming
    if walk.total > 0.0:
        if right < 0.0:
            right += walk.total
        turned.right, turned.left = M_PI - right, M_PI - (walk.total - right)
    elif right >= 0.0:
        turned.right, turned.left = M_PI - right, -10.0
    else:
        turned.right, turned.left = -10.0, M_PI + right
    return turned


# Length of the path by a vertex `length` away once its bend, `saving` short of straight, is pulled tight.
cdef inline double promise(double length, const Walk* walk, double saving) noexcept nogil:
    cdef double s = saving * saving
    # 1 - cos(saving), to 2e-9 up to 1 and to 1e-3 at pi.
    cdef double versine = s * (0.5 - s * (1.0 / 24 - s * (1.0 / 720 - s * (1.0 / 40320 - s / 3628800))))
    cdef double straight = length + walk.reach
    cdef double squared = straight * straight - 2.0 * length * walk.reach * versine
    return walk.offset + (sqrt(squared) if squared > 0.0 else 0.0)


# At a point (x, y) in the face behind a view: the angle from the side of corners 0 and 1 to the origin.
cdef inline double seen_from_point(View view, double wx, double wy, double x, double y) noexcept nogil:
    cdef double ex = wx - view.ax, ey = wy - view.ay
    # From w, its face runs first to b and then to a.
    if view.h % 3 == 0:
        ex, ey = view.bx - wx, view.by - wy
    elif view.h % 3 == 2:
        ex, ey = view.ax - view.bx, view.ay - view.by
    return atan2(ey * x - ex * y, -(ex * x + ey * y))
