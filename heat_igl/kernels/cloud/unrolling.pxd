# Neighbours of a point in its tangent plane: projected, or unrolled around a sharp edge.
#
# Points p and q have coordinates p[0] to p[2]; axes[0] to axes[5] are the tangents of p, then comes the normal.

from libc.math cimport sqrt

cdef struct InPlane:
    double x, y

cdef extern from *:
    """
    // Squared slope above which a neighbour is unrolled into the tangent plane, instead of projected.
    #define STEEP 0.1
    // Sine of the angle between two planes below which the line in which they meet is not known well.
    #define ALIKE 0.2
    """
    double ALIKE, STEEP


cdef inline InPlane in_plane(
    const double* p, const double* axes, const double* q, const double* axes_of_q
) noexcept nogil:
    # Point q in the tangent plane of p, projected, or unrolled if it is steeply above or below; 0 right above it.
    cdef double dx = q[0] - p[0]
    cdef double dy = q[1] - p[1]
    cdef double dz = q[2] - p[2]
    cdef double height = dx * axes[6] + dy * axes[7] + dz * axes[8]
    cdef InPlane found
    found.x = dx * axes[0] + dy * axes[1] + dz * axes[2]
    found.y = dx * axes[3] + dy * axes[4] + dz * axes[5]
    cdef double square = found.x * found.x + found.y * found.y
    if height * height > STEEP * square:
        if square <= 1e-12 * height * height:
            found.x = found.y = 0.0
        else:
            found = unrolled(axes, &axes_of_q[6], found, height)
    return found


cdef inline InPlane unrolled(
    const double* axes, const double* normal, InPlane flat, double height
) noexcept nogil:
    # A point at its distance in a tangent plane, turned about the line in which this meets the plane of the point.
    #
    # Around a sharp edge projection makes the far side too short. Its normal, in the tangent plane:
    cdef double nx = normal[0] * axes[0] + normal[1] * axes[1] + normal[2] * axes[2]
    cdef double ny = normal[0] * axes[3] + normal[1] * axes[4] + normal[2] * axes[5]
    cdef double size = sqrt(nx * nx + ny * ny)
    cdef double scale, across, along, longer
    cdef InPlane found
    if size < ALIKE:
        scale = sqrt(1.0 + height * height / (flat.x * flat.x + flat.y * flat.y))
        found.x = scale * flat.x
        found.y = scale * flat.y
        return found
    nx = nx / size
    ny = ny / size
    across = nx * flat.x + ny * flat.y
    along = nx * flat.y - ny * flat.x
    longer = sqrt(across * across + height * height)
    if across < 0.0:
        longer = -longer
    found.x = longer * nx - along * ny
    found.y = longer * ny + along * nx
    return found
