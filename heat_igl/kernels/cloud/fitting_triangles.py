"""Of the triangles of a point cloud, those that fit together: around no point do two of them overlap."""

import cython
import numpy as np
from cython.cimports.libc.math import fabs

# What measures angles grows by so much in a turn, and by half in half a turn.
_TURN = cython.declare(cython.double, 4.0)
_ROUNDING = cython.declare(cython.double, 1e-9)


def fitting_triangles(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    triangles: cython.const[cython.int][:, ::1],
    n_accepted: cython.Py_ssize_t,
):
    """Mask (m,) of `triangles` that overlap none before them: the first `n_accepted`, and those accepted one by one.

    Two triangles overlap if they have a corner in common and, in the tangent plane of that corner, their angles
    do. So no edge keeps more than two triangles.
    """
    m: cython.Py_ssize_t = triangles.shape[0]
    accepted = np.zeros(m, np.bool_)
    keep: cython.uchar[::1] = accepted.view(np.uint8)
    head: cython.int[::1] = np.full(P.shape[0], -1, np.int32)
    following: cython.int[:, ::1] = np.empty((m, 3), np.int32)
    sector: cython.double[:, :, ::1] = np.empty((m, 3, 2))
    with cython.nogil:
        for f in range(m):
            fits: cython.bint = True
            for c in range(3):
                has_angle: cython.bint = _find_sector(P, axes, triangles, f, c, sector)
                if f >= n_accepted and (not has_angle or _overlaps(f, c, triangles, head, following, sector)):
                    fits = False
                    break
            if fits:
                keep[f] = 1
                for c in range(3):
                    following[f, c] = head[triangles[f, c]]
                    head[triangles[f, c]] = 3 * f + c
    return accepted


@cython.cfunc
@cython.nogil
def _find_sector(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    triangles: cython.const[cython.int][:, ::1],
    f: cython.Py_ssize_t,
    c: cython.Py_ssize_t,
    sector: cython.double[:, :, ::1],
) -> cython.bint:
    """Start of the angle of triangle f at corner c, counterclockwise, and size; False if it has none."""
    at: cython.Py_ssize_t = triangles[f, c]
    begin: cython.double = _direction(P, axes, at, triangles[f, (c + 1) % 3])
    end: cython.double = _direction(P, axes, at, triangles[f, (c + 2) % 3])
    width: cython.double = end - begin
    if width < 0.0:
        width += _TURN
    if width > 0.5 * _TURN:
        begin, width = end, _TURN - width
    sector[f, c, 0], sector[f, c, 1] = begin, width
    return width > _ROUNDING and width < 0.5 * _TURN - _ROUNDING


@cython.cfunc
@cython.nogil
def _direction(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    i: cython.Py_ssize_t,
    j: cython.Py_ssize_t,
) -> cython.double:
    """What grows with the angle of point j around point i in the tangent plane of i, and needs no arctangent."""
    x: cython.double = 0.0
    y: cython.double = 0.0
    for c in range(3):
        x += (P[j, c] - P[i, c]) * axes[i, 0, c]
        y += (P[j, c] - P[i, c]) * axes[i, 1, c]
    size: cython.double = fabs(x) + fabs(y)
    angle: cython.double = y / size if size > 0.0 else 0.0
    return 2.0 - angle if x < 0.0 else angle


@cython.cfunc
@cython.nogil
def _overlaps(
    f: cython.Py_ssize_t,
    c: cython.Py_ssize_t,
    triangles: cython.const[cython.int][:, ::1],
    head: cython.int[::1],
    following: cython.int[:, ::1],
    sector: cython.double[:, :, ::1],
) -> cython.bint:
    """Whether the angle of triangle f at corner c overlaps one that was accepted at the same vertex."""
    other: cython.Py_ssize_t = head[triangles[f, c]]
    while other >= 0:
        g: cython.Py_ssize_t = other // 3
        e: cython.Py_ssize_t = other % 3
        ahead: cython.double = sector[g, e, 0] - sector[f, c, 0]
        if ahead < 0.0:
            ahead += _TURN
        if ahead < sector[f, c, 1] - _ROUNDING or _TURN - ahead < sector[g, e, 1] - _ROUNDING:
            return True
        other = following[g, e]
    return False
