"""Lines through tetrahedra from a vertex to an edge."""

import cython
from cython.cimports.heat_igl.kernels.bodies.bent_ways import BentWays
from cython.cimports.heat_igl.kernels.bodies.rays import MOST_STEPS, NUDGE


@cython.cclass
class EdgeSight(BentWays):
    """Ways, the ray that is followed, and in `lit` (n,) the last search in which each vertex saw the edge.

    `stamp` is the number of the search.
    """

    def has_end(self, t: cython.int, i: cython.int) -> cython.bint:
        """Whether tetrahedron t is at the point of edge i at `share`."""
        bend = cython.address(self.bends[i])
        has_a: cython.bint = self.share > 1 - NUDGE
        has_b: cython.bint = self.share < NUDGE
        for c in range(4):
            has_a = has_a or self.corners[t, c] == bend.a
            has_b = has_b or self.corners[t, c] == bend.b
        return has_a and has_b

    def sees(self, i: cython.int, v: cython.int) -> cython.bint:
        """Whether the line from v to `x` on edge i stays in the tetrahedra.

        It does once it passes between three vertices that see the edge.
        """
        for k in range(self.first[v], self.first[v + 1]):
            if self.has_end(self.incident[k] // 4, i):
                return True
        begin: cython.int = self.ray.cone(v, self.x)
        if begin >= 0:
            return self.arrives_from(v, begin, i)
        for k in range(self.first[v], self.first[v + 1]):
            if self.ray.begins(self.incident[k], self.x) and self.arrives_from(v, self.incident[k], i):
                return True
        return False

    def arrives_from(self, v: cython.int, begin: cython.int, i: cython.int) -> cython.bint:
        """Whether the line from v to `x` that begins in the tetrahedron of a corner gets to edge i."""
        self.ray.aim(v, begin // 4, self.x, -1, NUDGE)
        return self.ray.enters(begin // 4, begin % 4) and self.arrives(i)

    def arrives(self, i: cython.int) -> cython.bint:
        """Whether the ray gets to edge i before it leaves the body."""
        stamp: cython.int = self.stamp
        for _steps in range(MOST_STEPS):
            if self.lit[self.ray.a] == stamp and self.lit[self.ray.b] == stamp and self.lit[self.ray.c] == stamp:
                return True
            o: cython.int = self.ray.cross()
            if o < 0:
                return False
            if self.has_end(self.ray.t, i):
                return True
            if not self.ray.turn(o):
                return False
        return False

    def is_lit_from(
        self, v: cython.int, i: cython.int, x: cython.pointer[cython.const[cython.double]], share: cython.double
    ) -> cython.bint:
        """Whether the source from which the way to v is straight sees a point of edge i."""
        if self.way[v] != -1:
            return False
        for k in range(3):
            self.x[k] = x[k]
        self.share = share
        return self.sees(i, self.sources[self.label[v]])
