"""Curves shortened within their class: open ones between fixed ends, loops as a whole.

A loop is a path from a point of it to itself, the base. First the strip is led past the bends of that path once from
each of a few bases, so that no point of the loop is held for long. Then the path is straightened, and the base moved:
to a vertex at which the path bends, or else to an edge that it crosses, along which it slides to where the loop is
shortest. The length falls with every such step unless the loop is locally shortest at the base too.
"""

import cython
from cython.cimports.heat_igl.kernels.paths.shortening import (
    BOTH_WAYS,
    FIRST_BASES,
    MOST_BASES,
    SHORTEST_SLIDE,
)
from cython.cimports.heat_igl.kernels.paths.straightening import (
    GAIN,
    LARGEST_LOSS,
    Course,
    Passing,
    Saved,
)
from cython.cimports.heat_igl.kernels.paths.strips import (
    SNAP,
    FaceTable,
    Place,
    Strip,
    at_corner,
    corner_of,
    side_of,
    vertex_at,
)
from cython.cimports.libc.math import INFINITY, fabs, sqrt


@cython.final
@cython.cclass
class Loop:
    """The loop of a course, whose strip leads back to the start, the base."""

    def __init__(self, passing: Passing):
        self.course, self.passing = passing.course, passing
        self.kept, self.ring = Saved(), Strip()

    def shorten(self) -> cython.double:
        """Lead the strip to the shortest loop of its class that is found; returns the length."""
        self.relax()
        return self.tighten()

    def relax(self) -> cython.int:
        """Lead the strip past all bends once from each of the first bases."""
        for _ in range(FIRST_BASES):
            self.course.lay_out()
            if not self.course.repair():
                return 0
            self.course.lay_out()
            if self.course.strip.count == 0 or not self.move_base():
                return 0
        return 0

    def tighten(self) -> cython.double:
        """Move the base until the loop is locally shortest; returns the length."""
        shortest: cython.double = INFINITY
        n_stalled: cython.int = 0
        length: cython.double = 0.0
        for _ in range(MOST_BASES):
            length = self.slide(self.course.settle())
            if not length < shortest * (1.0 - GAIN):
                length = self.passing.improve(length)
            # One more base shows whether the loop is straight at the one before.
            n_stalled = 0 if length < shortest * (1.0 - GAIN) else n_stalled + 1
            shortest = min(shortest, length)
            if n_stalled == BOTH_WAYS or self.course.strip.count == 0 or not self.move_base():
                break
        return length

    def slide(self, length: cython.double) -> cython.double:
        """Move the base of a settled loop without a bend along the edge that it is on; returns the length."""
        side: cython.int = side_of(cython.address(self.course.start))
        if self.course.vertex >= 0 or side < 0 or self.course.funnel.n_bends > 2:
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
        p = cython.address(self.course.funnel.first)
        q = cython.address(self.course.funnel.last)
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
        here: cython.double = self.course.start.c[b]
        self.kept.save(self.course)
        # The straight line may leave the strip. The length is a convex function of the share: a shorter way helps.
        while fabs(share - here) > SHORTEST_SLIDE:
            self.place_base(f, a, b, a_end, b_end, share)
            trial: cython.double = self.course.settle()
            if trial < length * (1.0 - GAIN):
                return trial
            self.kept.restore(self.course)
            share = 0.5 * (share + here)
        return self.course.settle()

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
        for c in range(3):
            self.course.start.c[c] = self.course.end.c[c] = 0.0
        if share < SNAP:
            share = 0.0
        elif share > 1.0 - SNAP:
            share = 1.0
        self.course.start.c[a] = self.course.end.c[a_end] = 1.0 - share
        self.course.start.c[b] = self.course.end.c[b_end] = share
        self.course.face = f
        self.course.vertex = vertex_at(self.course.s, f, cython.address(self.course.start))

    def move_base(self) -> cython.int:
        """Base the loop elsewhere: at the middle one of its bends, or else on the middle one of its edges."""
        n_bends: cython.int = self.course.funnel.n_bends
        at: cython.int = self.course.strip.count // 2
        if n_bends > 2:
            bend = cython.address(self.course.funnel.bend[n_bends // 2])
            at = bend.first
            share = 1.0 - bend.side
        else:
            share = self.course.funnel.share(at, 1)
        left: cython.int = self.course.funnel.gate[at].vertex[0]
        right: cython.int = self.course.funnel.gate[at].vertex[1]
        if not self.close():
            return 0
        leave: cython.int = self.course.strip.crossing[at].leave
        enter: cython.int = self.course.strip.crossing[at].enter
        # The strip begins after this crossing and ends before it.
        self.ring.copy(self.course.strip)
        self.course.strip.count = 0
        self.course.strip.extend(self.ring.crossing, at + 1, self.ring.count)
        self.course.strip.extend(self.ring.crossing, 0, at)
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

    def close(self) -> cython.int:
        """Lead the strip on past the base into the first face; 0 if no face leads there."""
        f: cython.int = self.course.last_face()
        if f == self.course.face:
            return 1
        if self.course.vertex >= 0:
            return self.course.turn(self.course.vertex, self.course.face)
        self.course.strip.push(
            3 * f + side_of(cython.address(self.course.end)),
            3 * self.course.face + side_of(cython.address(self.course.start)),
        )
        return 1


@cython.final
@cython.cclass
class Shortener:
    """Shortens curves on the same faces, one after another; see `heat_igl.curves.GeodesicPathSolver`."""

    def __init__(self, faces: FaceTable, half_turn, most_corners):
        self.course = Course(faces, most_corners)
        self.passing = Passing(self.course, half_turn)
        self.loop = Loop(self.passing)

    def shorten(
        self,
        face: cython.const[cython.int][::1],
        join: cython.const[cython.int][:, ::1],
        ends: cython.const[cython.double][:, ::1],
        is_closed: cython.bint,
    ):
        """The shortest curve of a class: its length, faces, and the ends of its segments.

        First comes -1, or the number of the join at which only a vertex holds a loop together; then there is no curve.
        """
        # A loop is straightened from many bases.
        self.passing.largest_loss = 0.0 if is_closed else LARGEST_LOSS
        with cython.nogil:
            stuck = self.follow(face, join, ends, is_closed)
            if stuck < 0:
                if is_closed:
                    self.length += self.loop.shorten()
                else:
                    self.length += self.passing.improve(self.course.settle())
                self.course.emit()
        return stuck, self.length, *self.course.segments.arrays()

    def follow(
        self,
        face: cython.const[cython.int][::1],
        join: cython.const[cython.int][:, ::1],
        ends: cython.const[cython.double][:, ::1],
        is_closed: cython.bint,
    ) -> cython.int:
        """Make the strip of a course; -1, or the join at which a loop is stuck."""
        start: Place
        end: Place
        self.course.segments.n = 0
        self.length = 0.0
        for c in range(3):
            start.c[c], end.c[c] = ends[0, c], ends[1, c]
        self.course.begin(face[0], start)
        for i in range(join.shape[0]):
            v: cython.int = join[i, 2]
            f: cython.int = face[i + 1 if i + 1 < face.shape[0] else 0]
            if join[i, 0] >= 0:
                self.course.strip.push(join[i, 0], join[i, 1])
            elif v >= 0 and not self.course.turn(v, f):
                # Only this vertex joins the two faces.
                if is_closed:
                    return i
                self.course.end = at_corner(corner_of(self.course.s, self.course.last_face(), v))
                self.length += self.course.settle()
                self.course.emit()
                self.course.begin(f, at_corner(corner_of(self.course.s, f, v)))
        self.course.end = end
        return -1
