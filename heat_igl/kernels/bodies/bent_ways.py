"""Ways through tetrahedra that bend around edges of the body, and their lengths."""

import cython
from cython.cimports.libc.math import INFINITY, sqrt


@cython.cclass
class BentWays:
    """Edges around which ways bend, and the distances of the vertices, as in `bodies.bends.bend_around`.

    Of the way that was last asked for, `x` (3,) is the point at which it bends last, `share` the place of this point
    along the edge, and `beyond` by how much the way would miss the edge on a line through it.
    """

    def value(self, v: cython.int, x: cython.pointer[cython.const[cython.double]]) -> cython.double:
        """Distance at a point near vertex v, by the way to v; `x` becomes the point at which this way bends last."""
        if self.way[v] >= 0:
            return self.around(self.way[v], x)
        source: cython.int = v
        value: cython.double = self.d[v]
        if self.way[v] == -1:
            source, value = self.sources[self.label[v]], self.offset[self.label[v]]
        squared: cython.double = 0.0
        for k in range(3):
            self.x[k] = self.positions[source, k]
            squared += (x[k] - self.x[k]) * (x[k] - self.x[k])
        return value + sqrt(squared)

    def around(self, i: cython.int, x: cython.pointer[cython.const[cython.double]]) -> cython.double:
        """Length of the way to a point that bends around an edge last; sets `x`, `share` and `beyond`."""
        bend = cython.address(self.bends[i])
        away: cython.double = 0.0
        along: cython.double = 0.0
        for k in range(3):
            off: cython.double = x[k] - self.positions[bend.a, k]
            away += off * off
            along += off * bend.tangent[k]
        squared: cython.double = max(away - along * along, 0.0)
        best: cython.double = INFINITY
        self.beyond = 0.0
        if bend.fits:
            height: cython.double = sqrt(squared)
            both: cython.double = height + bend.height
            self.share = bend.along
            if both > 0:
                self.share = (bend.along * height + along * bend.height) / both
            self.beyond = max(-self.share, self.share - bend.length, 0.0)
            self.share = min(max(self.share / bend.length, 0.0), 1.0)
            if 0 < self.share < 1:
                best = bend.start + sqrt((along - bend.along) * (along - bend.along) + both * both)
        if best == INFINITY:
            for j in range(5):
                if bend.fits and 0 < j < 4:
                    continue
                off = along - 0.25 * j * bend.length
                through: cython.double = bend.at[j] + sqrt(squared + off * off)
                if through < best:
                    best, self.share = through, 0.25 * j
        for k in range(3):
            self.x[k] = self.positions[bend.a, k] + self.share * bend.length * bend.tangent[k]
        return best

    def away(self, v: cython.int) -> cython.double:
        """Distance of v from `x`."""
        squared: cython.double = 0.0
        for k in range(3):
            squared += (self.positions[v, k] - self.x[k]) * (self.positions[v, k] - self.x[k])
        return sqrt(squared)
