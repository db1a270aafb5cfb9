"""A bound of a distance that takes no search: paths along edges."""

import cython
import numpy as np
from cython.cimports.libc.math import fabs


def is_longer(
    ends: cython.const[cython.int][:, ::1],
    length: cython.const[cython.double][::1],
    d: cython.const[cython.double][::1],
    share: cython.double = 0.0,
) -> bool:
    """Whether `shorten` would lower any of the distances `d` (n,) along the edges: mostly it would not."""
    found: cython.bint = False
    with cython.nogil:
        for e in range(length.shape[0]):
            # Infinite at both ends gives nan, and false.
            if fabs(d[ends[e, 0]] - d[ends[e, 1]]) > length[e] * (1 + share):
                found = _far_end(ends, length, d, e, share) >= 0
                if found:
                    break
    return found


def incident_edges(ends: cython.const[cython.int][:, ::1], n: cython.int):
    """Edges by vertex: those of v are ``incident[first[v]:first[v + 1]]``; returns both arrays, int64 and int32."""
    firsts = np.zeros(n + 1, np.int64)
    by_vertex = np.empty(2 * ends.shape[0], np.int32)
    first: cython.longlong[::1] = firsts
    incident: cython.int[::1] = by_vertex
    with cython.nogil:
        for e in range(ends.shape[0]):
            for c in range(2):
                first[ends[e, c]] += 1
        for v in range(n):
            first[v + 1] += first[v]
        # Now first[v] is where the edges of v end; filled from there back to where they begin.
        for e in range(ends.shape[0] - 1, -1, -1):
            for c in range(2):
                first[ends[e, c]] -= 1
                incident[first[ends[e, c]]] = e
    return firsts, by_vertex


def glued_edges(
    F: cython.const[cython.longlong][:, ::1],
    length: cython.const[cython.double][::1],
    twin: cython.const[cython.longlong][::1],
):
    """Ends (e, 2) int32 and lengths (e,) of the edges of a triangulation, each once; of more than two faces, for each.

    As an `IntrinsicTriangulation` has them, with the lengths (3 m,) in one row.
    """
    e: cython.Py_ssize_t = 0
    with cython.nogil:
        for f in range(twin.shape[0]):
            e += twin[f] < 0 or f < twin[f]
    pairs, lengths = np.empty((e, 2), np.int32), np.empty(e)
    ends: cython.int[:, ::1] = pairs
    length_of: cython.double[::1] = lengths
    e = 0
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(3):
                if twin[3 * f + c] < 0 or 3 * f + c < twin[3 * f + c]:
                    ends[e, 0], ends[e, 1] = F[f, (c + 1) % 3], F[f, (c + 2) % 3]
                    length_of[e] = length[3 * f + c]
                    e += 1
    return pairs, lengths


def shorten(
    ends: cython.const[cython.int][:, ::1],
    length: cython.const[cython.double][::1],
    first: cython.const[cython.longlong][::1],
    incident: cython.const[cython.int][::1],
    d: cython.double[::1],
    labels: cython.longlong[::1],
    share: cython.double = 0.0,
):
    """Lower `d` (n,) to the paths along edges, in place; `labels` (n,), or none at all, are handed on with it.

    The pairs (e, 2) of `ends` are edges of those lengths (e,); ``incident[first[v] : first[v + 1]]`` are the edges of
    vertex v. One pass over all edges, and then only over those of vertices that were lowered. With a `share`, the pass
    leaves edges alone on which the given distances are too long by less than that share of the length; whatever the
    order of the edges, the result is the same.
    """
    n: cython.Py_ssize_t = d.shape[0]
    # A circular buffer: no vertex waits twice, so n places suffice.
    waiting: cython.int[::1] = np.empty(n, np.int32)
    given: cython.const[cython.double][::1] = np.array(d) if share > 0 else d
    is_waiting: cython.uchar[::1] = np.zeros(n, np.uint8)
    begin: cython.Py_ssize_t = 0
    count: cython.Py_ssize_t = 0
    with cython.nogil:
        for e in range(length.shape[0]):
            # Nearly always false, and so cheaper than to ask which end is nearer.
            if fabs(given[ends[e, 0]] - given[ends[e, 1]]) > length[e] * (1 + share):
                lowered = _lowered(ends, length, d, labels, e)
                if lowered >= 0 and not is_waiting[lowered]:
                    is_waiting[lowered] = True
                    waiting[count] = lowered
                    count += 1
        while count > 0:
            v: cython.int = waiting[begin]
            is_waiting[v] = False
            begin = begin + 1 if begin + 1 < n else 0
            count -= 1
            for k in range(first[v], first[v + 1]):
                lowered = _lowered(ends, length, d, labels, incident[k])
                if lowered >= 0 and not is_waiting[lowered]:
                    is_waiting[lowered] = True
                    end: cython.Py_ssize_t = begin + count
                    waiting[end if end < n else end - n] = lowered
                    count += 1


@cython.cfunc
@cython.inline
@cython.nogil
def _lowered(
    ends: cython.const[cython.int][:, ::1],
    length: cython.const[cython.double][::1],
    d: cython.double[::1],
    labels: cython.longlong[::1],
    e: cython.Py_ssize_t,
) -> cython.int:
    """The end of edge e whose distance was lowered to the path along it; -1 if that is not shorter."""
    far: cython.int = _far_end(ends, length, d, e, 0.0)
    if far >= 0:
        near: cython.int = ends[e, 0] if ends[e, 1] == far else ends[e, 1]
        d[far] = d[near] + length[e]
        if labels.shape[0] > 0:
            labels[far] = labels[near]
    return far


@cython.cfunc
@cython.inline
@cython.nogil
def _far_end(
    ends: cython.const[cython.int][:, ::1],
    length: cython.const[cython.double][::1],
    d: cython.const[cython.double][::1],
    e: cython.Py_ssize_t,
    share: cython.double,
) -> cython.int:
    """The end of edge e to which the path along it is shorter, by more than that share; -1 if there is none."""
    near: cython.int = ends[e, 0]
    far: cython.int = ends[e, 1]
    if d[far] < d[near]:
        near, far = far, near
    # Not by rounding, which would pass along many edges.
    return far if d[near] + length[e] * (1 + share) < d[far] * (1 - 1e-12) else -1
