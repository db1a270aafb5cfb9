"""Curves shortened within their class: open ones between fixed ends, loops as a whole."""

import cython
from cython.cimports.heat_igl.kernels.paths.loops import Loop
from cython.cimports.heat_igl.kernels.paths.passing import LARGEST_LOSS
from cython.cimports.heat_igl.kernels.paths.polylines import Polyline
from cython.cimports.heat_igl.kernels.paths.settled_paths import SettledPath
from cython.cimports.heat_igl.kernels.paths.straightening import Course
from cython.cimports.heat_igl.kernels.paths.surfaces import Place, Surface

__all__ = ["Shortener"]


@cython.final
@cython.cclass
class Shortener:
    """Shortens curves on one surface, one after another; see `heat_igl.curves.shortening.Shortener`."""

    course: Course
    path: SettledPath
    polyline: Polyline
    loop: Loop
    length: cython.double

    def __init__(self, surface, half_turn, most_corners, directions):
        self.course = Course(Surface(surface), most_corners)
        self.path = SettledPath(self.course, half_turn)
        self.polyline = Polyline(self.course, *directions)
        self.loop = Loop(self.path, self.polyline)

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
        with cython.nogil:
            stuck = self.follow(face, join, ends, is_closed)
            if stuck < 0:
                if is_closed:
                    self.length += self.loop.shorten()
                else:
                    self.length += self.path.pass_better(self.path.settle())
                self.course.emit(cython.address(self.path.end))
        return stuck, self.length, *self.course.segments()

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
        self.length = 0.0
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
                self.length += self.course.straighten(v)
                self.course.begin(f, v, cython.address(x))
        return -1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def turn(self, v: cython.int, f: cython.int) -> cython.bint:
        """Lead the strip around v to face f, the shorter way; False if the faces around v do not lead there."""
        if self.polyline.is_oriented:
            return self.polyline.lead(v, self.course.last_face(), f)
        return self.course.turn(v, self.course.last_face(), f) == 1
