"""Kernel of curved fronts: distance from known values on, with the direction in which the front passes each vertex.

A front that crosses a side comes to the far corner by the shortest way from the side. Between the ends of the side
distance is a parabola: the directions at the ends give the slopes, so the front is curved as it is.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.libc.math import INFINITY, M_PI, atan2, cos, fabs, sqrt

__all__ = ["advance"]

# A vertex that was passed is visited again if a later front is earlier there by this part of an edge.
_GAIN = cython.declare(cython.double, 1e-4)
# Steps of Newton's method to the shortest way from a side; the error is below 1e-8 edges after the second.
_STEPS = cython.declare(cython.int, 3)
# A front that converges on the far corner has no shortest way from the side. It counts as less curved, by this factor.
_CONVERGING = cython.declare(cython.double, 0.8)
# Visits per vertex after which the kernel gives up.
_MOST_VISITS = cython.declare(cython.int, 20)
# Distances are not below this, so that keys are finite.
_LEAST = cython.declare(cython.double, 1e-300)


def advance(
    F: cython.const[cython.int][:, ::1],
    lengths: cython.const[cython.double][:, ::1],
    leaving: cython.const[cython.double][:, ::1],
    total: cython.const[cython.double][::1],
    first: cython.const[cython.int][::1],
    incident: cython.const[cython.int][::1],
    d: cython.double[::1],
    back: cython.double[::1],
):
    """Fill in the distances that are not known, from those that are.

    Parameters
    ----------
    F, lengths : (m, 3) int32, (m, 3) float64
        Triangles, oriented alike, and the side opposite each corner.
    leaving : (m, 3) float64
        At each corner, the direction of the side to the next corner: an angle around the vertex, counterclockwise.
    total : (n,) float64
        Sum of the angles around each vertex; ``inf`` on the boundary.
    first, incident : (n + 1,) int32, (3 m,) int32
        The corners ``3 f + c`` at vertex v stand at ``first[v]`` to ``first[v + 1]`` of `incident`.
    d : (n,) float64
        Distance, ``inf`` where it is not known; that is filled in, but for what no front reaches.
    back : (n,) float64
        The direction at each vertex in which the source lies; nan where it is not known. Filled in like `d`.

    Returns
    -------
    int
        Number of visits.
    """
    one = _CurvedFronts()
    one.F, one.lengths, one.leaving, one.total = F, lengths, leaving, total
    one.first, one.incident, one.d, one.back = first, incident, d, back
    is_known = np.isfinite(d)
    one.is_known, one.is_passed = is_known.view(np.uint8), is_known.astype(np.uint8)
    one.queue = PriorityQueue(d.shape[0])
    with cython.nogil:
        one.run()
    return one.n_visits


@cython.final
@cython.cclass
class _CurvedFronts:
    """What is read and written, by triangle and by vertex. The vertices in the queue come in ascending order of `d`."""

    F: cython.const[cython.int][:, ::1]
    lengths: cython.const[cython.double][:, ::1]
    leaving: cython.const[cython.double][:, ::1]
    total: cython.const[cython.double][::1]
    first: cython.const[cython.int][::1]
    incident: cython.const[cython.int][::1]
    d: cython.double[::1]
    back: cython.double[::1]
    is_known: cython.const[cython.uchar][::1]
    is_passed: cython.uchar[::1]
    queue: PriorityQueue
    n_visits: cython.longlong

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def run(self) -> cython.void:
        """Visit the rim of what is known, and whatever a front reaches from there."""
        n: cython.Py_ssize_t = self.d.shape[0]
        v: cython.longlong
        k: cython.int
        f: cython.int
        c: cython.int
        for v in range(n):
            if not self.is_known[v]:
                continue
            for k in range(self.first[v], self.first[v + 1]):
                f, c = self.incident[k] // 3, self.incident[k] % 3
                if not (self.is_known[self.F[f, (c + 1) % 3]] and self.is_known[self.F[f, (c + 2) % 3]]):
                    self.queue.set_key(v, 1.0 / max(self.d[v], _LEAST))
                    break
        self.n_visits = 0
        while self.queue.count > 0 and self.n_visits < _MOST_VISITS * n:
            v = self.queue.first()
            self.queue.set_key(v, 0.0)
            self.is_passed[v] = True
            self.n_visits += 1
            for k in range(self.first[v], self.first[v + 1]):
                f, c = self.incident[k] // 3, self.incident[k] % 3
                self.arrive(f, (c + 1) % 3)
                self.arrive(f, (c + 2) % 3)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def arrive(self, f: cython.int, c: cython.int) -> cython.void:
        """Let corner c of triangle f have the front that has passed the other two, if it is the first."""
        v: cython.int = self.F[f, c]
        if self.is_known[v]:
            return
        i: cython.int = (c + 1) % 3
        j: cython.int = (c + 2) % 3
        a: cython.int = self.F[f, i]
        b: cython.int = self.F[f, j]
        da: cython.double = self.d[a] if self.is_passed[a] else INFINITY
        db: cython.double = self.d[b] if self.is_passed[b] else INFINITY
        best: cython.double = self.d[v]
        if not min(da, db) < best:
            return
        base: cython.double = self.lengths[f, c]
        to_a: cython.double = self.lengths[f, j]
        to_b: cython.double = self.lengths[f, i]
        # In the plane: a in the origin, b on the first axis, v above it.
        along: cython.double = 0.5 * ((to_a - to_b) * (to_a + to_b) / base + base)
        height: cython.double = sqrt(max(to_a * to_a - along * along, 0.0))
        foot: cython.double = -1.0
        if da + to_a < best:
            best, foot = da + to_a, 0.0
        if db + to_b < best:
            best, foot = db + to_b, base
        if fabs(db - da) < base:
            slope: cython.double = (db - da) / base
            bend: cython.double = self.bend(f, i, j, atan2(height, base - along))
            s: cython.double = _shortest(slope, bend, base, along, height)
            value: cython.double = da + s * slope + 0.5 * bend * s * (s - base)
            value += sqrt((s - along) * (s - along) + height * height)
            if 0.0 < s < base and value < best:
                best, foot = value, s
        if foot < 0.0 or (self.is_passed[v] and not best < self.d[v] - _GAIN * base):
            return
        self.is_passed[v] = False
        self.d[v] = best
        self.back[v] = self.leaving[f, c] + atan2(height * foot, along * (along - foot) + height * height)
        self.queue.set_key(v, 1.0 / max(best, _LEAST))

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def bend(self, f: cython.int, i: cython.int, j: cython.int, angle: cython.double) -> cython.double:
        """Second derivative of distance along the side from corner i to j, with `angle` at j; 0 if it is not known."""
        a: cython.int = self.F[f, i]
        b: cython.int = self.F[f, j]
        if self.back[a] != self.back[a] or self.back[b] != self.back[b]:
            return 0.0
        return -(self.slope(b, self.leaving[f, j] + angle) + self.slope(a, self.leaving[f, i])) / self.lengths[f, 3 - i - j]

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
def _shortest(
    slope: cython.double, bend: cython.double, base: cython.double, along: cython.double, height: cython.double
) -> cython.double:
    """The place s on a side, from 0 to `base`, from which the way to the point (along, height) is the shortest.

    On the side, distance is slope s + bend s (s - base) / 2. The first guess is that of a straight front.
    """
    k: cython.int
    s: cython.double = min(max(along - height * slope / sqrt(1.0 - slope * slope), 0.0), base)
    for k in range(_STEPS):
        x: cython.double = s - along
        r: cython.double = sqrt(x * x + height * height)
        curve: cython.double = height * height / (r * r * r)
        bent: cython.double = max(bend, -_CONVERGING * curve)
        s -= (slope + bend * (s - 0.5 * base) + x / r) / (bent + curve)
        s = min(max(s, 0.0), base)
    return s
