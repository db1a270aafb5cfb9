"""Neighbours of a point in its tangent plane: projected, or unrolled around a sharp edge."""

import cython
from cython.cimports.heat_igl.kernels.unrolling import ALIKE, STEEP, InPlane
from cython.cimports.libc.math import sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def in_plane(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    i: cython.Py_ssize_t,
    j: cython.Py_ssize_t,
) -> InPlane:
    """Point j in the tangent plane of i, projected, or unrolled if it is steeply above or below; 0 right above it."""
    dx: cython.double = P[j, 0] - P[i, 0]
    dy: cython.double = P[j, 1] - P[i, 1]
    dz: cython.double = P[j, 2] - P[i, 2]
    found: InPlane
    found.x = dx * axes[i, 0, 0] + dy * axes[i, 0, 1] + dz * axes[i, 0, 2]
    found.y = dx * axes[i, 1, 0] + dy * axes[i, 1, 1] + dz * axes[i, 1, 2]
    height: cython.double = dx * axes[i, 2, 0] + dy * axes[i, 2, 1] + dz * axes[i, 2, 2]
    square: cython.double = found.x * found.x + found.y * found.y
    if height * height > STEEP * square:
        if square <= 1e-12 * height * height:
            found.x = found.y = 0.0
        else:
            found = _unrolled(axes, i, j, found.x, found.y, height)
    return found


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _unrolled(
    axes: cython.const[cython.double][:, :, ::1],
    i: cython.Py_ssize_t,
    j: cython.Py_ssize_t,
    x: cython.double,
    y: cython.double,
    height: cython.double,
) -> InPlane:
    """Point j in the tangent plane of i at its distance, turned about the line in which their planes meet.

    Around a sharp edge projection makes the far side too short.
    """
    # The normal of j, in the tangent plane of i.
    nx: cython.double = axes[j, 2, 0] * axes[i, 0, 0] + axes[j, 2, 1] * axes[i, 0, 1] + axes[j, 2, 2] * axes[i, 0, 2]
    ny: cython.double = axes[j, 2, 0] * axes[i, 1, 0] + axes[j, 2, 1] * axes[i, 1, 1] + axes[j, 2, 2] * axes[i, 1, 2]
    size: cython.double = sqrt(nx * nx + ny * ny)
    found: InPlane
    scale: cython.double
    if size < ALIKE:
        scale = sqrt(1.0 + height * height / (x * x + y * y))
        found.x, found.y = scale * x, scale * y
        return found
    nx, ny = nx / size, ny / size
    across: cython.double = nx * x + ny * y
    along: cython.double = nx * y - ny * x
    longer: cython.double = sqrt(across * across + height * height)
    if across < 0.0:
        longer = -longer
    found.x = longer * nx - along * ny
    found.y = longer * ny + along * nx
    return found
