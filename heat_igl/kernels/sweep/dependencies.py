"""Which vertices have their distances from which: a topological order, and circles that fall for ever."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY


@cython.final
@cython.cclass
class Dependencies:
    """A vertex depends on the corners of its facet that have a share of its place; arrays are those of `HopfLax`."""

    def __init__(self, corners, facet, place, step, weight, pending):
        self.corners, self.facet, self.place, self.step = corners, facet, place, step
        self.weight, self.pending, n = weight, pending, len(facet)
        self.order, self.stack, self.state = np.zeros(n, np.int32), np.zeros(4 * n, np.int32), np.zeros(n, np.uint8)
        self.sum = np.zeros(n)

    def arrange(self) -> cython.void:
        """Order vertices topologically: each behind the corners that it has its distance from, but for circles.

        Vertices of a circle have their distances from each other. What each adds to T linear, the step, may be less
        than 0 by the second order. If it sums to less than 0 around a circle, its vertices lower each other for ever.
        """
        v: cython.int
        size: cython.int = self.corners.shape[1]
        n_done: cython.int = 0
        so_far: cython.double = 0.0
        self.state[:] = 0
        for root in range(self.order.shape[0]):
            n_open: cython.int = 1
            self.stack[0] = root
            while n_open > 0:
                v = self.stack[n_open - 1]
                if self.state[v] == 0 and self.facet[v] >= 0:
                    self.state[v] = 1
                    so_far += self.step[v]
                    self.sum[v] = so_far
                    k: cython.int = 0
                    for c in range(size):
                        if c == self.facet[v] % size:
                            continue
                        u: cython.int = self.corners[self.facet[v] // size, c]
                        if self.place[v, k] > 0.0:
                            if self.state[u] == 0:
                                self.stack[n_open] = u
                                n_open += 1
                            elif self.state[u] == 1 and self.sum[v] - self.sum[u] + self.step[u] < 0.0:
                                self.open_circle(u, n_open)
                        k += 1
                    continue
                n_open -= 1
                if self.state[v] == 1:
                    so_far = self.sum[v] - self.step[v]
                if self.state[v] < 2:
                    self.state[v] = 2
                    self.order[n_done] = v
                    n_done += 1

    def open_circle(self, u: cython.int, n_open: cython.int) -> cython.void:
        """Halve the second order of vertices that depend on u and on which u depends: those open above it."""
        w: cython.int = -1
        while w != u:
            n_open -= 1
            w = self.stack[n_open]
            if self.state[w] == 1:
                self.weight[w] *= 0.5
                self.pending[w] = INFINITY
