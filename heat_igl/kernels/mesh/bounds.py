"""A bound of a distance that takes no search: paths along edges."""

import cython
import numpy as np
from cython.cimports.libc.math import fabs


@cython.final
@cython.cclass
class EdgePaths:
    """Paths along edges, whose ends (e, 2) int32 are among n vertices, and lengths (e,) float64.

    Once they are asked for, the edges of vertex v are ``incident[first[v] : first[v + 1]]``.
    """

    ends: cython.const[cython.int][:, ::1]
    length: cython.const[cython.double][::1]
    first: cython.longlong[::1]
    incident: cython.int[::1]

    def __init__(self, ends, length, n: cython.Py_ssize_t):
        self.ends, self.length = ends, length
        self.first, self.incident = np.zeros(n + 1, np.int64), np.empty(0, np.int32)

    def __reduce__(self):
        """What it was made of."""
        return EdgePaths, (np.asarray(self.ends), np.asarray(self.length), self.first.shape[0] - 1)

    def shorten(self, d: cython.double[::1], labels=None, share: cython.double = 0.0) -> None:
        """Lower `d` (n,) to the paths along edges, in place; `labels` (n,) are handed on with it.

        One pass over all edges, and then only over those of vertices that were lowered. With a `share`, the pass leaves
        edges alone on which the given distances are too long by less than that share of the length; whatever the order
        of the edges, the result is the same.
        """
        if not self.is_longer(d, share):
            return
        self.list_incident()
        n: cython.Py_ssize_t = d.shape[0]
        label: cython.longlong[::1] = np.empty(0, np.int64) if labels is None else labels
        # A circular buffer: no vertex waits twice, so n places suffice.
        waiting: cython.int[::1] = np.empty(n, np.int32)
        given: cython.const[cython.double][::1] = np.array(d) if share > 0 else d
        is_waiting: cython.uchar[::1] = np.zeros(n, np.uint8)
        begin: cython.Py_ssize_t = 0
        count: cython.Py_ssize_t = 0
        with cython.nogil:
            for e in range(self.length.shape[0]):
                # Nearly always false, and so cheaper than to ask which end is nearer.
                if fabs(given[self.ends[e, 0]] - given[self.ends[e, 1]]) > self.length[e] * (1 + share):
                    lowered = self.lower(d, label, e)
                    if lowered >= 0 and not is_waiting[lowered]:
                        is_waiting[lowered] = True
                        waiting[count] = lowered
                        count += 1
            while count > 0:
                v: cython.int = waiting[begin]
                is_waiting[v] = False
                begin = begin + 1 if begin + 1 < n else 0
                count -= 1
                for k in range(self.first[v], self.first[v + 1]):
                    lowered = self.lower(d, label, self.incident[k])
                    if lowered >= 0 and not is_waiting[lowered]:
                        is_waiting[lowered] = True
                        end: cython.Py_ssize_t = begin + count
                        waiting[end if end < n else end - n] = lowered
                        count += 1

    @cython.cfunc
    @cython.nogil
    def is_longer(self, d: cython.const[cython.double][::1], share: cython.double) -> cython.bint:
        """Whether a distance is longer than along an edge, by more than that share of it: mostly it is not."""
        for e in range(self.length.shape[0]):
            # Infinite at both ends gives nan, and false.
            is_steep: cython.bint = fabs(d[self.ends[e, 0]] - d[self.ends[e, 1]]) > self.length[e] * (1 + share)
            if is_steep and self.far_end(d, e, share) >= 0:
                return True
        return False

    @cython.cfunc
    def list_incident(self) -> cython.void:
        """List the edges by vertex, unless that is done."""
        with cython.critical_section(self):
            if self.incident.shape[0] > 0:
                return
            self.incident = np.empty(2 * self.ends.shape[0], np.int32)
            for e in range(self.ends.shape[0]):
                for c in range(2):
                    self.first[self.ends[e, c]] += 1
            for v in range(self.first.shape[0] - 1):
                self.first[v + 1] += self.first[v]
            # Now first[v] is where the edges of v end; filled from there back to where they begin.
            for e in range(self.ends.shape[0] - 1, -1, -1):
                for c in range(2):
                    self.first[self.ends[e, c]] -= 1
                    self.incident[self.first[self.ends[e, c]]] = e

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def lower(self, d: cython.double[::1], label: cython.longlong[::1], e: cython.Py_ssize_t) -> cython.int:
        """The end of edge e whose distance was lowered to the path along it; -1 if that is not shorter."""
        far: cython.int = self.far_end(d, e, 0.0)
        if far >= 0:
            near: cython.int = self.ends[e, 0] if self.ends[e, 1] == far else self.ends[e, 1]
            d[far] = d[near] + self.length[e]
            if label.shape[0] > 0:
                label[far] = label[near]
        return far

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def far_end(self, d: cython.const[cython.double][::1], e: cython.Py_ssize_t, share: cython.double) -> cython.int:
        """The end of edge e to which the path along it is shorter, by more than that share; -1 if there is none."""
        near: cython.int = self.ends[e, 0]
        far: cython.int = self.ends[e, 1]
        if d[far] < d[near]:
            near, far = far, near
        # Not by rounding, which would pass along many edges.
        return far if d[near] + self.length[e] * (1 + share) < d[far] * (1 - 1e-12) else -1


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
