"""Straight lines over triangles, followed from the vertex that they begin at to their end, a vertex or a source point.

The triangles are laid out in the plane, one behind the other. Unfolding and windows tell how a line begins.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.lines import (
    ALONG_EDGE,
    IN_FACE,
    MEETS,
    ON_LINE,
    SAME_LENGTH,
    SAME_LINE,
    Gate,
)
from cython.cimports.libc.math import fabs, sqrt

__all__ = ["Lines"]

_GATE = np.dtype(
    [(name, "f8") for name in ("rx", "ry", "lx", "ly")]
    + [(name, "i4") for name in ("right", "left", "leave", "enter", "turns_left")],
    align=True,
)


@cython.final
@cython.cclass
class Lines:
    """The triangles, how the path of each vertex begins, and the line that is being followed."""

    def __init__(self, triangles, points, ways):
        self.vertex, self.twin, self.ring, self.aligned, self.length = triangles
        self.first_inside, self.following, self.inside = points
        self.distance, self.kind, self.entered, self.share, self.reach = ways
        self.gate = np.zeros(256, _GATE)

    def follow(self, v: cython.int) -> cython.int:
        """Follow the line from vertex v to its `end`, through `gate`; 0 if it does not meet any."""
        h: cython.int = self.entered[v]
        self.v, self.n_gates = v, 0
        if self.kind[v] == ALONG_EDGE:
            return self._end_along(h)
        if self.kind[v] == IN_FACE:
            return self._end_inside(v, self.share[v])
        # v lies in the origin, the right end of h on the first axis.
        f: cython.int = h - h % 3
        self.corner = h % 3
        right: cython.int = next_half_edge(h) - f
        left: cython.int = previous_half_edge(h) - f
        rx: cython.double = self.length[f + left]
        lx: cython.double = foot(rx, self.length[f + right], self.length[h])
        ly: cython.double = 2.0 * _area(rx, self.length[f + right], self.length[h]) / rx
        x: cython.double = rx + self.share[v] * (lx - rx)
        y: cython.double = self.share[v] * ly
        length: cython.double = sqrt(x * x + y * y)
        self.ux, self.uy, self.extent = x / length, y / length, self.reach[v]
        if self._meets(rx, 0.0, f, right) or self._meets(lx, ly, f, left):
            return 1
        gate = cython.address(self.gate[0])
        gate.rx, gate.ry, gate.lx, gate.ly = rx, 0.0, lx, ly
        gate.right, gate.left, gate.leave, gate.turns_left = right, left, h, True
        if not self._enter(0, self.twin[h]):
            return 0
        return self._cross()

    def _cross(self) -> cython.int:
        """Go on from gate to gate until the line ends; where more than two faces meet, try all of them."""
        while True:
            met: cython.int = self._step()
            if met > 0:
                return 1
            if met < 0 and not self._turn_back():
                return 0

    def _enter(self, j: cython.int, g: cython.int) -> cython.bint:
        """Enter the face behind gate j by half-edge g, or by the next around the edge; false if there is none."""
        gate = cython.address(self.gate[j])
        if g == -2:
            g = self.ring[gate.leave]
        self.n_gates = j + 1
        gate.enter = g
        return g >= 0

    def _turn_back(self) -> cython.bint:
        """Take another face at the last edge of more than two; false if there is none."""
        j: cython.int
        for j in range(self.n_gates - 1, -1, -1):
            gate = cython.address(self.gate[j])
            if self.twin[gate.leave] == -2:
                following: cython.int = self.ring[gate.enter]
                if following != gate.leave:
                    return self._enter(j, following)
        return False

    def _step(self) -> cython.int:
        """Cross the last gate: 1 if the line ends in the face behind it, -1 if it cannot go on there, else 0."""
        j: cython.int = self.n_gates - 1
        if j + 1 == self.gate.shape[0]:
            with cython.gil:
                self.gate = np.concatenate([self.gate, np.zeros(j + 1, _GATE)])
        gate = cython.address(self.gate[j])
        g: cython.int = gate.enter
        f: cython.int = g - g % 3
        # Whether the faces on both sides run along their edge in opposite directions.
        opposite: cython.bint = self.aligned[gate.leave]
        if self.twin[gate.leave] == -2:
            opposite = self.vertex[next_half_edge(gate.leave)] != self.vertex[next_half_edge(g)]
        turns_left: cython.bint = gate.turns_left == opposite
        left: cython.int = next_half_edge(g) - f
        right: cython.int = previous_half_edge(g) - f
        if not turns_left:
            left, right = right, left
        base: cython.double = self.length[g]
        along: cython.double = foot(base, self.length[f + left], self.length[f + right]) / base
        beyond: cython.double = 2.0 * _area(base, self.length[f + left], self.length[f + right]) / (base * base)
        ex: cython.double = gate.lx - gate.rx
        ey: cython.double = gate.ly - gate.ry
        x: cython.double = gate.rx + along * ex + beyond * ey
        y: cython.double = gate.ry + along * ey - beyond * ex
        if self._meets(x, y, f, g - f) or self._meets_inside(f, g - f, right, left, gate, x, y):
            return 1
        across: cython.double = self.ux * ey - self.uy * ex
        if gate.rx * ey - gate.ry * ex > self.extent * (1.0 + MEETS) * across:
            return -1
        # Left of the line, the far corner becomes the left end of the next gate.
        after = cython.address(self.gate[j + 1])
        if self.ux * y - self.uy * x > 0.0:
            after.rx, after.ry, after.right = gate.rx, gate.ry, right
            after.lx, after.ly, after.left = x, y, g - f
            after.leave = f + left
        else:
            after.lx, after.ly, after.left = gate.lx, gate.ly, left
            after.rx, after.ry, after.right = x, y, g - f
            after.leave = f + right
        after.turns_left = turns_left
        return 0 if self._enter(j + 1, self.twin[after.leave]) else -1

    def _meets(self, x: cython.double, y: cython.double, f: cython.int, corner: cython.int) -> cython.bint:
        """Whether the line ends at, or passes through, the corner of face f / 3 that lies at (x, y)."""
        w: cython.int = self.vertex[f + corner]
        apart: cython.double = sqrt(x * x + y * y)
        if not self._is_on_way(x, y, apart, self.distance[w]):
            return False
        self.end.x, self.end.y = x, y
        self.end.row, self.end.entry, self.end.face = w, -1, f
        self.end.at.c[0] = self.end.at.c[1] = self.end.at.c[2] = 0.0
        self.end.at.c[corner] = 1.0
        return True

    def _is_on_way(
        self, x: cython.double, y: cython.double, apart: cython.double, behind: cython.double
    ) -> cython.bint:
        """Whether (x, y), from which a path of length `behind` goes on, is a place on the path of v."""
        if not apart + behind <= self.distance[self.v] * (1.0 + SAME_LENGTH):
            return False
        dx: cython.double = x - self.ux * self.extent
        dy: cython.double = y - self.uy * self.extent
        near: cython.double = MEETS * self.extent
        if dx * dx + dy * dy <= near * near:
            return True
        return (
            self.ux * x + self.uy * y > 0.0
            and apart < self.extent
            and fabs(self.ux * y - self.uy * x) <= ON_LINE * apart
            and apart + behind <= self.distance[self.v] * (1.0 + SAME_LINE)
            and behind < self.distance[self.v]
        )

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _meets_inside(
        self,
        f: cython.int,
        apex: cython.int,
        right: cython.int,
        left: cython.int,
        gate: cython.pointer[Gate],
        x: cython.double,
        y: cython.double,
    ) -> cython.bint:
        """Whether the line ends at a source point inside face f / 3, whose apex lies at (x, y) behind a gate."""
        if self.first_inside.shape[0] == 0:
            return False
        entry: cython.int = self.first_inside[f // 3]
        c: cython.int
        while entry >= 0:
            place = cython.address(self.inside[entry, 0])
            px: cython.double = place[apex] * x + place[right] * gate.rx + place[left] * gate.lx
            py: cython.double = place[apex] * y + place[right] * gate.ry + place[left] * gate.ly
            row: cython.int = self._row_of(entry)
            if self._is_on_way(px, py, sqrt(px * px + py * py), self.distance[row]):
                self.end.x, self.end.y = px, py
                self.end.row, self.end.entry, self.end.face = row, entry, f
                for c in range(3):
                    self.end.at.c[c] = place[c]
                return True
            entry = self.following[entry]
        return False

    def _row_of(self, entry: cython.int) -> cython.int:
        """Where the distance of an entry of the source points stands."""
        return self.distance.shape[0] - self.inside.shape[0] + entry

    def _end_along(self, h: cython.int) -> cython.int:
        """End the line at the other end of half-edge h."""
        f: cython.int = h - h % 3
        tail: cython.int = next_half_edge(h)
        head: cython.int = previous_half_edge(h)
        if self.vertex[tail] != self.v:
            tail, head = head, tail
        self.corner = tail - f
        self.end.row, self.end.entry, self.end.face = self.vertex[head], -1, f
        self.end.at.c[0] = self.end.at.c[1] = self.end.at.c[2] = 0.0
        self.end.at.c[head - f] = 1.0
        return 1

    def _end_inside(self, v: cython.int, corner: cython.double) -> cython.int:
        """End the line from a corner of a face at a source point in this face."""
        entry: cython.int = self.entered[v]
        c: cython.int
        self.corner = cython.cast(cython.int, corner) % 3
        self.end.row, self.end.entry = self._row_of(entry), entry
        self.end.face = cython.cast(cython.int, corner) - self.corner
        for c in range(3):
            self.end.at.c[c] = self.inside[entry, c]
        return 1

    def place_at(self, j: cython.int) -> cython.double:
        """The share of gate j, from its right end, at which the line to its exact end crosses it."""
        gate = cython.address(self.gate[j])
        right: cython.double = self.end.x * gate.ry - self.end.y * gate.rx
        left: cython.double = self.end.x * gate.ly - self.end.y * gate.lx
        return right / (right - left) if right != left else 0.5


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _area(a: cython.double, b: cython.double, c: cython.double) -> cython.double:
    """Area of a triangle by its sides, as `heat_igl.intrinsic.layout` would have it."""
    half: cython.double = 0.5 * (a + b + c)
    product: cython.double = half * (half - a) * (half - b) * (half - c)
    return sqrt(product) if product > 0.0 else 0.0
