"""Updates over two simplices of one metric each: the least of T(y) + |y - x| + |x - v| over x on the facet between.

The path from y to x is in the simplex beyond the facet, that from x to v in the simplex of v. T(x), interpolated
between the corners of the facet, does not know of these paths:

- Where a front crosses the facet before others reach its corners, or runs along it, they are shorter. Then y is the
  corner opposite the facet beyond, and their lengths do not depend on T (`AdjacentUpdate.crossing`).
- Where different fronts reach the corners, T in between may be less than all paths to x are long. Every path to a side
  of a triangle comes through one of the two at the side. Where both say more than T(x), the side is called *joint*, and
  y is on the other sides of the triangle beyond from then on (`AdjacentUpdate.through`).
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.heat_igl.kernels.sweep.adjacent_updates import MOST_TURNS, NOT_FOUND, TOO_SHORT
from cython.cimports.heat_igl.kernels.sweep.facets import pair
from cython.cimports.heat_igl.kernels.sweep.simplex_updates import EQUAL, SimplexUpdate
from cython.cimports.libc.math import INFINITY, sqrt

from heat_igl.kernels.signals import raise_caught


@cython.final
@cython.cclass
class AdjacentUpdate:
    """Updates through facets, and which sides of triangles are joint; the arguments are those of `HopfLax`."""

    def __init__(self, update: SimplexUpdate, first, incident, mark):
        self.update, self.first, self.incident, self.mark, self.n_joint = update, first, incident, mark, 0
        # On an edge of a tetrahedron, paths end in all that are around it.
        n_sides = len(incident) if update.p == 2 and np.any(mark) else 0
        self.over, self.joint = np.full(n_sides, NOT_FOUND, np.int32), np.zeros(n_sides, np.uint8)

    def crossings(self, paths: cython.const[cython.int][:, ::1]):
        """The lengths (k,) of `crossing` for rows (k, 3): the corners opposite the facet, at the start, at the end."""
        found, unused = np.empty(len(paths)), np.zeros(len(self.update.V))
        size: cython.int = self.update.corners.shape[1]
        lengths: cython.double[::1] = found
        levels: cython.double[::1] = unused
        self.update.d = cython.address(levels[0])
        with cython.nogil:
            for k in range(lengths.shape[0]):
                if k % ASK == 0 and is_interrupted():
                    break
                s: cython.int = paths[k, 2] // size
                lengths[k] = self.crossing(paths[k, 0], paths[k, 1], self.update.corners[s, paths[k, 2] - s * size])
        raise_caught()
        return found

    def crossing(self, at, start, v):
        """The least |u - x| + |x - v| over the facet opposite the corner `at` of a simplex; sets `share`.

        v is a vertex of the simplex, u the corner `start` of the adjacent one. If one of them is on the facet, the path
        runs along it. It is inf if the path is no shorter than along an edge.
        """
        p: cython.int = self.update.p
        q: cython.int = self.update.q
        s: cython.int = at // (p + 1)
        other: cython.int = start // (p + 1)
        u: cython.int = start % (p + 1)
        own = cython.address(self.update.mean[s, 0])
        sq = cython.address(self.update.mean[other, 0])
        m = cython.address(self.update.product[0])
        D = cython.address(self.update.D[0])
        sag = cython.address(self.update.sag[0][0])
        side = cython.address(self.update.side[0])
        where: cython.int[3]
        near: cython.int = 0
        end: cython.int = 0
        along: cython.double = INFINITY
        falls: cython.bint = False
        while self.update.corners[s, end] != v:
            end += 1
        self.update.face(s, at % (p + 1))
        for i in range(p):
            where[i] = 0
            while self.update.corners[other, where[i]] != self.update.at[i]:
                where[i] += 1
            self.update.share[i], D[i] = 1.0 / p, sqrt(sq[pair(u, where[i])]) if u != where[i] else 0.0
            m[4 * i] = own[pair(end, side[i])] if end != side[i] else 0.0
            if D[i] + sqrt(m[4 * i]) < along:
                along, near = D[i] + sqrt(m[4 * i]), i
            for j in range(i):
                m[3 * i + j] = m[3 * j + i] = 0.5 * (m[4 * i] + m[4 * j] - own[pair(side[i], side[j])])
                # As T from u in the other metric, whose square is quadratic.
                sag[3 * i + j] = sag[3 * j + i] = sq[pair(where[i], where[j])] - (D[i] - D[j]) * (D[i] - D[j])
        # Lengths are convex: if they rise from a corner towards all others, none is less than there.
        to: cython.double = m[4 * near]
        for i in range(p):
            square: cython.double = sag[3 * near + i] + (D[i] - D[near]) * (D[i] - D[near])
            slope: cython.double = sqrt(square)
            if D[near] > 0.0:
                slope = 0.5 * ((D[i] - D[near]) * (D[i] + D[near]) - square) / D[near]
            slope += (m[3 * near + i] - to) / sqrt(to) if to > 0.0 else sqrt(m[4 * i])
            falls |= i != near and slope < 0.0
        if not falls:
            return INFINITY
        self.update.q = 1
        length: cython.double = self.update.newton(self.update.length(self.update.share), INFINITY) - self.update.start
        self.update.q = q
        return length if length < along * (1.0 - EQUAL) else INFINITY

    def joins(self, at, place, value):
        """Whether T is too small at a place on the side opposite corner `at` of a triangle, which then becomes joint.

        That is so if all paths to the place, through both triangles, make the `value` there longer by TOO_SHORT.
        """
        if self.joint.shape[0] == 0 or self.joint[at]:
            return False
        most: cython.double = value + TOO_SHORT * (value - self.update.start)
        self.update.face(at // 3, at % 3)
        for i in range(2):
            if self.update.level[i] + sqrt(self.update.mean[at // 3, pair(at % 3, self.update.side[i])]) <= most:
                return False
        over: cython.int = self.corner_over(at)
        other: cython.int = over // 3
        u: cython.int = over % 3
        if over < 0 or self.update.d[self.update.corners[other, u]] == INFINITY:
            return False
        a: cython.int = self.update.at[0]
        self.update.share[0], self.update.share[1], self.update.share[2] = 0.5, 0.5, 0.0
        for i in range(3 if over != at else 0):
            if i != u:
                t: cython.double = place[self.update.corners[other, 3 - u - i] != a]
                if self.over_side(at, i, t, t, most) < INFINITY:
                    return False
        self.joint[at] = True
        self.n_joint += 1
        return True

    def through(self, at):
        """The least T(y) + |y - x| + |x - v| for v = `at` opposite a joint side; sets `share`, `far` and `away`.

        Where there is no triangle beyond, x is a corner.
        """
        best: cython.double = INFINITY
        self.update.face(at // 3, at % 3)
        a: cython.int = self.update.at[0]
        for i in range(2):
            value: cython.double = self.update.level[i]
            value += sqrt(self.update.mean[at // 3, pair(at % 3, self.update.side[i])])
            if value <= best:
                best, self.near, self.common = value, 1.0, self.update.at[i]
        for i in range(3 if self.over[at] != at else 0):
            if i != self.over[at] % 3:
                self.update.share[0], self.update.share[1], self.update.share[2] = 0.5, 0.5, 0.0
                # A place at a corner but for rounding is this corner.
                best = min(best, self.over_side(at, i, 0.0, 1.0, best * (1.0 - 1e3 * EQUAL)))
        self.update.share[0] = self.near if self.common == a else 1.0 - self.near
        self.update.share[1] = 1.0 - self.update.share[0]
        return best

    def over_side(self, at, i, low, high, best):
        """The least T(y) + |y - x| + |x - v| over y opposite corner i of the triangle beyond, inf if not below `best`.

        The place x opposite the corner v = `at` has a share from `low` to `high` of the corner that it has in common
        with y, over which the sum is convex; y begins at `share`. Sets `near`, `common`, `far`, `away`. At one x, any
        value below `best` will do.
        """
        s: cython.int = at // 3
        other: cython.int = self.over[at] // 3
        u: cython.int = self.over[at] % 3
        end: cython.int = 3 - u - i
        own = cython.address(self.update.mean[s, 0])
        sq = cython.address(self.update.mean[other, 0])
        to = cython.address(self.update.corners[other, 0])
        m = cython.address(self.update.product[0])
        E = cython.address(self.update.E[0][0])
        found: cython.double = INFINITY
        limit: cython.double = best if low == high else INFINITY
        weight: cython.double = self.update.weight[self.update.corners[s, at % 3]]
        # The square of a side is the entry 2 less the corner opposite.
        one: cython.int = (at % 3 + 1 + (self.update.corners[s, (at + 1) % 3] != to[end])) % 3
        base: cython.double = own[2 - at % 3]
        to_one: cython.double = own[at % 3 + one - 1]
        to_two: cython.double = own[2 - one]
        nearest: cython.double = self.update.face(other, i)
        if self.update.level[0] + self.update.level[1] == INFINITY:
            return INFINITY
        for turn in range(MOST_TURNS if low < high else 1):
            t: cython.double = 0.5 * (low + high)
            rest: cython.double = 1.0 - t
            length: cython.double = sqrt(t * to_one + rest * to_two - t * rest * base)
            to_end: cython.double = rest * rest * sq[2 - u]
            to_u: cython.double = t * sq[2 - i] + rest * sq[2 - end] - t * rest * sq[2 - u]
            if nearest + sqrt(max(to_end, to_u)) + length <= limit < INFINITY:
                return nearest
            if turn == 0:
                # How far slopes are trusted does not depend on x, with which the triangle may be flat.
                self.update.lay(other, i)
                for j in range(2):
                    self.update.trust(other, j)
            for j in range(2):
                m[4 * j] = to_u if self.update.side[j] == u else to_end
                for k in range(3 if self.update.q > 1 else 0):
                    x: cython.double = t * self.update.V[to[end], k] + rest * self.update.V[to[i], k]
                    E[3 * j + k] = self.update.V[self.update.at[j], k] - x
            m[1] = m[3] = 0.5 * (to_end + to_u - sq[2 - i])
            value: cython.double = length + self.update.sagging(other, weight, limit - length, -INFINITY)
            if value < best:
                best, found, self.near, self.common, self.away = value, value, t, to[end], 3 * other + i
                self.far[0], self.far[1] = self.update.share[0], self.update.share[1]
            self.update.length(self.update.share)
            slope: cython.double = 0.5 * (to_one - to_two - (1.0 - 2.0 * t) * base) / length
            if slope - self.update.g[self.update.side[0] == u] / rest > 0.0:
                high = t
            else:
                low = t
        return found

    def corner_over(self, at):
        """The corner beyond the side opposite corner `at` of a triangle, after `face`; `at` itself on the boundary.

        It is -1 if the metric varies within one of the two triangles, or if more than two share the side.
        """
        if self.over[at] != NOT_FOUND:
            return self.over[at]
        over: cython.int = at
        v: cython.int = self.update.at[0]
        for k in range(self.first[v], self.first[v + 1]):
            s: cython.int = self.incident[k] // 3
            for i in range(3 if s != at // 3 else 0):
                if self.update.corners[s, i] == self.update.at[1]:
                    over = 3 * s + 3 - i - self.incident[k] % 3 if self.mark[s] != 0.0 and over == at else -1
        self.over[at] = over if self.mark[at // 3] != 0.0 else -1
        if self.over[at] >= 0:
            self.over[over] = at
        return self.over[at]
