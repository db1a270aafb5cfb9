"""Checks of the arrays of a mesh, and the bounding box of the vertices in use, each in one pass."""

import cython
import numpy as np
from cython.cimports.libc.float import DBL_MAX
from cython.cimports.libc.math import INFINITY, fabs

__all__ = ["OUTSIDE", "REPEATS", "all_finite", "bounds", "first_fault"]

#: What `first_fault` finds: an index that is no vertex, or the same vertex twice in one face.
OUTSIDE = 1
REPEATS = 2


def all_finite(positions: cython.const[cython.double][:, ::1]) -> bool:
    """Whether no entry of an array (n, d) is infinite or NaN."""
    i: cython.Py_ssize_t
    size: cython.Py_ssize_t = positions.shape[0] * positions.shape[1]
    entry: cython.pointer(cython.const[cython.double]) = cython.address(positions[0, 0])
    n_bad: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(size):
            n_bad += not (fabs(entry[i]) <= DBL_MAX)
    return n_bad == 0


def first_fault(faces: cython.const[cython.longlong][:, ::1], n: cython.longlong) -> int:
    """OUTSIDE if an index in `faces` (m, k) is not in 0 ... n - 1, else REPEATS if a face has one twice, else 0."""
    f: cython.Py_ssize_t
    c: cython.Py_ssize_t
    d: cython.Py_ssize_t
    m: cython.Py_ssize_t = faces.shape[0]
    width: cython.Py_ssize_t = faces.shape[1]
    lowest: cython.longlong = 0
    highest: cython.longlong = 0
    repeats: cython.bint = False
    with cython.nogil:
        for f in range(m):
            for c in range(width):
                lowest = min(lowest, faces[f, c])
                highest = max(highest, faces[f, c])
                for d in range(c):
                    repeats |= faces[f, c] == faces[f, d]
    if lowest < 0 or highest >= n:
        return OUTSIDE
    return REPEATS if repeats else 0


def bounds(positions: cython.const[cython.double][:, ::1], faces: cython.const[cython.longlong][:, ::1]):
    """Bounding box (2, 3) of the positions (n, 3) that faces (m, k) use: smallest and largest coordinates."""
    found = np.empty((2, 3))
    corners: cython.double[:, ::1] = found
    is_used: cython.uchar[::1] = np.zeros(positions.shape[0], np.uint8)
    low: cython.double[3]
    high: cython.double[3]
    f: cython.Py_ssize_t
    c: cython.Py_ssize_t
    v: cython.Py_ssize_t
    x: cython.double
    with cython.nogil:
        for c in range(3):
            low[c], high[c] = INFINITY, -INFINITY
        for f in range(faces.shape[0]):
            for c in range(faces.shape[1]):
                is_used[faces[f, c]] = True
        for v in range(positions.shape[0]):
            if is_used[v]:
                for c in range(3):
                    x = positions[v, c]
                    low[c] = x if x < low[c] else low[c]
                    high[c] = x if x > high[c] else high[c]
        for c in range(3):
            corners[0, c], corners[1, c] = low[c], high[c]
    return found
