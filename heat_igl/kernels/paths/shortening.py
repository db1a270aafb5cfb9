"""Curves shortened within their class: open ones between fixed ends, loops as a whole."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.loops import Loop
from cython.cimports.heat_igl.kernels.paths.passing import LARGEST_LOSS, Saved
from cython.cimports.heat_igl.kernels.paths.polylines import Polyline
from cython.cimports.heat_igl.kernels.paths.settled_paths import SAME_LENGTH, SettledPath
from cython.cimports.heat_igl.kernels.paths.straightening import Course
from cython.cimports.heat_igl.kernels.paths.surfaces import Place, Surface
from cython.cimports.libc.math import fabs

__all__ = ["Shortener"]


@cython.final
@cython.cclass
class Shortener:
    """Shortens curves on one surface, one after another; see `heat_igl.curves.shortening.Shortener`."""

    course: Course
    path: SettledPath
    polyline: Polyline
    loop: Loop
    one: Saved
    two: Saved
    n_parts: cython.int  # of a path that vertices alone hold together; all but the last are done
    length: cython.double

    def __init__(self, surface, half_turn, most_corners, shortcuts, directions):
        self.course = Course(Surface(surface, np.empty(0)), most_corners)
        self.path = SettledPath(self.course, half_turn, *shortcuts)
        self.polyline = Polyline(self.course, *directions)
        self.loop = Loop(self.path, self.polyline)
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
        self.path.passing.largest_loss = 0.0 if is_closed else LARGEST_LOSS
        self.path.fan.most = 0.5 if is_closed else 1.0
        with cython.nogil:
            stuck = self.follow(face, join, ends, is_closed)
            if stuck < 0:
                if is_closed:
                    self.length += self.loop.shorten()
                else:
                    self.length += self.path.shortcut(self.path.pass_better(self.path.settle()))
                self.course.emit(cython.address(self.path.end))
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
        self.path.passing.largest_loss = LARGEST_LOSS
        self.path.fan.most = 1.0
        with cython.nogil:
            self.follow(face, join, ends, False)
            plain: cython.double = self.path.settle()
            is_split: cython.bint = self.n_parts > 1
            self.one.save(self.course)
            end: Place = self.path.end
            self.follow(other_face, other_join, ends, False)
            if not is_split and self.n_parts == 1:
                self.length = self.path.shortcut(self.choose(plain, end, self.path.settle()))
                self.course.emit(cython.address(self.path.end))
            else:
                is_split = True
        return None if is_split else (-1, self.length, *self.course.segments())

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def choose(self, plain: cython.double, end: Place, length: cython.double) -> cython.double:
        """Lead a settled path past better sides, and so the one that was saved, if it is another; keep the shorter."""
        is_same: cython.bint = fabs(plain - length) <= SAME_LENGTH * plain
        length = self.path.pass_better(length)
        if is_same:
            return length
        self.two.save(self.course)
        other_end: Place = self.path.end
        self.one.restore(self.course)
        self.path.end = end
        plain = self.path.pass_better(self.path.settle())
        if plain <= length:
            return plain
        self.two.restore(self.course)
        self.path.end = other_end
        return self.path.settle()

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
            x.c[c], self.path.end.c[c] = ends[0, c], ends[1, c]
        self.course.begin(face[0], self.path.vertex_at(face[0], cython.address(x)), cython.address(x))
        for i in range(join.shape[0]):
            v: cython.int = join[i, 2]
            f: cython.int = face[i + 1 if i + 1 < face.shape[0] else 0]
            if join[i, 0] >= 0:
                self.course.strip.push(join[i, 0], join[i, 1])
            elif v >= 0 and not self.turn(v, f):
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
    def turn(self, v: cython.int, f: cython.int) -> cython.bint:
        """Lead the strip around v to face f, the shorter way; False if the faces around v do not lead there."""
        if self.polyline.is_oriented:
            return self.polyline.lead(v, self.course.last_face(), f)
        return self.course.turn(v, self.course.last_face(), f, -1) == 1
