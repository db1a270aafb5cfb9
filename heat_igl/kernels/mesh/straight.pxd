from heat_igl.kernels.mesh.triangles cimport foot, next_half_edge, previous_half_edge

cdef enum Begin:
    OVER_SIDE
    OUT_OF_TAIL  # across the side opposite
    INSIDE

# A straight line into the face of half-edge h, in the frame of h: the tail is the origin, the head lies on the first
# axis, the face above. It begins at (x, y), which is on that axis unless it is `INSIDE`, in the unit direction (dx, dy).
cdef struct Heading:
    int h, begin
    double x, y, dx, dy

# Where a ray leaves the face: over half-edge h, whose tail lies at a distance of `right` to the right of it and whose head
# `left` to the left, `ahead` by so much each. (dx, dy) is the direction in the outward frame of h: the head is the origin,
# the tail lies on the first axis, and dy > 0, which is the frame of an aligned twin.
cdef struct Exit:
    int h
    double right, left, tail_ahead, head_ahead, dx, dy


# Go straight on through one face, of triangles with sides `length` and this double area.
cdef inline Exit cross(const double* length, double double_area, const Heading* ray) noexcept nogil:
    cdef Exit out
    cdef int left = previous_half_edge(ray.h), right = next_half_edge(ray.h)
    cdef double base = length[ray.h]
    cdef double apex_x = foot(base, length[left], length[right])
    cdef double apex_y = double_area / base
    cdef double dx = ray.dx, dy = ray.dy, ux, uy
    # How far to the left of the ray, and how far ahead, each corner is.
    cdef double tail = ray.x * dy - ray.y * dx
    cdef double head = (ray.x - base) * dy - ray.y * dx
    cdef double apex = (apex_y - ray.y) * dx - (apex_x - ray.x) * dy
    cdef double tail_ahead = -ray.x * dx - ray.y * dy
    cdef double head_ahead = (base - ray.x) * dx - ray.y * dy
    cdef double apex_ahead = (apex_x - ray.x) * dx + (apex_y - ray.y) * dy
    cdef bint to_right = apex > 0.0 or ray.begin == OUT_OF_TAIL
    if ray.begin == INSIDE:
        # Over the side whose ends are on either side most clearly.
        to_right = min(-head, apex) >= min(-apex, tail)
        if min(-tail, head) >= max(min(-head, apex), min(-apex, tail)):
            return Exit(ray.h, max(-tail, 0.0), max(head, 0.0), tail_ahead, head_ahead, -dx, -dy)
    if to_right:
        out = Exit(right, max(-head, 0.0), max(apex, 0.0), head_ahead, apex_ahead, 0.0, 0.0)
        ux, uy = (base - apex_x) / length[right], -apex_y / length[right]
    else:
        out = Exit(left, max(-apex, 0.0), max(tail, 0.0), apex_ahead, tail_ahead, 0.0, 0.0)
        ux, uy = apex_x / length[left], apex_y / length[left]
    out.dx, out.dy = ux * dx + uy * dy, ux * dy - uy * dx
    return out
