"""A straight line through tetrahedra, from one to the next."""

import cython
from cython.cimports.heat_igl.kernels.bodies.bodies import Body
from cython.cimports.heat_igl.kernels.bodies.rays import MOST_TURNS, ON_SIDE
from cython.cimports.libc.math import fabs


@cython.final
@cython.cclass
class Ray:
    """A line from p along w, the tetrahedron t that it is in, and the triangle abc through which it leaves t.

    `sign` tells the order of abc.

    Parameters
    ----------
    body : Body
        The tetrahedra.
    """

    def __init__(self, body: Body):
        self.corners, self.first, self.incident = body.corners, body.first, body.incident
        self.positions, self.behind = body.positions, body.behind

    def cone(self, v: cython.int, goal: cython.pointer[cython.const[cython.double]]) -> cython.int:
        """The corner ``4 t + corner`` at v through whose tetrahedron the line to a point begins, well inside; else -1.

        From tetrahedron to tetrahedron around v, through the side that the line lies farthest behind. That ends at the
        boundary, and where the line runs along a side.
        """
        k: cython.int = self.incident[self.first[v]]
        self.aim(v, k // 4, goal, -1, 0.0)
        for _turns in range(MOST_TURNS):
            side: cython.int = self.worst_side(k)
            if side < 0:
                return k if side == -1 else -1
            t: cython.int = self.behind[k // 4, side]
            if t < 0:
                return -1
            for i in range(4):
                if self.corners[t, i] == v:
                    k = 4 * t + i
        return -1

    def worst_side(self, k: cython.int) -> cython.int:
        """The side of the cone at corner k that the line is farthest behind: the corner opposite it in the tetrahedron.

        -1 if the line is inside the cone, -2 if it is along a side.
        """
        t: cython.int = k // 4
        o: cython.int = k % 4
        a: cython.int = self.corners[t, (o + 1) % 4]
        b: cython.int = self.corners[t, (o + 2) % 4]
        c: cython.int = self.corners[t, (o + 3) % 4]
        sign: cython.double = 1.0 if self.volume(self.corners[t, o], a, b, c) > 0 else -1.0
        of_a: cython.double = sign * self.side(b, c)
        of_b: cython.double = sign * self.side(c, a)
        of_c: cython.double = sign * self.side(a, b)
        least: cython.double = min(of_a, of_b, of_c)
        slack: cython.double = ON_SIDE * (fabs(of_a) + fabs(of_b) + fabs(of_c))
        if least > slack:
            return -1
        if least >= -slack:
            return -2
        if least == of_a:
            return (o + 1) % 4
        return (o + 2) % 4 if least == of_b else (o + 3) % 4

    def begins(self, k: cython.int, goal: cython.pointer[cython.const[cython.double]]) -> cython.bint:
        """Whether the line from corner k to a point leaves the tetrahedron of k through the opposite side."""
        t: cython.int = k // 4
        o: cython.int = k % 4
        v: cython.int = self.corners[t, o]
        self.aim(v, t, goal, -1, 0.0)
        i: cython.int = self.corners[t, (o + 1) % 4]
        j: cython.int = self.corners[t, (o + 2) % 4]
        return self.leaves(v, i, j, self.corners[t, (o + 3) % 4], ON_SIDE) != 0

    def aim(
        self,
        v: cython.int,
        t: cython.int,
        goal: cython.pointer[cython.const[cython.double]],
        into: cython.int,
        nudge: cython.double,
        toward: cython.int = -1,
    ) -> cython.void:
        """Take the line from v to a point, both ends moved by a part of the way to the middle of a tetrahedron.

        A line along edges and faces, as on a grid, would touch several tetrahedra at once. The end stays if `into` is
        negative, and the beginning is moved towards one corner of t if `toward` names it.
        """
        for i in range(3):
            p: cython.double = (1 - nudge) * self.positions[v, i]
            q: cython.double = goal[i]
            for c in range(4):
                part: cython.double = 0.25 if toward < 0 else 0.7 if c == toward else 0.1
                p += part * nudge * self.positions[self.corners[t, c], i]
            if into >= 0:
                q *= 1 - nudge
                for c in range(4):
                    q += 0.25 * nudge * self.positions[self.corners[into, c], i]
            self.p[i], self.w[i] = p, q - p

    def enters(self, t: cython.int, o: cython.int) -> cython.bint:
        """Find the triangle through which the line, which begins inside t, leaves it; opposite corner o at first."""
        self.t = t
        for i in range(o, o + 4):
            self.a = self.corners[t, (i + 1) % 4]
            self.b = self.corners[t, (i + 2) % 4]
            self.c = self.corners[t, (i + 3) % 4]
            self.sign = self.leaves(self.corners[t, i % 4], self.a, self.b, self.c, 0.0)
            if self.sign != 0:
                return True
        return False

    def cross(self) -> cython.int:
        """Go through abc; returns the fourth vertex of the tetrahedron behind it, or -1 on the boundary."""
        for i in range(4):
            u: cython.int = self.corners[self.t, i]
            if u != self.a and u != self.b and u != self.c:
                break
        self.t = self.behind[self.t, i]
        if self.t >= 0:
            for i in range(4):
                u = self.corners[self.t, i]
                if u != self.a and u != self.b and u != self.c:
                    return u
        return -1

    def turn(self, o: cython.int) -> cython.bint:
        """Find the triangle at o through which the line leaves t, which it entered through abc."""
        of_a: cython.double = self.sign * self.side(o, self.a)
        of_b: cython.double = self.sign * self.side(o, self.b)
        of_c: cython.double = self.sign * self.side(o, self.c)
        if of_a >= 0 and of_b <= 0:
            self.c = o
        elif of_b >= 0 and of_c <= 0:
            self.a = o
        elif of_c >= 0 and of_a <= 0:
            self.b = o
        else:
            return False
        return True

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def side(self, a: cython.int, b: cython.int) -> cython.double:
        """On which side the edge ab passes the line: the determinant of w, a - p and b - p."""
        ax: cython.double = self.positions[a, 0] - self.p[0]
        ay: cython.double = self.positions[a, 1] - self.p[1]
        az: cython.double = self.positions[a, 2] - self.p[2]
        bx: cython.double = self.positions[b, 0] - self.p[0]
        by: cython.double = self.positions[b, 1] - self.p[1]
        bz: cython.double = self.positions[b, 2] - self.p[2]
        return self.w[0] * (ay * bz - az * by) + self.w[1] * (az * bx - ax * bz) + self.w[2] * (ax * by - ay * bx)

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
        return sign if sign * self.volume(o, a, b, c) > 0 else 0

    @cython.cfunc
    @cython.inline
    @cython.nogil
    def volume(self, o: cython.int, a: cython.int, b: cython.int, c: cython.int) -> cython.double:
        """Six times the volume of oabc, with the sign of the order of its corners."""
        found: cython.double = 0.0
        for i in range(3):
            j: cython.int = (i + 1) % 3
            k: cython.int = (i + 2) % 3
            at: cython.double = self.positions[o, i]
            found += (self.positions[a, i] - at) * (
                (self.positions[b, j] - self.positions[o, j]) * (self.positions[c, k] - self.positions[o, k])
                - (self.positions[b, k] - self.positions[o, k]) * (self.positions[c, j] - self.positions[o, j])
            )
        return found
