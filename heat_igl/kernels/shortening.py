"""Curves shortened within their class: open ones between fixed ends, loops as a whole.

A loop is straightened as a path from a point of it to itself, the base, which is then moved: to a vertex at which the
path bends, or else to an edge that it crosses, along which it slides to where the loop is shortest. The length falls
with every such step unless the loop is locally shortest at the base too.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.fans import Fan
from cython.cimports.heat_igl.kernels.passing import LARGEST_LOSS, Passing, Saved, copy
from cython.cimports.heat_igl.kernels.shortening import BOTH_WAYS, GAIN, MOST_BASES, SAME_LENGTH
from cython.cimports.heat_igl.kernels.straightening import Course
from cython.cimports.heat_igl.kernels.surfaces import SNAP, Place, Surface, corner_of, only_corner, side_of
from cython.cimports.libc.math import INFINITY, fabs, sqrt

__all__ = ["Shortener"]


@cython.final
@cython.cclass
class Shortener:
    """Shortens curves on one surface, one after another; see `heat_igl.curves.shortening.Shortener`."""

    course: Course
    passing: Passing
    fan: Fan
    one: Saved
    two: Saved
    n_parts: cython.int  # of a path that vertices alone hold together; all but the last are done
    length: cython.double
    end: Place  # where the curve ends in the last face; for a loop, the start there

    def __init__(self, surface, half_turn, most_corners, ahead, letter):
        self.course = Course(Surface(surface, np.empty(0)), most_corners)
        self.passing = Passing(self.course, half_turn)
        self.fan = Fan(self.course, len(half_turn), ahead, letter)
        self.one, self.two = Saved(), Saved()

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
        stuck: cython.int
        # A loop is straightened from many bases.
        self.passing.largest_loss = 0.0 if is_closed else LARGEST_LOSS
        self.fan.most = 0.5 if is_closed else 1.0
        with cython.nogil:
            stuck = self.follow(face, join, ends, is_closed)
            if stuck < 0:
                self.length += self.tighten() if is_closed else self.shortcut(self.pass_better(self.settle()))
                self.course.emit(cython.address(self.end))
        return stuck, self.length, *self.course.segments()

    def shorter(
        self,
        face: cython.const[cython.int][::1],
        join: cython.const[cython.int][:, ::1],
        other_face: cython.const[cython.int][::1],
        other_join: cython.const[cython.int][:, ::1],
        ends: cython.const[cython.double][:, ::1],
    ):
        """The shorter of the shortest paths of two courses with the same ends, as `shorten` returns it.

        None if vertices alone hold one of them together.
        """
        self.passing.largest_loss = LARGEST_LOSS
        self.fan.most = 1.0
        with cython.nogil:
            self.follow(face, join, ends, False)
            plain: cython.double = self.settle()
            is_split: cython.bint = self.n_parts > 1
            self.one.save(self.course)
            end: Place = self.end
            self.follow(other_face, other_join, ends, False)
            if not is_split and self.n_parts == 1:
                self.length = self.shortcut(self.choose(plain, end, self.settle()))
                self.course.emit(cython.address(self.end))
            else:
                is_split = True
        return None if is_split else (-1, self.length, *self.course.segments())

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def choose(self, plain: cython.double, end: Place, length: cython.double) -> cython.double:
        """Lead a settled path past better sides, and so the one that was saved, if it is another; keep the shorter."""
        is_same: cython.bint = fabs(plain - length) <= SAME_LENGTH * plain
        length = self.pass_better(length)
        if is_same:
            return length
        self.two.save(self.course)
        other_end: Place = self.end
        self.one.restore(self.course)
        self.end = end
        plain = self.pass_better(self.settle())
        if plain <= length:
            return plain
        self.two.restore(self.course)
        self.end = other_end
        return self.settle()

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-2, check=False)
    def follow(
        self,
        face: cython.const[cython.int][::1],
        join: cython.const[cython.int][:, ::1],
        ends: cython.const[cython.double][:, ::1],
        is_closed: cython.bint,
    ) -> cython.int:
        """Make the strip of a course; -1, or the join at which a loop is stuck."""
        x: Place
        c: cython.int
        i: cython.int
        self.course.n_segments = 0
        self.length, self.n_parts = 0.0, 1
        for c in range(3):
            x.c[c], self.end.c[c] = ends[0, c], ends[1, c]
        self.course.begin(face[0], self.vertex_at(face[0], cython.address(x)), cython.address(x))
        for i in range(join.shape[0]):
            v: cython.int = join[i, 2]
            f: cython.int = face[i + 1 if i + 1 < face.shape[0] else 0]
            if join[i, 0] >= 0:
                self.course.strip.push(join[i, 0], join[i, 1])
            elif v >= 0 and not self.course.turn(v, self.course.last_face(), f, -1):
                # Only this vertex joins the two faces.
                if is_closed:
                    return i
                self.length += self.course.straighten(v, cython.NULL)
                self.course.begin(f, v, cython.address(x))
                self.n_parts += 1
        return -1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def settle(self) -> cython.double:
        """Lead the strip until the path to `end` is locally shortest; returns the length."""
        v: cython.int = self.vertex_at(self.course.last_face(), cython.address(self.end))
        ends: Place[2]
        ends[0] = ends[1] = self.end
        return self.course.settle(v, ends, cython.address(self.end))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def pass_better(self, length: cython.double) -> cython.double:
        """Lead a settled path past vertices on the other side while that makes it shorter; returns the length."""
        i: cython.int
        self.passing.n_tried = 0
        is_better: cython.bint = True
        while is_better and self.passing.propose() > 0:
            end: Place = self.end
            is_better = False
            for i in range(self.passing.count):
                if not self.passing.lead(i):
                    continue
                self.end = end
                trial: cython.double = self.settle()
                if trial < length * (1.0 - GAIN):
                    length = trial
                    is_better = True
                    break
            if not is_better:
                self.passing.kept.restore(self.course)
                self.end = end
                self.settle()
        return length

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def shortcut(self, length: cython.double) -> cython.double:
        """Take shortcuts along straight lines, and better sides from there, while there are any; returns the length."""
        i: cython.int = 0
        while True:
            end: Place = self.end
            i = self.fan.shorten(i, cython.address(self.end))
            if i < 0:
                return length
            trial: cython.double = self.settle()
            if trial < length * (1.0 - GAIN):
                length = self.pass_better(trial)
            else:
                self.fan.kept.restore(self.course)
                self.end = end
                self.settle()
                i += 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def vertex_at(self, f: cython.int, x: cython.pointer[cython.const[Place]]) -> cython.int:
        """The vertex at place x of face f, -1 if there is none."""
        c: cython.int = only_corner(x)
        return self.course.s.triangle[f].vertex[c] if c >= 0 else -1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def tighten(self) -> cython.double:
        """Lead the strip of a loop to the shortest loop of its class; returns the length."""
        shortest: cython.double = INFINITY
        n_stalled: cython.int = 0
        length: cython.double = 0.0
        for _ in range(MOST_BASES):
            length = self.settle()
            if self.slide(length):
                length = self.settle()
            if not length < shortest * (1.0 - GAIN):
                length = self.pass_better(length)
            # One more base shows whether the loop is straight at the one before.
            n_stalled = 0 if length < shortest * (1.0 - GAIN) else n_stalled + 1
            if n_stalled == BOTH_WAYS:
                length = self.shortcut(length)
                if not length < shortest * (1.0 - GAIN):
                    break
                n_stalled = 0
            shortest = min(shortest, length)
            if self.course.strip.count == 0 or not self.move_base():
                break
        return length

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def slide(self, length: cython.double) -> cython.int:
        """Move a base on an edge to where a loop without a bend is shortest; 0 if it stays."""
        side: cython.int = side_of(cython.address(self.course.start))
        if self.course.vertex >= 0 or side < 0 or self.course.layout.n_bends > 2:
            return 0
        f: cython.int = self.course.face
        g: cython.int = self.course.last_face()
        t = cython.address(self.course.s.triangle[f])
        a: cython.int = (side + 1) % 3
        b: cython.int = (side + 2) % 3
        a_end: cython.int = corner_of(self.course.s, g, t.vertex[a])
        b_end: cython.int = corner_of(self.course.s, g, t.vertex[b])
        if a_end < 0 or b_end < 0:
            return 0
        p = cython.address(self.course.layout.first)
        q = cython.address(self.course.layout.last)
        # From the base to the end of the loop, as the base moves from a to b: d + share e.
        dx: cython.double = q.x[a_end] - p.x[a]
        dy: cython.double = q.y[a_end] - p.y[a]
        ex: cython.double = q.x[b_end] - p.x[b] - dx
        ey: cython.double = q.y[b_end] - p.y[b] - dy
        squared: cython.double = ex * ex + ey * ey
        if not squared > 0.0:
            return 0
        share: cython.double = min(max(-(dx * ex + dy * ey) / squared, 0.0), 1.0)
        dx += share * ex
        dy += share * ey
        if not sqrt(dx * dx + dy * dy) < length * (1.0 - GAIN):
            return 0
        self.place_base(f, a, b, a_end, b_end, share)
        return 1

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
            self.course.start.c[c] = self.end.c[c] = 0.0
        if share < SNAP:
            share = 0.0
        elif share > 1.0 - SNAP:
            share = 1.0
        self.course.start.c[a] = self.end.c[a_end] = 1.0 - share
        self.course.start.c[b] = self.end.c[b_end] = share
        self.course.face = f
        self.course.vertex = self.vertex_at(f, cython.address(self.course.start))

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
            return self.course.turn(self.course.vertex, f, self.course.face, -1)
        self.course.strip.push(
            3 * f + side_of(cython.address(self.end)), 3 * self.course.face + side_of(cython.address(self.course.start))
        )
        return 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def turn_ring(self, at: cython.int) -> cython.int:
        """Make the strip begin after the crossing `at` and end before it."""
        j: cython.int
        copy(self.course.strip, self.one.strip)
        self.course.strip.count = 0
        for j in range(at + 1, self.one.strip.count):
            self.course.strip.push(self.one.strip.crossing[j].leave, self.one.strip.crossing[j].enter)
        for j in range(at):
            self.course.strip.push(self.one.strip.crossing[j].leave, self.one.strip.crossing[j].enter)
        return 0
