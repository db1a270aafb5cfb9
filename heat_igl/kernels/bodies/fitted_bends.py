"""Distance along an edge around which ways bend, from the ways to its ends."""

import cython
from cython.cimports.heat_igl.kernels.bodies.bent_ways import GAIN
from cython.cimports.heat_igl.kernels.bodies.edge_sight import EdgeSight
from cython.cimports.heat_igl.kernels.bodies.fitted_bends import LEVEL, MISFIT
from cython.cimports.libc.math import INFINITY, fabs, sqrt


@cython.cclass
class FittedBends(EdgeSight):
    """Ways around edges, whose distances can be fitted again after those of the ends have changed."""

    def is_stale(self, i: cython.int) -> cython.bint:
        """Whether the ends of an edge have distances, and others than when it was fitted."""
        bend = cython.address(self.bends[i])
        to_a: cython.double = self.d[bend.a]
        to_b: cython.double = self.d[bend.b]
        if to_a == INFINITY or to_b == INFINITY:
            return False
        return bend.at[0] > to_a * (1 + GAIN) or bend.at[4] > to_b * (1 + GAIN)

    def fit(self, i: cython.int) -> cython.void:
        """Find distance along an edge from the ways to its ends."""
        bend = cython.address(self.bends[i])
        x: cython.double[3]
        to_a: cython.double = self.d[bend.a]
        to_b: cython.double = self.d[bend.b]
        # The way to one end continues along the edge unless it is hidden at the other end.
        a_reaches: cython.bint = self.value(bend.a, cython.address(self.positions[bend.b, 0])) >= to_b * (1 - GAIN)
        b_reaches: cython.bint = self.value(bend.b, cython.address(self.positions[bend.a, 0])) >= to_a * (1 - GAIN)
        bend.at[0], bend.at[4] = to_a, to_b
        for j in range(1, 4):
            for k in range(3):
                x[k] = self.positions[bend.a, k] + 0.25 * j * bend.length * bend.tangent[k]
            from_a: cython.double = self.value(bend.a, x)
            from_b: cython.double = self.value(bend.b, x)
            a_is_seen: cython.bint = a_reaches or self.is_lit_from(bend.a, i, x, 0.25 * j)
            b_is_seen: cython.bint = b_reaches or self.is_lit_from(bend.b, i, x, 0.25 * j)
            if a_is_seen and b_is_seen:
                bend.at[j] = min(from_a, from_b)
            elif a_is_seen:
                bend.at[j] = from_a
            elif b_is_seen:
                bend.at[j] = from_b
            else:
                bend.at[j] = max(from_a, from_b)
            if j == 2:
                self.value(bend.a, x)
                bend.has_before = self.way[bend.a] > -2
                for k in range(3):
                    bend.before[k] = self.x[k]
        self.lay_flat(i)

    def lay_flat(self, i: cython.int) -> cython.void:
        """Find the point beside an edge from which distance along it is measured, and whether there is one."""
        bend = cython.address(self.bends[i])
        size: cython.double = bend.length
        to_a: cython.double = bend.at[0]
        middle: cython.double = bend.at[2] - to_a
        to_b: cython.double = bend.at[4] - to_a
        turn: cython.double = to_b - 2 * middle
        way_a: cython.int = self.way[bend.a]
        if way_a == -1 and self.way[bend.b] == -1 and self.label[bend.a] == self.label[bend.b]:
            bend.start = self.offset[self.label[bend.a]] - to_a
        elif turn > LEVEL * size:
            bend.start = (to_b * to_b - 2 * middle * middle - 0.5 * size * size) / (2 * turn)
        elif way_a >= 0:
            bend.start = self.bends[way_a].start - to_a
        elif way_a == -1:
            bend.start = self.offset[self.label[bend.a]] - to_a
        else:
            bend.start = -size / LEVEL
        bend.start = max(bend.start, -size / LEVEL)
        radius: cython.double = -bend.start
        other: cython.double = to_b - bend.start
        bend.along = 0.5 * ((radius - other) * (radius + other) / size + size)
        squared: cython.double = radius * radius - bend.along * bend.along
        bend.fits = radius >= 0 and other >= 0 and squared >= 0
        bend.start += to_a
        if not bend.fits:
            return
        bend.height = sqrt(squared)
        for j in range(1, 4):
            off: cython.double = 0.25 * j * size - bend.along
            if fabs(bend.start + sqrt(off * off + squared) - bend.at[j]) > MISFIT * size:
                bend.fits = False
