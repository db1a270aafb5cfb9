"""Kernel of distance in any metric: the Hopf-Lax formula on each triangle or tetrahedron.

The distance at a corner v of a simplex is the least of T(x) + |v - x| over the points x of the facet opposite, with T
the distance on the facet between its corners, and the length of v - x in the metric of the simplex.

*First order*: T is linear. Then the update is monotone in the distances at the corners, so that updates in any order
lead to one fixed point, which converges to the distance in a continuous metric (Bornemann and Rasch 2006).

*Second order*: the square of T is quadratic, as the squared distance from a point in one metric is, at the source too.
Its second differences along the edges of the facet are found from the slopes of distance at the corners, and are used
as far as these agree with the distances, and with the metric of the simplex.

Distances begin with those along edges, and are updated in rounds, each vertex after those it has its distance from.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.heat_igl.kernels.sweep.dependencies import Dependencies
from cython.cimports.heat_igl.kernels.sweep.hopf_lax import RISEN, SETTLED
from cython.cimports.heat_igl.kernels.sweep.simplex_updates import EQUAL, SimplexUpdate
from cython.cimports.libc.math import INFINITY, fabs

from heat_igl.kernels.signals import raise_caught


@cython.final
@cython.cclass
class HopfLax:
    """Rounds of visits to vertices, each through its simplices.

    Parameters
    ----------
    corners : (m, p + 1) int32
        Vertices of each simplex.
    first, incident : (n + 1,) int32, (m (p + 1),) int32
        Corners ``simplex * (p + 1) + corner`` that meet in vertex v, at ``first[v]`` to ``first[v + 1]`` of `incident`.
    in_metric
        What else `SimplexUpdate` takes of the simplices.
    """

    def __init__(self, corners, first, incident, *in_metric):
        self.corners, self.first, self.incident = corners, first, incident
        self.update = SimplexUpdate(corners, *in_metric)

    def settle(self, d, label, offset):
        """Change distances along edges to those of second order, in place.

        Parameters
        ----------
        d, label : (n,) float64, (n,) int32
            Distances along edges, and the source of each, -1 for none; changed.
        offset : (k,) float64
            Of each source.

        Returns
        -------
        facet : (n,) int32
            The corner ``simplex * (p + 1) + corner`` opposite the facet that gave each vertex its distance, or -1.
        place : (n, p) float64
            The shares of the other corners, in their order, at the best place on that facet.
        slope, is_sloped : (n, 3) float64, (n,) uint8
            The derivative of distance by the position of each vertex, and whether it is known.
        weight : (n,) float64
            How far T is of second order for a vertex: from 1 to 0, where T is linear.
        """
        n, update = len(d), self.update
        facet, place, weight = np.full(n, -1, np.int32), np.zeros((n, update.p)), np.ones(n)
        slope, is_sloped = np.zeros((n, 3)), np.zeros(n, np.uint8)
        # Nearer than a source to itself is another one.
        fixed = d == np.append(offset, np.inf)[label]
        step, pending = np.zeros(n), np.where(np.isfinite(d) & ~fixed, np.inf, 0.0)
        self.d, self.label, self.low, self.pending = d, label, np.min(d), pending
        self.facet, self.place, self.step, self.weight = facet, place, step, weight
        self.risen, self.n_visits = np.zeros(n), np.zeros(n, np.int32)
        self.fixed, self.waiting = fixed.view(np.uint8), PriorityQueue(n)
        update.d, update.label, update.low, update.offset = d, label, self.low, offset
        update.slope, update.is_sloped, update.weight = slope, is_sloped, weight
        self.dependencies = Dependencies(self.corners, facet, place, step, weight, pending)
        # Changes add up along a path.
        self.settled = SETTLED * n ** (-1.0 / update.p)
        with cython.nogil:
            self.sharpen()
        raise_caught()
        return facet, place, slope, is_sloped, weight

    def sharpen(self) -> cython.void:
        """Second order, from near to far, then in rounds: each vertex after those it has its distance from.

        From near to far, changes are handed on before others depend on them. Where metrics are long in one direction,
        distances depend on larger ones: after two visits per vertex that order is given up.
        """
        v: cython.int
        is_settled: cython.bint = False
        for v in range(self.d.shape[0]):
            if self.pending[v] > 0.0:
                self.waiting.set_key(v, 1.0 / (self.d[v] - self.low))
        self.left = 2 * self.d.shape[0]
        while self.waiting.count > 0 and self.left > 0:
            if self.left % ASK == 0 and is_interrupted():
                return
            self.left -= 1
            v = cython.cast(cython.int, self.waiting.first())
            self.waiting.set_key(v, 0.0)
            self.renew(v)
        self.left = 0
        while not is_settled and not is_interrupted():
            is_settled = True
            self.dependencies.arrange()
            for at in range(self.d.shape[0]):
                v = self.dependencies.order[at]
                # Where the metric turns far within a simplex, distances may go in circles: more so each time.
                if self.pending[v] > self.settled * self.n_visits[v]:
                    is_settled = False
                    self.n_visits[v] += 1
                    self.renew(v)

    def renew(self, v: cython.int) -> cython.void:
        """Visit v, and hand on what has changed."""
        self.pending[v] = 0.0
        old: cython.double = self.d[v]
        change: cython.double = 0.0 if self.update.is_sloped[v] else INFINITY
        for k in range(3):
            self.turn[k] = self.update.slope[v, k]
        self.visit(v)
        span: cython.double = max(fabs(old - self.low), fabs(self.d[v] - self.low))
        change = max(change, fabs(self.d[v] - old) / span)
        for k in range(3):
            self.turn[k] = (self.update.slope[v, k] - self.turn[k]) / (8.0 * span)
        self.hand_on(v, old, change)

    def hand_on(self, v: cython.int, old: cython.double, change: cython.double) -> cython.void:
        """Ask for visits to the vertices around v, whose value was `old`, by how much it and the slope changed."""
        size: cython.int = self.corners.shape[1]
        for k in range(self.first[v], self.first[v + 1]):
            s: cython.int = self.incident[k] // size
            most: cython.double = change
            # T changes by an eighth, in the middle of an edge, of how far a slope changes along it.
            for c in range(size):
                u: cython.int = self.corners[s, c]
                by: cython.double = 0.0
                for i in range(3):
                    by += self.turn[i] * (self.update.V[u, i] - self.update.V[v, i])
                most = max(most, fabs(by))
            for c in range(size):
                u = self.corners[s, c]
                if u == v or self.fixed[u] or not most > max(self.settled, self.pending[u]):
                    continue
                # Farther away, v matters to u if it now has a slope or is nearer, and u gains by that.
                if (
                    self.d[v] < self.d[u]
                    or self.facet[u] // size == s
                    or ((change == INFINITY or self.d[v] < old) and self.update.through(s, c, self.d[u]) < self.d[u])
                ):
                    self.pending[u] = most
                    if self.left > 0:
                        self.waiting.set_key(u, 1.0 / (self.d[u] - self.low))

    def visit(self, v: cython.int) -> cython.void:
        """Give v the least value over its simplices, and the slope that goes with it.

        With T linear it is at most that at the last place, so that it never rises but with the distances there. By the
        second order it may, since the slopes there changed, and rise again and again. What it rises so is summed.
        """
        size: cython.int = self.corners.shape[1]
        rise: cython.double = -INFINITY
        best: cython.double = INFINITY
        best_at: cython.int = -1
        kept: cython.double[3]
        # The facet of the last visit first: it rules out most of the others.
        for k in range(self.first[v] - 1, self.first[v + 1]):
            at: cython.int = self.facet[v] if k < self.first[v] else self.incident[k]
            if at < 0 or (at == self.facet[v] and k >= self.first[v]):
                continue
            s: cython.int = at // size
            c: cython.int = at % size
            value: cython.double = self.update.through(s, c, best)
            if k < self.first[v]:
                rise = -self.step[v]
                for i in range(size - 1):
                    rise -= self.place[v, i] * self.update.level[i]
            # Facets that share the best place have equal values but for rounding: the first one stays.
            if value + EQUAL * fabs(value) < best:
                best, best_at = value, at
                for i in range(size - 1):
                    kept[i] = self.update.share[i]
        if best_at < 0:
            return
        self.risen[v] += max(rise + best, 0.0)
        if self.risen[v] > RISEN * (best - self.low):
            self.risen[v] = 0.0
            self.weight[v] *= 0.5
        s, c = best_at // size, best_at % size
        self.update.face(s, c)
        self.d[v], self.facet[v], self.step[v] = best, best_at, best
        most: cython.int = 0
        for i in range(size - 1):
            self.update.share[i] = self.place[v, i] = kept[i]
            self.step[v] -= kept[i] * self.update.level[i]
            if kept[i] > kept[most]:
                most = i
        self.label[v] = self.label[self.corners[s, self.update.side[most]]]
        self.update.find_slope(s, c)
