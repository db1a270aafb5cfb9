"""Bounds of a distance that take no search: paths along edges from above, straight lines from below."""

import cython
from cython.cimports.libc.math import sqrt

__all__ = ["lengthen", "shorten"]


def shorten(
    ends: cython.const[cython.int][:, ::1],
    length: cython.const[cython.double][::1],
    d: cython.double[::1],
    labels: cython.longlong[::1],
):
    """Lower `d` (n,) to the paths along edges, in place; `labels` (n,), or none at all, are handed on with it.

    The pairs (e, 2) of `ends` are edges of those lengths (e,).
    """
    e: cython.Py_ssize_t
    i: cython.Py_ssize_t
    n_edges: cython.Py_ssize_t = length.shape[0]
    backward: cython.bint = True
    far: cython.int
    near: cython.int
    is_lower: cython.bint = True
    has_labels: cython.bint = labels.shape[0] > 0
    with cython.nogil:
        while is_lower:
            is_lower = False
            # Back and forth, which takes fewer passes along a row of edges.
            backward = not backward
            for i in range(n_edges):
                e = n_edges - 1 - i if backward else i
                near, far = ends[e, 0], ends[e, 1]
                if d[far] < d[near]:
                    near, far = far, near
                # Not by rounding, which would take passes of its own.
                if d[near] + length[e] < d[far] * (1 - 1e-12):
                    d[far] = d[near] + length[e]
                    if has_labels:
                        labels[far] = labels[near]
                    is_lower = True


def lengthen(V: cython.const[cython.double][:, ::1], place: cython.const[cython.double][::1], d: cython.double[::1]):
    """Raise `d` (n,) to the straight lines from a place (3,) to the vertices V (n, 3), in place."""
    i: cython.Py_ssize_t
    with cython.nogil:
        for i in range(d.shape[0]):
            x: cython.double = V[i, 0] - place[0]
            y: cython.double = V[i, 1] - place[1]
            z: cython.double = V[i, 2] - place[2]
            straight: cython.double = sqrt(x * x + y * y + z * z) * (1 - 1e-12)
            if d[i] < straight:
                d[i] = straight
