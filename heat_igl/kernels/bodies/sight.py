"""Kernel of sight: vertices of tetrahedra that see a source which the vertices before them do not belong to."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.bodies import Body
from cython.cimports.heat_igl.kernels.bodies.lines import STRAIGHT_LINE, straight
from cython.cimports.heat_igl.kernels.bodies.rays import MOST_STEPS, NUDGE, Ray
from cython.cimports.heat_igl.kernels.bodies.sight import GAIN, MOST_LOOKS, MOST_PASSES
from cython.cimports.libc.math import INFINITY


def look_around(
    order: cython.const[cython.int][::1],
    body: Body,
    sources: cython.const[cython.int][::1],
    offset: cython.const[cython.double][::1],
    turns: cython.const[cython.uchar][::1],
    is_concave: cython.bint,
    guess: cython.int[::1],
    d: cython.double[::1],
    begin: cython.double[::1],
    label: cython.int[::1],
):
    """Lower `d` (n,) to straight lines from the sources of neighbours, as far as these lines stay inside.

    Each vertex first looks for a given source, if any.

    Where the cell of a source is narrow, the tetrahedra through which a line comes in may have all their corners in
    other cells. Candidates are then the sources of all vertices around (Danielsson 1980, there for pixels), and a line
    is followed through the tetrahedra.

    Parameters
    ----------
    order : (n,) int32
        All vertices, roughly from near to far.
    body : Body
        Tetrahedra.
    sources, offset : (k,) int32, (k,) float64
        Vertex of each source, and the value at which distance begins there.
    turns : (k,) uint8
        Whether ways bend at the source, so that not all tetrahedra there see the same.
    is_concave : bool
        Whether ways bend anywhere.
    guess : (n,) int32
        A source that each vertex looks for first, or -1; changed.
    d, begin, label : (n,) float64, (n,) float64, (n,) int32
        Distances, the value at which the front that arrives seems to begin, and the source of each; changed.
    """
    n = order.shape[0]
    one = _Sight()
    one.corners, one.first, one.incident, one.positions = body.corners, body.first, body.incident, body.positions
    one.first_neighbour, one.neighbours, one.ray = body.first_neighbour, body.neighbours, Ray(body)
    one.sources, one.offset, one.turns, one.guess = sources, offset, turns, guess
    one.is_concave = is_concave
    one.d, one.begin, one.label = d, begin, label
    is_waiting: cython.uchar[::1] = np.ones(n, np.uint8)
    one.is_waiting = is_waiting
    with cython.nogil:
        for _passes in range(MOST_PASSES):
            n_changed: cython.Py_ssize_t = 0
            for i in range(n):
                if is_waiting[order[i]]:
                    is_waiting[order[i]] = False
                    n_changed += one.look(order[i])
            if n_changed == 0:
                break


@cython.final
@cython.cclass
class _Sight:
    """What is read and written, and the line that is followed."""

    corners: cython.const[cython.int][:, ::1]
    first: cython.const[cython.int][::1]
    incident: cython.const[cython.int][::1]
    positions: cython.const[cython.double][:, ::1]
    first_neighbour: cython.const[cython.int][::1]
    neighbours: cython.const[cython.int][::1]
    sources: cython.const[cython.int][::1]
    offset: cython.const[cython.double][::1]
    turns: cython.const[cython.uchar][::1]
    is_concave: cython.bint
    guess: cython.int[::1]
    d: cython.double[::1]
    begin: cython.double[::1]
    label: cython.int[::1]
    is_waiting: cython.uchar[::1]
    ray: Ray

    @cython.cfunc
    @cython.nogil
    def look(self, v: cython.int) -> cython.int:
        """Give v the shortest line from a source of its neighbours that stays inside; returns whether there is one."""
        below: cython.double = self.d[v]
        if below < INFINITY:
            below -= GAIN * (below - self.begin[v])
        looks: cython.int = MOST_LOOKS
        nearest: cython.int = self.guess[v]
        if nearest >= 0:
            self.guess[v] = -1
            # There is no other.
            if self.sources.shape[0] == 1:
                looks = 0
            if self.line(v, nearest) < below and self.sees(v, nearest):
                self.take(v, nearest)
                return True
        above: cython.double = -INFINITY
        for _looks in range(looks):
            nearest = self.nearest_around(v, v, above, below, -1)
            if self.label[v] >= 0:
                # On a boundary of sources the nearest one may be a neighbour of the one that was found.
                nearest = self.nearest_around(self.sources[self.label[v]], v, above, below, nearest)
            if nearest < 0:
                return False
            if self.sees(v, nearest):
                self.take(v, nearest)
                return True
            above = self.line(v, nearest)
        return False

    @cython.cfunc
    @cython.nogil
    def take(self, v: cython.int, label: cython.int) -> cython.void:
        """Give v the straight line from a source, and wake those around it that may have use for this source."""
        self.d[v], self.begin[v], self.label[v] = self.line(v, label), self.offset[label], label
        for k in range(self.first_neighbour[v], self.first_neighbour[v + 1]):
            u: cython.int = self.neighbours[k]
            if self.label[u] != label or not self.is_lit(u, label):
                self.is_waiting[u] = True

    @cython.cfunc
    @cython.nogil
    def nearest_around(
        self, centre: cython.int, v: cython.int, above: cython.double, below: cython.double, nearest: cython.int
    ) -> cython.int:
        """Of the labels around a vertex the one with the shortest line to v between two bounds, or `nearest`."""
        if nearest >= 0:
            below = self.line(v, nearest)
        before: cython.int = nearest
        for k in range(self.first_neighbour[centre] - 1, self.first_neighbour[centre + 1]):
            at_centre: cython.bint = k < self.first_neighbour[centre]
            label: cython.int = self.label[centre if at_centre else self.neighbours[k]]
            if label >= 0 and label != before:
                before = label
                value: cython.double = self.line(v, label)
                if above < value < below:
                    below, nearest = value, label
        return nearest

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def line(self, v: cython.int, label: cython.int) -> cython.double:
        """The value at v along the straight line from a source."""
        source: cython.int = self.sources[label]
        away: cython.double = straight(cython.address(self.positions[v, 0]), cython.address(self.positions[source, 0]))
        return self.offset[label] + away

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def is_lit(self, v: cython.int, label: cython.int) -> cython.bint:
        """Whether the way to v is known to be a straight line from this source."""
        if self.label[v] != label:
            return False
        return (self.d[v] - self.offset[label]) * (1 - STRAIGHT_LINE) <= self.line(v, label) - self.offset[label]

    @cython.cfunc
    @cython.nogil
    def sees(self, v: cython.int, label: cython.int) -> cython.bint:
        """Whether the straight line from v to a source stays in the tetrahedra."""
        source: cython.int = self.sources[label]
        if self.first[v] == self.first[v + 1] or self.first[source] == self.first[source + 1]:
            return False
        goal = cython.address(self.positions[source, 0])
        for k in range(self.first_neighbour[v], self.first_neighbour[v + 1]):
            if self.neighbours[k] == source:
                return True
        begin: cython.int = self.ray.cone(v, goal)
        if begin >= 0:
            return self.arrives_from(v, begin, label)
        # Along faces and edges, several tetrahedra are as good to begin with, and some may end at a wall.
        for k in range(self.first[v], self.first[v + 1]):
            if self.ray.begins(self.incident[k], goal) and self.arrives_from(v, self.incident[k], label):
                return True
        return False

    @cython.cfunc
    @cython.nogil
    def arrives_from(self, v: cython.int, begin: cython.int, label: cython.int) -> cython.bint:
        """Whether the line from v that begins in the tetrahedron of a corner gets to the source.

        A line that touches a wall is moved to all sides, one of which is inside.
        """
        source: cython.int = self.sources[label]
        into: cython.int = -1 if self.turns[label] else self.incident[self.first[source]] // 4
        for toward in range(-1, 4 if self.is_concave else 0):
            if toward == begin % 4:
                continue
            self.ray.aim(v, begin // 4, cython.address(self.positions[source, 0]), into, NUDGE, toward)
            if self.ray.enters(begin // 4, begin % 4) and self.arrives(label):
                return True
            into = -1
        return False

    @cython.cfunc
    @cython.nogil
    def arrives(self, label: cython.int) -> cython.bint:
        """Whether the ray gets to the source before it leaves the body.

        Without concave walls it does once it passes between three vertices that see the source. The corner of a cavity
        may stand between such vertices.
        """
        source: cython.int = self.sources[label]
        for _steps in range(MOST_STEPS):
            a: cython.int = self.ray.a
            b: cython.int = self.ray.b
            c: cython.int = self.ray.c
            if not self.is_concave and self.is_lit(a, label) and self.is_lit(b, label) and self.is_lit(c, label):
                return True
            o: cython.int = self.ray.cross()
            if o < 0:
                return False
            if o == source:
                return True
            if not self.ray.turn(o):
                return False
        return False
