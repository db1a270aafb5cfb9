"""Where paths end inside faces: points and segments of curves, each a goal, and the nearest one from a point."""

import cython
from cython.cimports.heat_igl.kernels.paths.goals import PATH_ROUNDING, Nearest
from cython.cimports.heat_igl.kernels.paths.surfaces import Place, Surface, apart, at_corner, difference, product
from cython.cimports.libc.math import INFINITY

__all__ = ["Goals"]


@cython.final
@cython.cclass
class Goals:
    """The goals in each face f: ``inside[first_inside[f]:first_inside[f + 1]]``."""

    def __init__(self, first_inside, inside):
        self.first_inside, self.inside = first_inside, inside

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def ends(self, goal: cython.int, ends: cython.pointer[Place]) -> cython.void:
        """Set `ends` to the start and the end of a goal."""
        c: cython.int
        for c in range(3):
            ends[0].c[c], ends[1].c[c] = self.inside[goal].start[c], self.inside[goal].end[c]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def in_face(
        self, s: Surface, f: cython.int, x: cython.pointer[cython.const[Place]], at_any_cost: cython.bint
    ) -> Nearest:
        """The nearest goal inside face f from point x; none if the distance at x is less, unless `at_any_cost`."""
        best: Nearest
        best.goal, best.face, best.distance = -1, f, INFINITY
        i: cython.int
        if self.first_inside[f] == self.first_inside[f + 1]:
            return best
        for i in range(self.first_inside[f], self.first_inside[f + 1]):
            distance: cython.double = self._distance_to(s, f, i, x) + self.inside[i].offset
            if distance < best.distance:
                best.goal, best.distance = i, distance
        t = cython.address(s.triangle[f])
        here: cython.double = x.c[0] * s.d[t.vertex[0]] + x.c[1] * s.d[t.vertex[1]] + x.c[2] * s.d[t.vertex[2]]
        if not (at_any_cost or best.distance <= here * (1.0 + PATH_ROUNDING)):
            best.goal, best.distance = -1, INFINITY
        return best

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def around(self, s: Surface, v: cython.int, at_any_cost: cython.bint) -> Nearest:
        """The nearest goal inside the faces at vertex v."""
        best: Nearest
        best.goal, best.face, best.distance = -1, -1, INFINITY
        k: cython.int
        for k in range(s.first_corner[v], s.first_corner[v + 1]):
            f: cython.int = s.corner[k] // 3
            if self.first_inside[f] == self.first_inside[f + 1]:
                continue
            x: Place = at_corner(s.corner[k] % 3)
            found: Nearest = self.in_face(s, f, cython.address(x), at_any_cost)
            if found.distance < best.distance:
                best = found
        return best

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _distance_to(
        self, s: Surface, f: cython.int, goal: cython.int, x: cython.pointer[cython.const[Place]]
    ) -> cython.double:
        """How far point x of face f is from a goal in that face."""
        c: cython.int
        ends: Place[2]
        self.ends(goal, ends)
        along: Place = difference(cython.address(ends[1]), cython.address(ends[0]))
        off: Place = difference(x, cython.address(ends[0]))
        squared: cython.double = product(s, f, cython.address(along), cython.address(along))
        share: cython.double = 0.0
        if squared > 0.0:
            share = product(s, f, cython.address(off), cython.address(along)) / squared
        share = min(max(share, 0.0), 1.0)
        for c in range(3):
            ends[0].c[c] = ends[0].c[c] + share * along.c[c]
        return apart(s, f, x, cython.address(ends[0]))
