# The normalized field of one face, which `heat_tangent` and `heat_adjoint` differentiate in opposite directions.

from libc.math cimport fabs, sqrt

# The differences d of v are multiplied by `scale`, so that the largest is 1; then `energy` is d . K d over the sides, with
# the weights K, and the field is s K d. `is_damped` if s comes from the full rate instead of the gradient.
cdef struct FaceField:
    double scale, energy, s
    bint is_damped


cdef inline bint normalize(
    double* d, const double* weight, double area, double full_rate, FaceField* field
) noexcept nogil:
    # Scale the three differences d of v along the sides of a face in place, and normalize the field that they give.
    #
    # s is 1 / |grad v|, or 1 / full_rate where the gradient is below that, both for the scaled differences. False if
    # the face has no field: v is constant, or `full_rate` negative.
    cdef int c
    cdef double largest = 0.0
    for c in range(3):
        largest = max(largest, fabs(d[c]))
    if largest == 0.0 or full_rate < 0.0:
        return False
    # Squares of the differences of heat may vanish: the largest is made 1 first.
    field.scale = 1.0 / largest
    field.energy = 0.0
    for c in range(3):
        d[c] = d[c] * field.scale
        field.energy += weight[c] * d[c] * d[c]
    if not field.energy > 0.0:
        return False
    # |grad v|^2 is the energy over the area.
    field.s = sqrt(area / field.energy)
    field.is_damped = full_rate * field.s * field.scale > 1.0
    if field.is_damped:
        # As d has been scaled, so is s.
        field.s = largest / full_rate
    return True
