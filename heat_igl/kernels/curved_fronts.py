"""Kernel of curved fronts: distance from known values on, with the direction in which the front passes each vertex.

A front that crosses a side comes to the far corner by the shortest way from the side. Between the ends of the side
distance is a parabola: the directions at the ends give the slopes, so the front is curved as it is.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.curved_fronts import Triangle
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.libc.math import INFINITY, M_PI, atan2, cos, fabs, sqrt

__all__ = ["advance"]

# A vertex that was passed is visited again if a later front is earlier there by this part of an edge.
_GAIN = cython.declare(cython.double, 1e-4)
# Steps of Newton's method to the shortest way from a side. The length is off by the square of the error of its place.
_STEPS = cython.declare(cython.int, 2)
# A front that converges on the far corner has no shortest way from the side. It counts as less curved, by this factor.
_CONVERGING = cython.declare(cython.double, 0.8)
# Visits per vertex after which the kernel gives up.
_MOST_VISITS = cython.declare(cython.int, 20)
# Distances are not below this, so that keys are finite.
_LEAST = cython.declare(cython.double, 1e-300)


def advance(
    triangle: cython.const[Triangle][::1],
    total: cython.const[cython.double][::1],
    first: cython.const[cython.int][::1],
    incident: cython.const[cython.int][::1],
    is_open: cython.const[cython.uchar][::1],
    d: cython.double[::1],
    back: cython.double[::1],
):
    """Fill in the distances of open vertices, from those of the others.

    Parameters
    ----------
    triangle : (m,) structures
        The `vertex` at each of three corners, counterclockwise; the `side` opposite; the directions of the sides to the
        next corner, `leaving`, and to the one before, `ending`, angles around the vertex, counterclockwise; and
        `double_area`, twice the area.
    total : (n,) float64
        Sum of the angles around each vertex; ``inf`` on the boundary.
    first, incident : (n + 1,) int32, (3 m,) int32
        The corners ``3 f + c`` at vertex v stand at ``first[v]`` to ``first[v + 1]`` of `incident`.
    is_open : (n,) uint8
        Which vertices are to be filled in. Nothing is read or written at vertices that are neither open nor in a
        triangle with an open one, so two threads may fill in two parts that no triangle joins.
    d : (n,) float64
        Distance, ``inf`` at open vertices; that is filled in, but for what no front reaches.
    back : (n,) float64
        The direction at each vertex in which the source lies; nan where it is not known. Filled in like `d`.

    Returns
    -------
    int
        Number of visits.
    """
    one = _CurvedFronts()
    one.triangle, one.total, one.first, one.incident = triangle, total, first, incident
    one.d, one.back = d, back
    one.is_open, one.is_passed = is_open, np.logical_not(is_open).view(np.uint8)
    one.came_from, one.foot = np.empty(d.shape[0], np.int32), np.empty(d.shape[0])
    one.queue = PriorityQueue(d.shape[0])
    with cython.nogil:
        one.run()
    return one.n_visits


@cython.final
@cython.cclass
class _CurvedFronts:
    """What is read and written, by triangle and by vertex. The vertices in the queue come in ascending order of `d`.

    `came_from` and `foot` are the corner of an open vertex that has its distance, and the place on the side opposite.
    """

    triangle: cython.const[Triangle][::1]
    total: cython.const[cython.double][::1]
    first: cython.const[cython.int][::1]
    incident: cython.const[cython.int][::1]
    d: cython.double[::1]
    back: cython.double[::1]
    is_open: cython.const[cython.uchar][::1]
    is_passed: cython.uchar[::1]
    came_from: cython.int[::1]
    foot: cython.double[::1]
    queue: PriorityQueue
    n_visits: cython.longlong

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def run(self) -> cython.void:
        """Visit the vertices beside open ones, and whatever a front reaches from there."""
        n: cython.Py_ssize_t = self.d.shape[0]
        v: cython.longlong
        k: cython.int
        f: cython.int
        c: cython.int
        for v in range(n):
            if self.is_open[v]:
                continue
            for k in range(self.first[v], self.first[v + 1]):
                f, c = self.incident[k] // 3, self.incident[k] % 3
                t = cython.address(self.triangle[f])
                if self.is_open[t.vertex[(c + 1) % 3]] or self.is_open[t.vertex[(c + 2) % 3]]:
                    self.queue.set_key(v, 1.0 / max(self.d[v], _LEAST))
                    break
        self.n_visits = 0
        while self.queue.count > 0 and self.n_visits < _MOST_VISITS * n:
            v = self.queue.first()
            self.queue.set_key(v, 0.0)
            self.is_passed[v] = True
            if self.is_open[v]:
                self.look_back(v)
            self.n_visits += 1
            if self.queue.count > 0:
                prefetch(cython.address(self.incident[self.first[self.queue.first()]]))
            # All at once, as each takes longer to come than to be read.
            for k in range(self.first[v], self.first[v + 1]):
                t = cython.address(self.triangle[self.incident[k] // 3])
                prefetch(t)
                prefetch(cython.address(t.double_area))
            for k in range(self.first[v], self.first[v + 1]):
                f, c = self.incident[k] // 3, self.incident[k] % 3
                self.arrive(f, (c + 1) % 3)
                self.arrive(f, (c + 2) % 3)

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def look_back(self, v: cython.longlong) -> cython.void:
        """Set the direction in which the source lies, once the distance of v is not likely to change."""
        c: cython.int = self.came_from[v] % 3
        t = cython.address(self.triangle[self.came_from[v] // 3])
        base: cython.double = t.side[c]
        along: cython.double = _along(base, t.side[(c + 2) % 3], t.side[(c + 1) % 3])
        foot: cython.double = self.foot[v]
        # From the side to the next corner to the foot.
        turn: cython.double = atan2(
            t.double_area * foot / base, t.side[(c + 2) % 3] * t.side[(c + 2) % 3] - along * foot
        )
        self.back[v] = t.leaving[c] + turn

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def arrive(self, f: cython.int, c: cython.int) -> cython.void:
        """Let corner c of triangle f have the front that has passed the other two, if it is the first."""
        t = cython.address(self.triangle[f])
        v: cython.int = t.vertex[c]
        if not self.is_open[v]:
            return
        i: cython.int = (c + 1) % 3
        j: cython.int = (c + 2) % 3
        a: cython.int = t.vertex[i]
        b: cython.int = t.vertex[j]
        da: cython.double = self.d[a] if self.is_passed[a] else INFINITY
        db: cython.double = self.d[b] if self.is_passed[b] else INFINITY
        best: cython.double = self.d[v]
        if not min(da, db) < best:
            return
        base: cython.double = t.side[c]
        to_a: cython.double = t.side[j]
        to_b: cython.double = t.side[i]
        if self.is_passed[v] and best <= max(da, db) and to_a * to_a + to_b * to_b > base * base:
            # Into an acute corner, a front comes after it has passed both other corners.
            return
        foot: cython.double = -1.0
        if da + to_a < best:
            best, foot = da + to_a, 0.0
        if db + to_b < best:
            best, foot = db + to_b, base
        if fabs(db - da) < base:
            # In the plane: a in the origin, b on the first axis, v above it.
            along: cython.double = _along(base, to_a, to_b)
            height: cython.double = t.double_area / base
            slope: cython.double = (db - da) / base
            bend: cython.double = self.bend(t, c)
            s: cython.double = _shortest(slope, bend, base, along, height)
            value: cython.double = da + s * slope + 0.5 * bend * s * (s - base)
            value += sqrt((s - along) * (s - along) + height * height)
            if 0.0 < s < base and value < best:
                best, foot = value, s
        if foot < 0.0 or (self.is_passed[v] and not best < self.d[v] - _GAIN * base):
            return
        self.is_passed[v] = False
        self.d[v] = best
        self.came_from[v], self.foot[v] = 3 * f + c, foot
        self.queue.set_key(v, 1.0 / max(best, _LEAST))

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def bend(self, t: cython.pointer[cython.const[Triangle]], c: cython.int) -> cython.double:
        """Second derivative of distance along the side opposite corner c; 0 if not known."""
        i: cython.int = (c + 1) % 3
        j: cython.int = (c + 2) % 3
        a: cython.int = t.vertex[i]
        b: cython.int = t.vertex[j]
        if self.back[a] != self.back[a] or self.back[b] != self.back[b]:
            return 0.0
        return -(self.slope(b, t.ending[j]) + self.slope(a, t.leaving[i])) / t.side[c]

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def slope(self, v: cython.int, side: cython.double) -> cython.double:
        """Derivative of distance from v along a side of the direction `side`.

        The angle to the source is measured on the side of the vertex on which it is less, as a front passes a cone on
        both sides. Where it is more than pi on both, the front comes from the vertex itself.
        """
        turn: cython.double = fabs(side - self.back[v])
        turn = min(turn, fabs(self.total[v] - turn))
        return -cos(min(turn, M_PI))


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _along(base: cython.double, to_start: cython.double, to_end: cython.double) -> cython.double:
    """How far from the start of the base the corner opposite lies along it, at these distances from both ends."""
    return 0.5 * ((to_start - to_end) * (to_start + to_end) / base + base)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _shortest(
    slope: cython.double, bend: cython.double, base: cython.double, along: cython.double, height: cython.double
) -> cython.double:
    """The place s on a side, from 0 to `base`, from which the way to the point (along, height) is the shortest.

    On the side, distance is slope s + bend s (s - base) / 2. The first guess is that of a straight front.
    """
    _: cython.int
    s: cython.double = min(max(along - height * slope / sqrt(1.0 - slope * slope), 0.0), base)
    for _ in range(_STEPS):
        x: cython.double = s - along
        r: cython.double = sqrt(x * x + height * height)
        curve: cython.double = height * height / (r * r * r)
        bent: cython.double = max(bend, -_CONVERGING * curve)
        s -= (slope + bend * (s - 0.5 * base) + x / r) / (bent + curve)
        s = min(max(s, 0.0), base)
    return s
