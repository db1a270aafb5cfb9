"""Loops shortened as a whole, within their class.

A loop is straightened as a path from a point of it to itself, the base, which is then moved: to a vertex at which the
path bends, or else to an edge that it crosses, along which it slides to where the loop is shortest. The length falls
with every such step unless the loop is locally shortest at the base too.
"""

import cython
from cython.cimports.heat_igl.kernels.paths.loops import BOTH_WAYS, MOST_BASES, SHORTEST_SLIDE
from cython.cimports.heat_igl.kernels.paths.passing import Saved, copy
from cython.cimports.heat_igl.kernels.paths.polylines import Polyline
from cython.cimports.heat_igl.kernels.paths.settled_paths import GAIN, SettledPath
from cython.cimports.heat_igl.kernels.paths.surfaces import SNAP, Place, at_corner, corner_of, side_of
from cython.cimports.libc.math import INFINITY, fabs, sqrt

__all__ = ["Loop"]


@cython.final
@cython.cclass
class Loop:
    """The loop of a course, whose strip leads back to the start: `path` is the path from the base to itself."""

    def __init__(self, path: SettledPath, polyline: Polyline):
        self.path, self.course, self.polyline = path, path.course, polyline
        self.kept, self.ring = Saved(), Saved()

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def shorten(self) -> cython.double:
        """Lead the strip to the shortest loop of its class that is found; returns the length."""
        self.relax()
        return self.tighten()

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def relax(self) -> cython.int:
        """Shorten the loop as a polyline as far as that goes."""
        if not self.polyline.is_oriented:
            return 0
        self.path.lay_out()
        if self.course.vertex < 0:
            # Joints are vertices.
            if self.course.layout.n_bends == 2 or not self.move_base():
                return 0
            self.path.lay_out()
        if self.polyline.read():
            self.polyline.relax()
            self.polyline.write()
            self.path.end = at_corner(corner_of(self.course.s, self.course.last_face(), self.course.vertex))
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def tighten(self) -> cython.double:
        """Move the base until the loop is locally shortest; returns the length."""
        shortest: cython.double = INFINITY
        n_stalled: cython.int = 0
        length: cython.double = 0.0
        for _ in range(MOST_BASES):
            length = self.slide(self.path.settle())
            if not length < shortest * (1.0 - GAIN):
                length = self.path.pass_better(length)
            # One more base shows whether the loop is straight at the one before.
            n_stalled = 0 if length < shortest * (1.0 - GAIN) else n_stalled + 1
            shortest = min(shortest, length)
            if n_stalled == BOTH_WAYS or self.course.strip.count == 0 or not self.move_base():
                break
        return length

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def slide(self, length: cython.double) -> cython.double:
        """Move the base of a settled loop without a bend along the edge that it is on; returns the length."""
        side: cython.int = side_of(cython.address(self.course.start))
        if self.course.vertex >= 0 or side < 0 or self.course.layout.n_bends > 2:
            return length
        f: cython.int = self.course.face
        g: cython.int = self.course.last_face()
        t = cython.address(self.course.s.triangle[f])
        a: cython.int = (side + 1) % 3
        b: cython.int = (side + 2) % 3
        a_end: cython.int = corner_of(self.course.s, g, t.vertex[a])
        b_end: cython.int = corner_of(self.course.s, g, t.vertex[b])
        if a_end < 0 or b_end < 0:
            return length
        p = cython.address(self.course.layout.first)
        q = cython.address(self.course.layout.last)
        # From the base to the end of the loop, as the base moves from a to b: d + share e.
        dx: cython.double = q.x[a_end] - p.x[a]
        dy: cython.double = q.y[a_end] - p.y[a]
        ex: cython.double = q.x[b_end] - p.x[b] - dx
        ey: cython.double = q.y[b_end] - p.y[b] - dy
        squared: cython.double = ex * ex + ey * ey
        if not squared > 0.0:
            return length
        share: cython.double = min(max(-(dx * ex + dy * ey) / squared, 0.0), 1.0)
        dx += share * ex
        dy += share * ey
        if not sqrt(dx * dx + dy * dy) < length * (1.0 - GAIN):
            return length
        end: Place = self.path.end
        here: cython.double = self.course.start.c[b]
        self.kept.save(self.course)
        # The straight line may leave the strip. The length is a convex function of the share: a shorter way helps.
        while fabs(share - here) > SHORTEST_SLIDE:
            self.place_base(f, a, b, a_end, b_end, share)
            trial: cython.double = self.path.settle()
            if trial < length * (1.0 - GAIN):
                return trial
            self.kept.restore(self.course)
            self.path.end = end
            share = 0.5 * (share + here)
        return self.path.settle()

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def place_base(
        self,
        f: cython.int,
        a: cython.int,
        b: cython.int,
        a_end: cython.int,
        b_end: cython.int,
        share: cython.double,
    ) -> cython.void:
        """Put the base `share` of the way from a to b: corners of the first face f, and of the last face."""
        c: cython.int
        for c in range(3):
            self.course.start.c[c] = self.path.end.c[c] = 0.0
        if share < SNAP:
            share = 0.0
        elif share > 1.0 - SNAP:
            share = 1.0
        self.course.start.c[a] = self.path.end.c[a_end] = 1.0 - share
        self.course.start.c[b] = self.path.end.c[b_end] = share
        self.course.face = f
        self.course.vertex = self.path.vertex_at(f, cython.address(self.course.start))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def move_base(self) -> cython.int:
        """Base the loop elsewhere: at the middle one of its bends, or else on the middle one of its edges."""
        n_bends: cython.int = self.course.layout.n_bends
        at: cython.int = self.course.strip.count // 2
        share: cython.double
        if n_bends > 2:
            bend = cython.address(self.course.layout.bend[n_bends // 2])
            at = bend.first
            share = 1.0 - bend.side
        else:
            share = self.course.layout.share(at, 1)
        left: cython.int = self.course.layout.gate[at].vertex[0]
        right: cython.int = self.course.layout.gate[at].vertex[1]
        if not self.close():
            return 0
        leave: cython.int = self.course.strip.crossing[at].leave
        enter: cython.int = self.course.strip.crossing[at].enter
        self.turn_ring(at)
        f: cython.int = enter // 3
        g: cython.int = leave // 3
        self.place_base(
            f,
            corner_of(self.course.s, f, right),
            corner_of(self.course.s, f, left),
            corner_of(self.course.s, g, right),
            corner_of(self.course.s, g, left),
            share,
        )
        return 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def close(self) -> cython.int:
        """Lead the strip on past the base into the first face; 0 if no face leads there."""
        f: cython.int = self.course.last_face()
        if f == self.course.face:
            return 1
        if self.course.vertex >= 0:
            return self.course.turn(self.course.vertex, f, self.course.face)
        self.course.strip.push(
            3 * f + side_of(cython.address(self.path.end)),
            3 * self.course.face + side_of(cython.address(self.course.start)),
        )
        return 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def turn_ring(self, at: cython.int) -> cython.int:
        """Make the strip begin after the crossing `at` and end before it."""
        j: cython.int
        copy(self.course.strip, self.ring.strip)
        self.course.strip.count = 0
        for j in range(at + 1, self.ring.strip.count):
            self.course.strip.push(self.ring.strip.crossing[j].leave, self.ring.strip.crossing[j].enter)
        for j in range(at):
            self.course.strip.push(self.ring.strip.crossing[j].leave, self.ring.strip.crossing[j].enter)
        return 0
