"""Kernel of sight: vertices of tetrahedra that see a source which the vertices before them do not belong to."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.rays import GAIN, NUDGE, Body, Line, Ray
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.libc.math import INFINITY, fabs

from heat_igl.kernels.signals import raise_caught

# Sources that a vertex looks for each time, the nearest first, and passes over the vertices that wait.
_MOST_LOOKS = cython.declare(cython.int, 4)
_MOST_PASSES = cython.declare(cython.int, 100)


def look_around(
    order: cython.const[cython.int][::1],
    body: Body,
    sources: cython.const[cython.int][::1],
    offset: cython.const[cython.double][::1],
    edges: cython.const[cython.int][:, ::1],
    guess: cython.int[:, ::1],
    d: cython.double[::1],
    label: cython.int[::1],
):
    """Lower `d` (n,) to straight lines from the sources of neighbours, as far as these lines stay inside.

    Where the cell of a source is narrow, the tetrahedra through which a line comes in may have all their corners in
    other cells. Candidates are then the sources of all vertices around (Danielsson 1980, there for pixels), and a line
    is followed through the tetrahedra.

    All vertices are in `order` (n,), roughly from near to far. Source i of k is at vertex ``sources[i]``, and distance
    begins there at ``offset[i]``. Ways bend around the `edges` (e, 2); not all tetrahedra at a source there see the
    same. A vertex looks first for the sources `guess` (n, k), nearest first, unless they are -1. `label` (n,) is the
    source of each; with `d` and `guess` it is changed.
    """
    n = order.shape[0]
    one = Sight(body, sources, offset, d, label)
    one.turns, one.is_concave, one.guess = np.isin(sources, edges).astype(np.uint8), edges.shape[0] > 0, guess
    one.lit = np.full(n, -1, np.int32)
    np.asarray(one.lit)[np.asarray(sources)] = np.arange(sources.shape[0])
    cells = round(2 * float(np.cbrt(n)))
    one.open, one.knows_walls = np.full((6, cells, cells), np.inf), sources.shape[0] == 1 or not one.is_concave
    is_waiting: cython.uchar[::1] = np.ones(n, np.uint8)
    one.is_waiting = is_waiting
    with cython.nogil:
        for i in range(edges.shape[0] if one.knows_walls else 0):
            one.is_clear(edges[i, 0], edges[i, 1], True)
        for _passes in range(_MOST_PASSES):
            n_changed: cython.Py_ssize_t = 0
            for i in range(n):
                if i % ASK == 0 and is_interrupted():
                    n_changed = 0
                    break
                if is_waiting[order[i]]:
                    is_waiting[order[i]] = False
                    n_changed += one.look(order[i])
            if n_changed == 0:
                break
    raise_caught()


@cython.final
@cython.cclass
class Sight(Ray):
    """What is read and written, the source that is looked for, the line to it, and `lit` (n,), the source on a line.

    If a neighbour sees the source, a vertex does, too, unless an edge around which ways bend lies between the two
    lines: a wall that hides only one of them ends at such an edge. The only source sees these edges through the cells
    on the sides of a cube around it, which are `open` (6, c, c) up to a depth; there are twice as many along a side as
    there would be vertices along that of a cube. With these cells, or without such edges, it `knows_walls`.
    """

    def is_clear(self, a, b, hides):
        """Whether no edge hides the line between two vertices from the only source; if it `hides`, it closes cells."""
        centre: cython.pointer[cython.const[cython.double]] = cython.address(self.body.positions[self.sources[0], 0])
        cells: cython.int = self.open.shape[1]
        x: cython.double[6]
        part: cython.double[2]
        low: cython.int[2]
        high: cython.int[2]
        for side in range(6):
            up: cython.int = side >> 1
            for c in range(2):
                at: cython.pointer[cython.const[cython.double]] = cython.address(self.body.positions[b if c else a, 0])
                for i in range(3):
                    x[3 * c + i] = at[(up + i) % 3] - centre[(up + i) % 3]
                x[3 * c] = x[3 * c] if side & 1 else -x[3 * c]
            # The part of the line that is seen through this side, which is never farther off the axis than along it.
            part[0], part[1] = 0.0, 1.0
            slack: cython.double = GAIN * (fabs(x[0]) + fabs(x[3]))
            for k in range(4):
                sign: cython.double = 1 - 2 * (k & 1)
                first: cython.double = x[0] + sign * x[1 + (k >> 1)] + slack
                last: cython.double = x[3] + sign * x[4 + (k >> 1)] + slack
                if first < 0:
                    part[0] = max(part[0], first / (first - last) if last >= 0 else 2.0)
                elif last < 0:
                    part[1] = min(part[1], first / (first - last))
            if part[0] > part[1]:
                continue
            low[0] = low[1] = cells
            high[0] = high[1] = -1
            for c in range(2):
                depth: cython.double = x[0] + part[c] * (x[3] - x[0])
                # The source itself is seen in no direction.
                for i in range(2 if depth > slack else 0):
                    place: cython.double = (x[1 + i] + part[c] * (x[4 + i] - x[1 + i])) / depth
                    place = max(0.5 * cells * (place + 1), 0.0)
                    low[i] = min(low[i], cython.cast(cython.int, place * (1 - GAIN)))
                    high[i] = max(high[i], min(cython.cast(cython.int, place * (1 + GAIN)), cells - 1))
            for i in range(low[0], high[0] + 1):
                for j in range(low[1], high[1] + 1):
                    if hides:
                        self.open[side, i, j] = min(self.open[side, i, j], x[0], x[3])
                    elif self.open[side, i, j] <= max(x[0], x[3]) * (1 + GAIN):
                        return False
        return True

    def look(self, v):
        """Give v the shortest line from a source of its neighbours that stays inside; returns whether there is one."""
        below: cython.double = self.d[v] * (1 - GAIN)
        looks: cython.int = _MOST_LOOKS
        for i in range(self.guess.shape[1] if self.guess[v, 0] >= 0 else 0):
            nearest: cython.int = self.guess[v, i]
            # There is no other.
            if self.sources.shape[0] == 1:
                looks = 0
            if nearest < 0 or not self.line(v, nearest) < below:
                break
            if self.sees_source(v, nearest):
                self.guess[v, 0] = -1
                self.take(v, nearest)
                return True
        self.guess[v, 0] = -1
        above: cython.double = -INFINITY
        for _looks in range(looks):
            nearest = self.nearest_around(v, v, above, below, -1)
            if self.label[v] >= 0:
                # On a boundary of sources the nearest one may be a neighbour of the one that was found.
                nearest = self.nearest_around(self.sources[self.label[v]], v, above, below, nearest)
            if nearest < 0:
                return False
            if self.sees_source(v, nearest):
                self.take(v, nearest)
                return True
            above = self.line(v, nearest)
        return False

    def take(self, v, label):
        """Give v the straight line from a source, and wake those around it that may have use for this source."""
        self.d[v], self.label[v] = self.line(v, label), label
        self.lit[v] = label
        for k in range(self.body.first_neighbour[v], self.body.first_neighbour[v + 1]):
            u: cython.int = self.body.neighbours[k]
            if self.lit[u] != label:
                self.is_waiting[u] = True

    def nearest_around(self, centre, v, above, below, nearest):
        """Of the labels around a vertex the one with the shortest line to v between two bounds, or `nearest`."""
        if nearest >= 0:
            below = self.line(v, nearest)
        before: cython.int = nearest
        for k in range(self.body.first_neighbour[centre] - 1, self.body.first_neighbour[centre + 1]):
            at_centre: cython.bint = k < self.body.first_neighbour[centre]
            label: cython.int = self.label[centre if at_centre else self.body.neighbours[k]]
            if label >= 0 and label != before:
                before = label
                value: cython.double = self.line(v, label)
                if above < value < below:
                    below, nearest = value, label
        return nearest

    def line(self, v, label):
        """The value at v along the straight line from a source."""
        return self.offset[label] + self.body.apart(v, self.sources[label])

    def sees_source(self, v, label):
        """Whether the straight line from v to a source stays in the tetrahedra."""
        source: cython.int = self.sources[label]
        if self.body.first[v] == self.body.first[v + 1] or self.body.first[source] == self.body.first[source + 1]:
            return False
        line: cython.pointer[Line] = cython.address(self.to_source)
        line.goal, line.goal_a, line.goal_b = cython.address(self.body.positions[source, 0]), source, source
        self.sought = label
        for k in range(self.body.first_neighbour[v], self.body.first_neighbour[v + 1] if self.knows_walls else 0):
            u: cython.int = self.body.neighbours[k]
            if self.lit[u] == label and (not self.is_concave or self.is_clear(u, v, False)):
                return True
        return self.follows(line, v)

    def arrives_from(self, line, begin):
        """As `Ray.arrives_from`; a line that touches a wall is moved to all sides, one of which is inside."""
        into: cython.int = self.body.incident[self.body.first[self.sources[self.sought]]] // 4
        if self.turns[self.sought]:
            into = -1
        room: cython.double = self.body.reach[self.body.cells[begin >> 2, begin & 3]]
        room = 2 * NUDGE * (room + self.body.reach[self.sources[self.sought]])
        for toward in range(-1, 4 if self.is_concave else 0):
            if toward == begin % 4:
                continue
            found: cython.int = self.arrives(line, begin, into, toward)
            if found > 0 or (found == -1 and self.is_blocked(line, room)):
                return found > 0
            into = -1
        return False
