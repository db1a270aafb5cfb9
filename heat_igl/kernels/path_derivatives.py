"""Derivatives of the lengths of straight lines over triangles by the lengths of the edges.

A shortest path consists of straight lines from a vertex to the next vertex that it passes, or to a source point. A line
is followed through the triangles, laid out in the plane, until it meets its end. In a triangle with sides l, the piece
of the line between two places with barycentric coordinates that differ by delta has length s, and

    s^2 = - sum over pairs i < k of delta_i delta_k l_ik^2.

By the envelope theorem the places on the edges count as fixed, so the derivative of s by l_ik is
- delta_i delta_k l_ik / s. What is behind the end of a line is added by visiting the vertices in the order of distance.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.path_derivatives import MEETS, ON_LINE, SAME_LENGTH, SAME_LINE, End, Gate, Place
from cython.cimports.heat_igl.kernels.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.libc.math import fabs, sqrt

__all__ = ["pull_back", "push_forward"]

_GATE = np.dtype(
    [(name, "f8") for name in ("rx", "ry", "lx", "ly")]
    + [(name, "i4") for name in ("right", "left", "leave", "enter", "turns_left")],
    align=True,
)


@cython.final
@cython.cclass
class _Lines:
    """The triangles, how the path of each vertex begins, and the line that is being followed."""

    vertex: cython.const[cython.int][::1]
    length: cython.const[cython.double][::1]
    twin: cython.const[cython.int][::1]
    ring: cython.const[cython.int][::1]
    aligned: cython.const[cython.uchar][::1]
    first_inside: cython.const[cython.int][::1]
    following: cython.const[cython.int][::1]
    inside: cython.const[cython.double][:, ::1]
    distance: cython.const[cython.double][::1]
    kind: cython.const[cython.uchar][::1]
    entered: cython.const[cython.int][::1]
    share: cython.const[cython.double][::1]
    reach: cython.const[cython.double][::1]
    gate: Gate[::1]
    n_gates: cython.int
    end: End
    # Of the line: the vertex that it begins at, its corner there, its direction and its length.
    v: cython.int
    corner: cython.int
    ux: cython.double
    uy: cython.double
    extent: cython.double

    def __init__(self, triangles, points, ways):
        self.vertex, self.length, self.twin, self.ring, self.aligned = triangles
        self.first_inside, self.following, self.inside = points
        self.distance, self.kind, self.entered, self.share, self.reach = ways
        self.gate = np.zeros(256, _GATE)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def _cross(self) -> cython.int:
        """Go on from gate to gate until the line ends; where more than two faces meet, try all of them."""
        while True:
            met: cython.int = self._step()
            if met > 0:
                return 1
            if met < 0 and not self._turn_back():
                return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _enter(self, j: cython.int, g: cython.int) -> cython.bint:
        """Enter the face behind gate j by half-edge g, or by the next around the edge; false if there is none."""
        gate = cython.address(self.gate[j])
        if g == -2:
            g = self.ring[gate.leave]
        self.n_gates = j + 1
        gate.enter = g
        return g >= 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-2, check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _row_of(self, entry: cython.int) -> cython.int:
        """Where the distance of an entry of the source points stands."""
        return self.distance.shape[0] - self.inside.shape[0] + entry

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _squared(side: cython.pointer[cython.const[cython.double]], d: cython.pointer[Place]) -> cython.double:
    """The square of a length in a face with these sides, between places that differ by d."""
    return -(d.c[1] * d.c[2] * side[0] ** 2 + d.c[2] * d.c[0] * side[1] ** 2 + d.c[0] * d.c[1] * side[2] ** 2)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _piece(
    side: cython.pointer[cython.const[cython.double]],
    one: cython.pointer[Place],
    other: cython.pointer[Place],
    weight: cython.double,
    slope: cython.pointer[cython.double],
    tangent: cython.pointer[cython.const[cython.double]],
    at_end: cython.pointer[cython.double],
) -> cython.double:
    """One piece of a line in a face with sides `side`, from one place to another: the derivative of its length.

    Added to `slope` (3,) by the sides, times `weight`, and to `at_end` (3,) by the coordinates of the other place, if
    they are given; returned for the sides' own derivative, `tangent` (3,), if that is given.
    """
    d: Place
    c: cython.int
    i: cython.int
    k: cython.int
    total: cython.double = 0.0
    for c in range(3):
        d.c[c] = other.c[c] - one.c[c]
    squared: cython.double = _squared(side, cython.address(d))
    if not squared > 0.0:
        return 0.0
    per_length: cython.double = 1.0 / sqrt(squared)
    for c in range(3):
        i, k = (c + 1) % 3, (c + 2) % 3
        by_side: cython.double = -d.c[i] * d.c[k] * side[c] * per_length
        if slope != cython.NULL:
            slope[c] += weight * by_side
        if tangent != cython.NULL:
            total += by_side * tangent[c]
        if at_end != cython.NULL:
            at_end[c] -= 0.5 * weight * per_length * (d.c[i] * side[k] ** 2 + d.c[k] * side[i] ** 2)
    return total


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _along(
    lines: _Lines,
    weight: cython.double,
    slope: cython.pointer[cython.double],
    tangent: cython.pointer[cython.const[cython.double]],
    at_end: cython.pointer[cython.double],
) -> cython.double:
    """All pieces of the line that was followed; as `_piece`, with `slope` and `tangent` of all sides."""
    one: Place
    other: Place
    total: cython.double = 0.0
    none: cython.pointer[cython.double] = cython.NULL
    of_face: cython.pointer[cython.double] = cython.NULL
    tangent_of_face: cython.pointer[cython.const[cython.double]] = cython.NULL
    j: cython.int
    f: cython.int
    one.c[0] = one.c[1] = one.c[2] = 0.0
    one.c[lines.corner] = 1.0
    for j in range(lines.n_gates):
        gate = cython.address(lines.gate[j])
        share: cython.double = lines.place_at(j)
        other.c[0] = other.c[1] = other.c[2] = 0.0
        other.c[gate.right], other.c[gate.left] = 1.0 - share, share
        f = gate.leave - gate.leave % 3
        if slope != cython.NULL:
            of_face = slope + f
        if tangent != cython.NULL:
            tangent_of_face = tangent + f
        sides = cython.address(lines.length[f])
        total += _piece(sides, cython.address(one), cython.address(other), weight, of_face, tangent_of_face, none)
        # The same place in the face behind.
        f = gate.enter - gate.enter % 3
        one.c[0] = one.c[1] = one.c[2] = 0.0
        tail_is_left: cython.bint = _tail_is_left(lines, gate)
        one.c[next_half_edge(gate.enter) - f] = share if tail_is_left else 1.0 - share
        one.c[previous_half_edge(gate.enter) - f] = 1.0 - share if tail_is_left else share
    f = lines.end.face
    if slope != cython.NULL:
        of_face = slope + f
    if tangent != cython.NULL:
        tangent_of_face = tangent + f
    place = at_end
    if at_end != cython.NULL:
        place = at_end + 3 * lines.end.entry
        if lines.end.entry < 0:
            place = none
    sides = cython.address(lines.length[f])
    return total + _piece(
        sides, cython.address(one), cython.address(lines.end.at), weight, of_face, tangent_of_face, place
    )


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _tail_is_left(lines: _Lines, gate: cython.pointer[Gate]) -> cython.bint:
    """Whether the left end of a gate is the tail of the half-edge by which the face behind it is entered."""
    opposite: cython.bint = lines.aligned[gate.leave]
    if lines.twin[gate.leave] == -2:
        opposite = lines.vertex[next_half_edge(gate.leave)] != lines.vertex[next_half_edge(gate.enter)]
    return gate.turns_left == opposite


def pull_back(
    triangles,
    points,
    ways,
    order: cython.const[cython.int][::1],
    weight: cython.double[::1],
    by_side: cython.double[::1],
    by_place: cython.double[:, ::1],
    is_lost: cython.uchar[::1],
):
    """Add up the derivative of the weighted sum of path lengths by the sides (3 m,), and by the source points' places.

    `weight` (n + e,) is handed on along the paths, in descending `order` of distance; at the sources it ends as the sum
    of the weights of all paths to them. Vertices whose line does not meet its end are marked in `is_lost` (n,). Other
    arguments as `heat_igl.unfolding.path_derivatives.Paths` makes them.
    """
    lines = _Lines(triangles, points, ways)
    at_end: cython.pointer[cython.double] = cython.NULL
    i: cython.Py_ssize_t
    v: cython.int
    with cython.nogil:
        if by_place.shape[0] > 0:
            at_end = cython.address(by_place[0, 0])
        for i in range(order.shape[0] - 1, -1, -1):
            v = order[i]
            if lines.kind[v] == AT_SOURCE or weight[v] == 0.0:
                continue
            if not lines.follow(v):
                is_lost[v] = True
                continue
            _along(lines, weight[v], cython.address(by_side[0]), cython.NULL, at_end)
            weight[lines.end.row] += weight[v]


def push_forward(
    triangles,
    points,
    ways,
    order: cython.const[cython.int][::1],
    tangent: cython.const[cython.double][::1],
    change: cython.double[::1],
    is_lost: cython.uchar[::1],
):
    """The derivative of all path lengths, `change` (n + e,), for sides that change by `tangent` (3 m,).

    `change` is what the sources' offsets change by before. Arguments as for `pull_back`.
    """
    lines = _Lines(triangles, points, ways)
    i: cython.Py_ssize_t
    v: cython.int
    with cython.nogil:
        for i in range(order.shape[0]):
            v = order[i]
            if lines.kind[v] == AT_SOURCE:
                continue
            if not lines.follow(v):
                is_lost[v] = True
                continue
            change[v] = _along(lines, 1.0, cython.NULL, cython.address(tangent[0]), cython.NULL)
            change[v] += change[lines.end.row]
