"""Kernel of sight: vertices of tetrahedra that see a source which the vertices before them do not belong to."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.lines import STRAIGHT_LINE, straight
from cython.cimports.heat_igl.kernels.sight import GAIN, MOST_LOOKS, MOST_PASSES, MOST_STEPS, NUDGE, ON_SIDE
from cython.cimports.libc.math import INFINITY, fabs

__all__ = ["look_around"]


def look_around(
    order: cython.const[cython.int][::1],
    corners: cython.const[cython.int][:, ::1],
    first: cython.const[cython.int][::1],
    incident: cython.const[cython.int][::1],
    positions: cython.const[cython.double][:, ::1],
    sources: cython.const[cython.int][::1],
    offset: cython.const[cython.double][::1],
    d: cython.double[::1],
    begin: cython.double[::1],
    label: cython.int[::1],
):
    """Lower `d` (n,) to straight lines from the sources of neighbours, as far as these lines stay inside.

    Where the cell of a source is narrow, the tetrahedra through which a line comes in may have all their corners in
    other cells. Candidates are then the sources of all vertices around (Danielsson 1980, there for pixels), and a line
    is followed through the tetrahedra.

    Parameters
    ----------
    order : (n,) int32
        All vertices, roughly from near to far.
    corners : (m, 4) int32
        Tetrahedra.
    first, incident : (n + 1,) int32, (4 m,) int32
        Corners ``4 * tetrahedron + corner`` that meet in vertex v, at ``first[v]`` to ``first[v + 1]`` of `incident`.
    positions : (n, 3) float64
        Of the vertices.
    sources, offset : (k,) int32, (k,) float64
        Vertex of each source, and the value at which distance begins there.
    d, begin, label : (n,) float64, (n,) float64, (n,) int32
        Distances, the value at which the front that arrives seems to begin, and the source of each; changed.

    Returns
    -------
    (n,) uint8
        Whether a way that is not straight may be shorter: vertices with a neighbour that changed unless they see
        their source, and those from which a nearer source was looked for in vain.
    """
    n = order.shape[0]
    one = _Sight()
    one.corners, one.first, one.incident, one.positions = corners, first, incident, positions
    one.sources, one.offset, one.d, one.begin, one.label = sources, offset, d, begin, label
    is_waiting: cython.uchar[::1] = np.ones(n, np.uint8)
    is_touched: cython.uchar[::1] = np.zeros(n, np.uint8)
    is_hidden: cython.uchar[::1] = np.zeros(n, np.uint8)
    one.is_waiting, one.is_touched, one.is_hidden = is_waiting, is_touched, is_hidden
    i: cython.Py_ssize_t
    _passes: cython.int
    with cython.nogil:
        for _passes in range(MOST_PASSES):
            n_changed: cython.Py_ssize_t = 0
            for i in range(n):
                if is_waiting[order[i]]:
                    is_waiting[order[i]] = False
                    n_changed += one.look(order[i])
            if n_changed == 0:
                break
        for i in range(n):
            if is_touched[i] and not (label[i] >= 0 and one.is_lit(i, label[i])):
                is_hidden[i] = True
    return np.asarray(is_hidden)


@cython.final
@cython.cclass
class _Sight:
    """What is read and written, and the line that is followed: from p along w."""

    corners: cython.const[cython.int][:, ::1]
    first: cython.const[cython.int][::1]
    incident: cython.const[cython.int][::1]
    positions: cython.const[cython.double][:, ::1]
    sources: cython.const[cython.int][::1]
    offset: cython.const[cython.double][::1]
    d: cython.double[::1]
    begin: cython.double[::1]
    label: cython.int[::1]
    is_waiting: cython.uchar[::1]
    is_touched: cython.uchar[::1]
    is_hidden: cython.uchar[::1]
    p: cython.double[3]
    w: cython.double[3]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def look(self, v: cython.int) -> cython.int:
        """Give v the shortest line from a source of its neighbours that stays inside; returns whether there is one."""
        below: cython.double = self.d[v]
        if below < INFINITY:
            below -= GAIN * (below - self.begin[v])
        above: cython.double = -INFINITY
        k: cython.int
        c: cython.int
        _looks: cython.int
        for _looks in range(MOST_LOOKS):
            nearest: cython.int = self.nearest_around(v, v, above, below, -1)
            if self.label[v] >= 0:
                # On a boundary of sources the nearest one may be a neighbour of the one that was found.
                nearest = self.nearest_around(self.sources[self.label[v]], v, above, below, nearest)
            if nearest < 0:
                return False
            above = self.line(v, nearest)
            if self.sees(v, nearest):
                self.d[v], self.begin[v], self.label[v] = above, self.offset[nearest], nearest
                for k in range(self.first[v], self.first[v + 1]):
                    for c in range(4):
                        u: cython.int = self.corners[self.incident[k] // 4, c]
                        self.is_waiting[u] = self.is_touched[u] = True
                return True
            self.is_hidden[v] = True
        return False

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def nearest_around(
        self, centre: cython.int, v: cython.int, above: cython.double, below: cython.double, nearest: cython.int
    ) -> cython.int:
        """Of the labels around a vertex the one with the shortest line to v between two bounds, or `nearest`."""
        if nearest >= 0:
            below = self.line(v, nearest)
        before: cython.int = nearest
        k: cython.int
        c: cython.int
        for k in range(self.first[centre], self.first[centre + 1]):
            for c in range(4):
                label: cython.int = self.label[self.corners[self.incident[k] // 4, c]]
                if label >= 0 and label != before:
                    before = label
                    value: cython.double = self.line(v, label)
                    if above < value < below:
                        below, nearest = value, label
        return nearest

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def line(self, v: cython.int, label: cython.int) -> cython.double:
        """The value at v along the straight line from a source."""
        source: cython.int = self.sources[label]
        away: cython.double = straight(cython.address(self.positions[v, 0]), cython.address(self.positions[source, 0]))
        return self.offset[label] + away

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def side(self, a: cython.int, b: cython.int) -> cython.double:
        """On which side the edge ab passes the line: the determinant of w, a - p and b - p."""
        ax: cython.double = self.positions[a, 0] - self.p[0]
        ay: cython.double = self.positions[a, 1] - self.p[1]
        az: cython.double = self.positions[a, 2] - self.p[2]
        bx: cython.double = self.positions[b, 0] - self.p[0]
        by: cython.double = self.positions[b, 1] - self.p[1]
        bz: cython.double = self.positions[b, 2] - self.p[2]
        return self.w[0] * (ay * bz - az * by) + self.w[1] * (az * bx - ax * bz) + self.w[2] * (ax * by - ay * bx)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def leaves(self, o: cython.int, a: cython.int, b: cython.int, c: cython.int, part: cython.double) -> cython.int:
        """How the line leaves the tetrahedron oabc through abc: 0 if it does not, else the sign of its corners' order.

        The line may miss the triangle by a part of it.
        """
        of_a: cython.double = self.side(b, c)
        of_b: cython.double = self.side(c, a)
        of_c: cython.double = self.side(a, b)
        least: cython.double = -part * (fabs(of_a) + fabs(of_b) + fabs(of_c))
        sign: cython.int = 1 if of_a + of_b + of_c > 0 else -1
        if min(sign * of_a, sign * of_b, sign * of_c) < least:
            return 0
        # The line leaves where o lies behind: w and the normal of abc that points away from o agree.
        volume: cython.double = 0.0
        i: cython.int
        for i in range(3):
            j: cython.int = (i + 1) % 3
            k: cython.int = (i + 2) % 3
            at: cython.double = self.positions[o, i]
            volume += (self.positions[a, i] - at) * (
                (self.positions[b, j] - self.positions[o, j]) * (self.positions[c, k] - self.positions[o, k])
                - (self.positions[b, k] - self.positions[o, k]) * (self.positions[c, j] - self.positions[o, j])
            )
        return sign if sign * volume > 0 else 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def aim(
        self, v: cython.int, t: cython.int, source: cython.int, into: cython.int, nudge: cython.double
    ) -> cython.void:
        """Take the line from v to a source, both ends moved by a part of the way to the middle of a tetrahedron."""
        i: cython.int
        c: cython.int
        for i in range(3):
            p: cython.double = (1 - nudge) * self.positions[v, i]
            q: cython.double = (1 - nudge) * self.positions[source, i]
            for c in range(4):
                p += 0.25 * nudge * self.positions[self.corners[t, c], i]
                q += 0.25 * nudge * self.positions[self.corners[into, c], i]
            self.p[i], self.w[i] = p, q - p

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def sees(self, v: cython.int, label: cython.int) -> cython.bint:
        """Whether the straight line from v to a source stays in the tetrahedra."""
        source: cython.int = self.sources[label]
        into: cython.int = self.incident[self.first[source]] // 4
        k: cython.int
        for k in range(self.first[v], self.first[v + 1]):
            t: cython.int = self.incident[k] // 4
            o: cython.int = self.incident[k] % 4
            i: cython.int = self.corners[t, (o + 1) % 4]
            j: cython.int = self.corners[t, (o + 2) % 4]
            m: cython.int = self.corners[t, (o + 3) % 4]
            if source in (i, j, m):
                return True
            self.aim(v, t, source, into, 0.0)
            if self.leaves(v, i, j, m, ON_SIDE):
                # A line along edges and faces, as on a grid, would touch several tetrahedra at once.
                self.aim(v, t, source, into, NUDGE)
                return self.arrives(t, label)
        return False

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def is_lit(self, v: cython.int, label: cython.int) -> cython.bint:
        """Whether the way to v is known to be a straight line from this source."""
        if self.label[v] != label:
            return False
        return (self.d[v] - self.offset[label]) * (1 - STRAIGHT_LINE) <= self.line(v, label) - self.offset[label]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def arrives(self, t: cython.int, label: cython.int) -> cython.bint:
        """Whether the line, which begins inside tetrahedron t, gets to the source before it leaves the body.

        It does once it passes between three vertices that see the source.
        """
        source: cython.int = self.sources[label]
        a: cython.int = -1
        b: cython.int = -1
        c: cython.int = -1
        sign: cython.int = 0
        i: cython.int
        for i in range(4):
            a = self.corners[t, (i + 1) % 4]
            b = self.corners[t, (i + 2) % 4]
            c = self.corners[t, (i + 3) % 4]
            sign = self.leaves(self.corners[t, i], a, b, c, 0.0)
            if sign != 0:
                break
        if sign == 0:
            return False
        _steps: cython.int
        for _steps in range(MOST_STEPS):
            if self.is_lit(a, label) and self.is_lit(b, label) and self.is_lit(c, label):
                return True
            t = self.behind(t, a, b, c)
            if t < 0:
                return False
            o: cython.int = -1
            for i in range(4):
                u: cython.int = self.corners[t, i]
                if u != a and u != b and u != c:
                    o = u
            if o == source:
                return True
            of_a: cython.double = sign * self.side(o, a)
            of_b: cython.double = sign * self.side(o, b)
            of_c: cython.double = sign * self.side(o, c)
            if of_a >= 0 and of_b <= 0:
                c = o
            elif of_b >= 0 and of_c <= 0:
                a = o
            elif of_c >= 0 and of_a <= 0:
                b = o
            else:
                return False
        return False

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def behind(self, t: cython.int, a: cython.int, b: cython.int, c: cython.int) -> cython.int:
        """The other tetrahedron with the corners a, b and c, or -1."""
        k: cython.int
        i: cython.int
        for k in range(self.first[a], self.first[a + 1]):
            other: cython.int = self.incident[k] // 4
            if other != t:
                n_shared: cython.int = 0
                for i in range(4):
                    u: cython.int = self.corners[other, i]
                    n_shared += u in (b, c)
                if n_shared == 2:
                    return other
        return -1
