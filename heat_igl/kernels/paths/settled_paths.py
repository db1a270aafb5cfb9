"""A path made locally shortest in its class: settled in its strip, and led past vertices on the other side."""

import cython
from cython.cimports.heat_igl.kernels.paths.passing import Passing
from cython.cimports.heat_igl.kernels.paths.settled_paths import GAIN
from cython.cimports.heat_igl.kernels.paths.straightening import Course
from cython.cimports.heat_igl.kernels.paths.surfaces import Place, only_corner

__all__ = ["SettledPath"]


@cython.final
@cython.cclass
class SettledPath:
    """The path of a course from its start to `end`, a place in the last face."""

    def __init__(self, course: Course, half_turn):
        self.course = course
        self.passing = Passing(course, half_turn)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def settle(self) -> cython.double:
        """Lead the strip until the path to `end` is locally shortest; returns the length."""
        v: cython.int = self.vertex_at(self.course.last_face(), cython.address(self.end))
        return self.course.settle(v, cython.address(self.end))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def lay_out(self) -> cython.int:
        """Find the shortest path in the strip as it is."""
        v: cython.int = self.vertex_at(self.course.last_face(), cython.address(self.end))
        return self.course.lay_out(v, cython.address(self.end))

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
    @cython.exceptval(check=False)
    def vertex_at(self, f: cython.int, x: cython.pointer[cython.const[Place]]) -> cython.int:
        """The vertex at place x of face f, -1 if there is none."""
        c: cython.int = only_corner(x)
        return self.course.s.triangle[f].vertex[c] if c >= 0 else -1
