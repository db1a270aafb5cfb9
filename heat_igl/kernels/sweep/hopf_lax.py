"""Hopf-Lax scheme: distance in a metric that is given per triangle or tetrahedron.

The distance at a corner v of a simplex is the minimum of T(x) + |v - x| over the points x of the opposite facet. T is
the distance on the facet, interpolated between its corners, and |v - x| is the length in the metric of the simplex.

*First order*: T is linear. Then the update is monotone in the distances at the corners, and updates in any order have
one fixed point, which converges to the distance in a continuous metric (Bornemann and Rasch 2006).

*Second order*: T^2 is quadratic, which is exact for a point source in a constant metric. Its second differences along
the edges of the facet follow from the gradients of distance at the corners, and are limited where they contradict the
distances or the metric of the simplex.

Between two metrics, T(x) may differ from the paths to x through the adjacent simplex: `adjacent_updates` has these.

Initial distances are lengths of paths along edges. Vertices are updated in ascending order of distance, some of them
repeatedly, and then in Gauss-Seidel sweeps in a topological order of their dependencies. Each source is propagated
separately, since T is not smooth where the fronts of two sources meet.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.heat_igl.kernels.sweep.adjacent_updates import AdjacentUpdate
from cython.cimports.heat_igl.kernels.sweep.facets import pair, simplex_of
from cython.cimports.heat_igl.kernels.sweep.hopf_lax import CLOSE, RISEN, SETTLED
from cython.cimports.heat_igl.kernels.sweep.simplex_updates import EQUAL, SimplexUpdate, edge_length
from cython.cimports.libc.math import INFINITY, fabs, sqrt

from heat_igl.kernels.signals import raise_caught


@cython.final
@cython.cclass
class HopfLax:
    """Distances from one source at a time, by updates of vertices until nothing changes.

    Parameters
    ----------
    corners : (m, p + 1) int32
        Vertices of each simplex.
    first, incident : (n + 1,) int32, (m (p + 1),) int32
        ``incident[first[v] : first[v + 1]]`` are the corners ``simplex * (p + 1) + corner`` at vertex v.
    crossings : (n + 1,) int32, (k, 3) int32, (k,) float64, (m,) float32
        Paths to vertex v that cross a facet between two metrics, or run along it, are the rows ``crossings[0][v]`` to
        ``crossings[0][v + 1]``: the corner opposite the facet in the simplex of v, the corner and the vertex at which
        the path starts; their lengths; and the mark of each simplex.
    in_metric
        Further arguments of `SimplexUpdate`.
    """

    def __init__(self, corners, first, incident, crossings, *in_metric):
        self.corners, self.first, self.incident, n = corners, first, incident, len(first) - 1
        self.begin, self.ends, self.lengths, mark = crossings
        update = self.update = SimplexUpdate(corners, *in_metric)
        self.adjacent = AdjacentUpdate(update, first, incident, mark)
        self.waiting, self.reached, self.n_reached = PriorityQueue(n), np.zeros(n, np.int32), 0
        self.facet, self.pending, self.known = np.full(n, -1, np.int32), np.zeros(n), np.full(n, INFINITY)
        self.beyond = np.full(n, -1, np.int32)
        self.leads, self.label, self.d = np.zeros(n, np.uint8), np.full(n, -1, np.int32), np.full(n, INFINITY)
        self.changed = np.zeros(incident.shape[0], np.uint8)
        self.place, self.step, self.weight = np.zeros((n, 2 * update.p)), np.zeros(n), np.ones(n)
        self.risen, self.sum, self.n_visits = np.zeros(n), np.zeros(n), np.zeros(n, np.int32)
        self.asked, self.n_asked = np.full(n, -1, np.int64), 0
        update.slope, update.is_sloped, update.weight = np.zeros((n, 3)), np.zeros(n, np.uint8), self.weight
        update.trusted, update.trusted_in = np.zeros(n), np.full(n, -1, np.int32)
        self.order, self.stack, self.state = np.zeros(n, np.int32), np.zeros(4 * n, np.int32), np.zeros(n, np.uint8)

    def shorten(self, d: cython.double[::1], label: cython.int[::1]) -> None:
        """Lower distances `d` (n,) to shortest paths along edges, with their labels (n,), in place (Dijkstra 1959)."""
        self.d, self.label, self.limit, self.left, self.low = d, label, d, 0, np.min(d)
        with cython.nogil:
            # The length of an edge is evaluated only if a lower bound is below the difference of the distances.
            for s in range(self.corners.shape[0]):
                of = cython.address(self.corners[s, 0])
                sq = cython.address(self.update.mean[s, 0])
                least: cython.double = self.update.slack[s] * self.update.slack[s]
                for i in range(self.corners.shape[1]):
                    for j in range(i):
                        gap: cython.double = d[of[i]] - d[of[j]]
                        if gap * gap > least * sq[pair(i, j)]:
                            u: cython.int = of[j if gap > 0.0 else i]
                            if self.pending[u] == 0.0 and fabs(gap) > edge_length(self.update, s, i, j):
                                self.reach(u)
            self.march()
        raise_caught()

    def spread(self, source: cython.int, start: cython.double, limit: cython.double[::1], n: cython.int):
        """Compute second-order distances from one source, as far as it may be the nearest; `record` has the rest.

        Parameters
        ----------
        source, start : int, float
            The source vertex and its initial distance.
        limit : (n,) float64
            Upper bounds of the distance from all sources, ``inf`` where none is known.
        n : int
            Number of vertices in the component of the source.

        Returns
        -------
        vertices, distance : (k,) int32, (k,) float64
            The visited vertices, the source included, in ascending order, and their distances.
        """
        # In strongly anisotropic metrics, distances depend on larger ones: so these updates are limited.
        # With 1/2 to 2/3 of the vertices, few errors differ, those of coarse discs by up to 3 %. With 1/2, the largest
        # one in fibres 1 : 18 is 2.3 in place of 1.4 %.
        left: cython.Py_ssize_t = 4 * n // 7
        # Changes add up along a path.
        self.settled = SETTLED * n ** (-1.0 / self.update.p)
        self.limit, self.low, self.update.start = limit, start, start
        with cython.nogil:
            for at in range(self.n_reached):
                self.forget(self.reached[at])
        if self.adjacent.n_joint > 0:
            self.adjacent.joint[:], self.adjacent.n_joint = 0, 0
        self.n_reached, self.reached[0], self.d[source], self.known[source] = 1, source, start, start
        # A source that another one reaches before its initial distance is nowhere the nearest.
        if start <= limit[source]:
            self.wait(source)
        found, d = np.asarray(self.reached[:1]), np.asarray(self.d)
        while self.waiting.count > 0 and not is_interrupted():
            self.left = left
            with cython.nogil:
                self.march()
            left, self.left = self.left, 0
            found = np.sort(self.reached[: self.n_reached])
            # Ties are in the order of vertices.
            self.roots = found[np.argsort(d[found], kind="stable")]
            with cython.nogil:
                self.sharpen()
                # Vertices that are propagated from only now, after their distances have decreased.
                for at in range(self.roots.shape[0]):
                    self.lead_on(self.roots[at])
                # Those that have been too short since others became farther.
                for at in range(self.n_reached if self.waiting.count == 0 else 0):
                    if self.is_too_short(self.reached[at]):
                        self.pending[self.reached[at]] = INFINITY
                        self.wait(self.reached[at])
        raise_caught()
        return found, d[found]

    def record(self, v):
        """Dependencies and gradients of visited vertices v (k,) after `spread`.

        Returns
        -------
        facet, beyond, place : (k,) int32, (k,) int32, (k, 2 p) float64
            The corner ``simplex * (p + 1) + corner`` opposite the facet of the last update, or -1; the corner opposite
            a facet of the adjacent simplex if the path comes from there, else -1; and barycentric coordinates of the
            minimizers on both facets, 0 without the second.
        slope, is_sloped : (k, 3) float64, (k,) uint8
            The gradient of distance, and whether it is known.
        weight : (k,) float64
            The weight of the second order at each vertex: 1 for all of it, 0 for linear T.
        """
        update = self.update
        at = np.asarray(self.facet)[v], np.asarray(self.beyond)[v], np.asarray(self.place)[v]
        return *at, np.asarray(update.slope)[v], np.asarray(update.is_sloped)[v], np.asarray(self.weight)[v]

    def support(self, v: cython.int, i: cython.int) -> cython.int:
        """A vertex that the distance of v depends on: corner i of its facet, or of a facet beyond it."""
        size: cython.int = self.corners.shape[1]
        at: cython.int = self.beyond[v] if self.beyond[v] >= 0 else self.facet[v]
        s: cython.int = simplex_of(at, size)
        return self.corners[s, i if i < at - size * s else i + 1]

    def share(self, v: cython.int, i: cython.int) -> cython.double:
        """Barycentric coordinate of the minimizer of v at `support` i."""
        return self.place[v, i if self.beyond[v] < 0 else i + self.update.p]

    def above(self, v: cython.int, value: cython.double) -> cython.double:
        """`value` minus linear T at the minimizer of v."""
        for i in range(self.update.p):
            value -= self.share(v, i) * self.d[self.support(v, i)]
        return value

    def is_too_short(self, v: cython.int) -> cython.bint:
        """Whether T is too small at the minimizer of v on its facet, which then becomes joint."""
        at: cython.int = self.facet[v]
        self.update.d = cython.address(self.known[0])
        if at < 0 or self.beyond[v] >= 0 or not self.adjacent.joins(at, cython.address(self.place[v, 0]), self.d[v]):
            return False
        self.changed[at] = True
        return True

    def forget(self, v: cython.int) -> cython.void:
        """Reset v to a vertex that has not been reached."""
        self.d[v], self.known[v], self.facet[v], self.pending[v], self.leads[v] = INFINITY, INFINITY, -1, 0.0, 0
        self.weight[v], self.step[v], self.risen[v], self.n_visits[v] = 1.0, 0.0, 0.0, 0
        self.update.is_sloped[v], self.update.trusted_in[v], self.beyond[v] = 0, -1, -1
        for k in range(3):
            self.update.slope[v, k] = 0.0
        for k in range(self.place.shape[1]):
            self.place[v, k] = 0.0

    def march(self) -> cython.void:
        """Update vertices in ascending order of distance while updates are left, and propagate to their neighbours."""
        n_taken: cython.int = 0
        while self.waiting.count > 0:
            n_taken += 1
            if n_taken % ASK == 0 and is_interrupted():
                break
            v: cython.int = cython.cast(cython.int, self.waiting.first())
            self.waiting.set_key(v, 0.0)
            if self.pending[v] > 0.0 and self.left > 0:
                self.left -= self.facet[v] >= 0
                self.renew(v)
            self.lead_on(v)

    def lead_on(self, v: cython.int) -> cython.void:
        """Propagate to the neighbours of v once, unless another source is nearer to v by a margin.

        A shortest path stays in the Voronoi cell of its source, but may pass between vertices of other cells. At the
        distance R, the fronts of two sources one edge h apart differ in direction by h / R, and one edge beyond their
        bisector in distance by h^2 / R. h is the mean edge, as the longest one may belong to a sliver.
        """
        square: cython.double = 0.0
        excess: cython.double = self.d[v] - self.limit[v]
        if excess > 0.0:
            for k in range(self.first[v], self.first[v + 1]):
                for i in range(self.update.mean.shape[1]):
                    square += self.update.mean[self.incident[k] // self.corners.shape[1], i]
            square /= (self.first[v + 1] - self.first[v]) * self.update.mean.shape[1]
        if not self.leads[v] and (excess <= CLOSE * sqrt(square) or excess * (self.d[v] - self.low) <= square):
            self.leads[v] = 1
            self.reach(v)

    def reach(self, v: cython.int) -> cython.void:
        """Relax the edges from v to vertices that have not been updated."""
        size: cython.int = self.corners.shape[1]
        row: cython.int = -1
        for k in range(self.first[v], self.first[v + 1]):
            s: cython.int = simplex_of(self.incident[k], size)
            c: cython.int = self.incident[k] - size * s
            if self.update.q > 1 and self.update.rows[s, c] != row:
                row = self.update.rows[s, c]
                self.n_asked += 1
            for i in range(size):
                u: cython.int = self.corners[s, i]
                gap: cython.double = self.d[u] - self.d[v]
                if self.facet[u] < 0 and gap > 0.0:
                    # An edge with the same velocities at its ends has one length in all simplices: skip repetitions.
                    if self.update.q > 1:
                        ask: cython.longlong = self.n_asked * self.update.inverses.shape[0] + self.update.rows[s, i]
                        if self.asked[u] == ask:
                            continue
                        self.asked[u] = ask
                    least: cython.double = self.update.slack[s] * self.update.slack[s]
                    if gap * gap <= least * self.update.mean[s, pair(c, i)]:
                        continue
                    far: cython.double = self.d[v] + edge_length(self.update, s, c, i)
                    # Differences by rounding would propagate along many edges.
                    if far < self.d[u] * (1 - 1e-12):
                        if self.d[u] == INFINITY:
                            self.reached[self.n_reached] = u
                            self.n_reached += 1
                        self.d[u], self.label[u], self.pending[u] = far, self.label[v], INFINITY
                        self.wait(u)

    def wait(self, v: cython.int) -> cython.void:
        """Queue v by its distance."""
        self.waiting.set_key(v, 1.0 / (self.d[v] - self.low))

    def ask_again(self, v: cython.int) -> cython.void:
        """Queue v for another update if any are left, unless it oscillates: then it waits for the sweeps."""
        if self.left > 0 and self.risen[v] <= RISEN * (self.d[v] - self.low):
            self.wait(v)

    def sharpen(self) -> cython.void:
        """Gauss-Seidel sweeps in topological order, until no change exceeds its threshold."""
        is_settled: cython.bint = False
        for at in range(self.n_reached):
            self.risen[self.reached[at]] = 0.0
        while not is_settled and not is_interrupted():
            is_settled = True
            self.arrange()
            for at in range(self.n_reached):
                v = self.order[at]
                # Dependencies may be cyclic if the metric varies strongly within a simplex: the threshold grows with
                # each update of a vertex, so that the sweeps end.
                if self.pending[v] > self.settled * self.n_visits[v]:
                    is_settled = False
                    self.n_visits[v] += 1
                    self.renew(v)

    def renew(self, v: cython.int) -> cython.void:
        """Update v, and schedule the vertices that the change affects."""
        self.pending[v] = 0.0
        old: cython.double = self.d[v]
        change: cython.double = INFINITY if self.facet[v] < 0 else 0.0
        for k in range(3):
            self.turn[k] = self.update.slope[v, k]
        self.visit(v)
        while self.is_too_short(v):
            self.visit(v)
        span: cython.double = max(fabs(old - self.low), fabs(self.d[v] - self.low))
        change = max(change, fabs(self.d[v] - old) / span)
        for k in range(3):
            self.turn[k] = (self.update.slope[v, k] - self.turn[k]) / (8.0 * span)
        self.hand_on(v, old, change)

    def hand_on(self, v: cython.int, old: cython.double, change: cython.double) -> cython.void:
        """Schedule updates around v after its distance, formerly `old`, or its gradient has changed."""
        size: cython.int = self.corners.shape[1]
        at = cython.address(self.update.V[v, 0])
        x: cython.double = self.turn[0]
        y: cython.double = self.turn[1]
        z: cython.double = self.turn[2]
        is_new: cython.bint = change == INFINITY or self.d[v] < old
        for k in range(self.first[v], self.first[v + 1]):
            s: cython.int = simplex_of(self.incident[k], size)
            own: cython.int = self.incident[k] - size * s
            of = cython.address(self.corners[s, 0])
            most: cython.double = change
            # If the derivative along an edge changes by g at one end, T changes by g / 8 in the middle.
            for i in range(size - 1 if change < INFINITY else 0):
                u: cython.int = of[i + (i >= own)]
                to = cython.address(self.update.V[u, 0])
                most = max(most, fabs(x * (to[0] - at[0]) + y * (to[1] - at[1]) + z * (to[2] - at[2])))
            matters: cython.bint = most > self.settled
            # A facet with a corner that was not visited waits for that.
            is_open: cython.bint = False
            for i in range(size if matters else 0):
                is_open |= self.known[of[i]] == INFINITY
            # The vertex beyond a joint facet.
            over: cython.int = self.adjacent.over[self.incident[k]] if self.adjacent.n_joint > 0 and matters else -1
            if over >= 0 and self.adjacent.joint[over] and over != self.incident[k]:
                u = self.corners[over // 3, over % 3]
                self.pending[u], self.changed[over] = max(most, self.pending[u]), True
                self.ask_again(u)
            for i in range(size - 1 if most > 0.0 else 0):
                c: cython.int = i + (i >= own)
                u = of[c]
                if self.facet[u] < 0:
                    continue
                depends: cython.bint = simplex_of(self.facet[u], size) == s
                if not matters:
                    # No reason for a visit, but the next one finds another value there.
                    self.changed[s * size + c] |= depends
                # A vertex u that does not depend on v is affected only if the new state of v lowers it.
                elif (
                    most <= self.pending[u]
                    or depends
                    or (
                        not is_open
                        and (is_new or (most > change and self.d[v] < self.d[u]))
                        and self.through(s, c, self.d[u], own if self.d[v] >= self.d[u] else -1) < self.d[u]
                    )
                ):
                    self.pending[u], self.changed[s * size + c] = max(most, self.pending[u]), True
                    self.ask_again(u)
        for k in range(self.begin[v], self.begin[v + 1]):
            u = self.ends[k, 2]
            matters = self.d[v] + self.lengths[k] < self.d[u] * (1 - EQUAL)
            for i in range(size - 1 if self.beyond[u] >= 0 else 0):
                matters |= self.support(u, i) == v
            if self.facet[u] >= 0 and change > self.settled and matters:
                self.pending[u] = max(change, self.pending[u])
                self.ask_again(u)

    def through(self, s: cython.int, c: cython.int, best: cython.double, far: cython.int) -> cython.double:
        """`SimplexUpdate.through`, or `AdjacentUpdate.through` if the facet is joint."""
        self.adjacent.away = -1
        if self.adjacent.n_joint > 0 and self.adjacent.joint[3 * s + c]:
            return self.adjacent.through(3 * s + c)
        return self.update.through(s, c, best, far)

    def visit(self, v: cython.int) -> cython.void:
        """Update v: the minimum over its simplices, and the gradient at the minimizer.

        With linear T, the value increases only if distances at the last minimizer do. With second order it may also
        increase because gradients have changed, repeatedly; if this adds up, the weight of the second order is halved.
        Small oscillations before the sweeps may be due to vertices that have not settled: see `ask_again`.
        """
        size: cython.int = self.corners.shape[1]
        rise: cython.double = -INFINITY
        best: cython.double = INFINITY
        best_at: cython.int = -1
        beyond: cython.int = -1
        start: cython.int = -1
        kept: cython.double[5]
        # Facets without changes cannot be better, unless the facet of the last update has become worse.
        asks_all: cython.bint = True
        for k in range(self.begin[v], self.begin[v + 1]):
            value: cython.double = self.known[self.ends[k, 2]] + self.lengths[k]
            if value < best:
                best, best_at, start = value, self.ends[k, 0], self.ends[k, 1]
        # The facet of the last visit has the same value, if its corners have.
        is_same: cython.bint = self.facet[v] >= 0 and self.beyond[v] < 0 and not self.changed[self.facet[v]]
        for i in range(self.update.p if is_same else 0):
            is_same &= self.known[self.support(v, i)] < INFINITY
        if is_same:
            asks_all = False
            if self.d[v] + EQUAL * fabs(self.d[v]) < best:
                best, best_at, start = self.d[v], -1, -1
        elif self.facet[v] >= 0:
            rise = self.above(v, -self.step[v])
            asks_all = self.beyond[v] < 0 or best > self.d[v] * (1 + EQUAL)
        # First the facets whose corners have all been updated. Others, to be evaluated again, only if these raise v.
        for is_open in range(2):
            self.update.d = cython.address(self.d[0]) if is_open else cython.address(self.known[0])
            # The facet of the last update comes first, as its value bounds the search in the others.
            for k in range(self.first[v] - 1 + is_same, self.first[v + 1]):
                at: cython.int = self.facet[v] if k < self.first[v] else self.incident[k]
                if at < 0 or (k >= self.first[v] and (at == self.facet[v] or not (asks_all or self.changed[at]))):
                    continue
                s: cython.int = simplex_of(at, size)
                c: cython.int = at - size * s
                # After a path along the facet, v is one of its corners.
                if self.corners[s, c] != v:
                    continue
                has_open: cython.bint = not is_open
                for i in range(size if is_open else 0):
                    has_open |= i != c and self.known[self.corners[s, i]] == INFINITY
                if not has_open:
                    continue
                value = self.through(s, c, best, -1)
                self.changed[at] = False
                if k < self.first[v] and value < INFINITY and (self.beyond[v] < 0 or self.adjacent.away >= 0):
                    asks_all = value > self.d[v] * (1 + EQUAL)
                # Facets that share the minimizer have values equal to rounding: the first one is kept.
                if value + EQUAL * fabs(value) < best:
                    best, best_at, beyond, start = value, at, self.adjacent.away, -1
                    for i in range(size - 1):
                        kept[i] = self.update.share[i]
                    kept[3], kept[4] = self.adjacent.far[0], self.adjacent.far[1]
            if best < self.d[v] + EQUAL * fabs(best):
                break
        if best_at < 0:
            return
        self.risen[v] += max(rise + best, 0.0)
        most: cython.double = RISEN * (best - self.low)
        is_small: cython.bint = self.weight[v] == 1.0 and max(rise + best, fabs(best - self.d[v])) <= most
        if self.risen[v] > most and not (is_small and self.left > 0):
            self.risen[v] = 0.0
            self.weight[v] *= 0.5
            self.changed[best_at] = True
        s, c = best_at // size, best_at % size
        self.update.face(s, c)
        self.update.d = cython.address(self.known[0])
        for i in range(size - 1):
            self.update.share[i] = kept[i]
        end: cython.int = c
        for i in range(size):
            end = i if self.corners[s, i] == v else end
        if start >= 0:
            # On a facet beyond that has the start.
            self.adjacent.crossing(best_at, start, v)
            beyond = start + 1 if (start + 1) % size else start - 1
        for i in range(size - 1):
            self.place[v, i] = self.update.share[i]
            self.place[v, size - 1 + i] = 0.0 if beyond < 0 else kept[3 + i % 2]
            if start >= 0:
                self.place[v, size - 1 + i] = i + (i >= beyond % size) == start % size
        self.d[v], self.known[v], self.facet[v], self.beyond[v] = best, best, best_at, beyond
        self.step[v] = self.above(v, best)
        # For a path along the facet, the gradient is that of the update from the opposite facet.
        for i in range(size if end != c else 0):
            if i != end:
                k = i if i < c else i - 1
                value = self.place[v, end if end < c else end - 1]
                self.update.share[i if i < end else i - 1] = self.place[v, k] / (1.0 - value) if i != c else 0.0
        self.update.face(s, end)
        self.update.find_slope(s, end)

    def arrange(self) -> cython.void:
        """Sort vertices topologically by a depth-first search: each after those it depends on, except in cycles.

        The step of a vertex is its distance minus linear T at the minimizer; with second order it may be negative. If
        the steps of a cycle sum to less than 0, its vertices would lower each other forever: `open_circle` prevents it.

        Ties are resolved by distance, so that the order does not depend on the numbers of vertices and corners.
        """
        size: cython.int = self.corners.shape[1]
        n_done: cython.int = 0
        so_far: cython.double = 0.0
        for at in range(self.n_reached):
            self.state[self.roots[at]] = 0
        for at in range(self.n_reached):
            n_open: cython.int = 1
            self.stack[0] = self.roots[at]
            while n_open > 0:
                v = self.stack[n_open - 1]
                if self.state[v] == 0 and self.facet[v] >= 0:
                    self.state[v] = 1
                    so_far += self.step[v]
                    self.sum[v] = so_far
                    for k in range(size - 1):
                        if self.share(v, k) > 0.0:
                            u: cython.int = self.support(v, k)
                            if self.state[u] == 0:
                                i: cython.int = n_open
                                while self.stack[i - 1] != v and self.d[self.stack[i - 1]] < self.d[u]:
                                    self.stack[i] = self.stack[i - 1]
                                    i -= 1
                                self.stack[i] = u
                                n_open += 1
                            elif self.state[u] == 1 and self.sum[v] - self.sum[u] + self.step[u] < 0.0:
                                self.open_circle(u, n_open)
                    continue
                n_open -= 1
                if self.state[v] == 1:
                    so_far = self.sum[v] - self.step[v]
                if self.state[v] < 2:
                    self.state[v] = 2
                    self.order[n_done] = v
                    n_done += 1

    def open_circle(self, u: cython.int, n_open: cython.int) -> cython.void:
        """Halve the weight of the second order at negative steps in a cycle: open vertices down to u on the stack."""
        w: cython.int = -1
        while w != u:
            n_open -= 1
            w = self.stack[n_open]
            if self.state[w] == 1 and self.step[w] < 0.0:
                self.weight[w] *= 0.5
                self.pending[w], self.changed[self.facet[w]] = INFINITY, True
