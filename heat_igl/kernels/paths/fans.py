"""Straight lines from the bends of a path to later ones: shortcuts that pass several vertices on their other sides."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.fans import GAIN_OF_LINE, HALF_FAN, SPACING, Line
from cython.cimports.heat_igl.kernels.paths.passing import Saved
from cython.cimports.heat_igl.kernels.paths.straightening import Course
from cython.cimports.heat_igl.kernels.paths.surfaces import Place, corner_of, only_corner
from cython.cimports.libc.math import atan2, ceil, cos, hypot, sin

__all__ = ["Fan"]


@cython.final
@cython.cclass
class Fan:
    """Shortcuts of the path of a course along straight lines that leave near the path, on oriented manifolds.

    From each bend some lines are followed that leave within `HALF_FAN` of the path. Where one passes a face at a later
    bend or at the end, and the way there is shorter in the plane, it replaces the path in between if both ways are of
    one class. `ahead` (3 m,) are the faces behind all half-edges, empty for no shortcuts; `letter` (3 m,) tells classes
    apart, empty if all are the same.
    """

    def __init__(self, course: Course, n_vertices, ahead, letter):
        self.course, self.kept = course, Saved()
        self.s, self.strip, self.layout = course.s, course.strip, course.layout
        self.ahead, self.letter, self.word = ahead, letter, np.empty(64, np.int32)
        self.bend_at, self.remaining = np.full(n_vertices, -1, np.int32), np.empty(64)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-2, check=False)
    def shorten(self, begin: cython.int, end: cython.pointer[cython.const[Place]]) -> cython.int:
        """Lead the strip of a settled path along a line from bend `begin` or a later one; keep the path before.

        Returns the bend, -1 if no line promises to be shorter. The promise may be wrong. `end` is the end of the path
        in the last face, where it stays.
        """
        n: cython.int = self.layout.n_bends
        i: cython.int
        if self.ahead.shape[0] == 0:
            return -1
        if self.remaining.shape[0] < n:
            with cython.gil:
                self.remaining = np.empty(2 * n)
        self.remaining[n - 1] = 0.0
        for i in range(n - 2, -1, -1):
            p = cython.address(self.layout.bend[i])
            q = cython.address(self.layout.bend[i + 1])
            self.remaining[i] = self.remaining[i + 1] + hypot(q.x - p.x, q.y - p.y)
        self.kept.save(self.course)
        self.end, self.end_face = end[0], self.course.last_face()
        c: cython.int = only_corner(end)
        self.end_vertex = self.s.triangle[self.end_face].vertex[c] if c >= 0 else -1
        self.mark(n, True)
        found: cython.int = -1
        for i in range(begin, n - 1):
            self.look(i)
            if self.goal < 0:
                continue
            if self.replace(i) and self.keeps_class():
                found = i
                break
            self.kept.restore(self.course)
        self.mark(n, False)
        return found

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def mark(self, n: cython.int, is_marked: cython.bint) -> cython.void:
        """Note the numbers of the bends at their vertices, or forget them."""
        i: cython.int
        for i in range(1, n - 1):
            bend = cython.address(self.layout.bend[i])
            self.bend_at[self.layout.gate[bend.last].vertex[bend.side]] = i if is_marked else -1
        if self.end_vertex >= 0:
            self.bend_at[self.end_vertex] = n - 1 if is_marked else -1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def look(self, i: cython.int) -> cython.int:
        """Find the best line from bend i, out of the faces around its vertex near the path."""
        self.goal, self.saved = -1, GAIN_OF_LINE * self.remaining[0]
        p = cython.address(self.layout.bend[i])
        dx: cython.double = self.layout.bend[i + 1].x - p.x
        dy: cython.double = self.layout.bend[i + 1].y - p.y
        f: cython.int = self.course.face
        v: cython.int = self.course.vertex
        c: cython.int
        x: cython.double
        y: cython.double
        if i == 0:
            if v < 0:
                return 0
            c = corner_of(self.s, f, v)
            x, y = self.layout.first.x[(c + 1) % 3] - p.x, self.layout.first.y[(c + 1) % 3] - p.y
        else:
            gate = cython.address(self.layout.gate[p.last])
            f = self.strip.crossing[p.last].enter // 3
            c = corner_of(self.s, f, gate.vertex[p.side])
            x, y = gate.x[1 - p.side] - p.x, gate.y[1 - p.side] - p.y
        right: cython.double = atan2(dx * y - dy * x, dx * x + dy * y)
        if i > 0 and p.side == 1:
            # That is the left corner.
            right -= self.s.triangle[f].angle[c]
        # No closer than the edges at the end of the path.
        spacing: cython.double = max(SPACING / self.most, 1.0 / (self.strip.count - (p.last if i > 0 else 0) + 1))
        self.spread(i, f, c, right, spacing)
        out: cython.int = c
        h: cython.int = self.across(3 * f + (c + 1) % 3)
        angle: cython.double = right + self.s.triangle[f].angle[c]
        while h >= 0 and h // 3 != f and angle < HALF_FAN:
            # To the left, counterclockwise: the vertex is on the left of the edge.
            c = (h + 1) % 3
            self.spread(i, h // 3, c, angle, spacing)
            angle += self.s.triangle[h // 3].angle[c]
            h = self.across(3 * (h // 3) + (c + 1) % 3)
        h = self.across(3 * f + (out + 2) % 3)
        while h >= 0 and h // 3 != f and right > -HALF_FAN:
            c = (h + 2) % 3
            right -= self.s.triangle[h // 3].angle[c]
            self.spread(i, h // 3, c, right, spacing)
            h = self.across(3 * (h // 3) + (c + 2) % 3)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def spread(
        self, i: cython.int, f: cython.int, c: cython.int, right: cython.double, spacing: cython.double
    ) -> cython.int:
        """Follow lines from corner c of face f; its right corner is at the angle `right` from the path."""
        t = cython.address(self.s.triangle[f])
        left: cython.double = right + t.angle[c]
        line: Line
        line.face, line.corner, line.right, line.angle = f, c, right, right
        self.aim(i, self.bend_at[t.vertex[(c + 1) % 3]], t.length[(c + 2) % 3], cython.address(line), 0)
        self.aim(i, self.bend_at[t.vertex[(c + 2) % 3]], t.length[(c + 1) % 3], cython.address(line), 0)
        k: cython.int = cython.cast(cython.int, ceil(max(right, -HALF_FAN) / spacing))
        while k * spacing < min(left, HALF_FAN):
            line.angle = k * spacing
            if k != 0 and line.angle > right:
                self.follow(i, cython.address(line), -1)
            k += 1
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def across(self, h: cython.int) -> cython.int:
        """The half-edge on the other side of an edge, -1 on the boundary."""
        edge: cython.int = self.s.triangle[h // 3].edge[h % 3]
        first: cython.int = self.s.first_side[edge]
        if self.s.first_side[edge + 1] != first + 2:
            return -1
        return self.s.side[first] + self.s.side[first + 1] - h

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def follow(self, i: cython.int, line: cython.pointer[cython.const[Line]], n_steps: cython.int) -> cython.int:
        """Follow a line from bend i and aim at the bends that it passes; or push its first `n_steps` crossings."""
        t = cython.address(self.s.triangle[line.face])
        c: cython.int = line.corner
        # Both ends of the next edge, in the plane in which the line is the x axis.
        at: cython.double = line.right - line.angle
        rx: cython.double = t.length[(c + 2) % 3] * cos(at)
        ry: cython.double = t.length[(c + 2) % 3] * sin(at)
        lx: cython.double = t.length[(c + 1) % 3] * cos(at + t.angle[c])
        ly: cython.double = t.length[(c + 1) % 3] * sin(at + t.angle[c])
        h: cython.int = self.across(3 * line.face + c)
        reach: cython.double = min(self.remaining[i], self.most * self.remaining[0])
        # Each step would load the views anew.
        table = cython.address(self.ahead[0])
        bend_at = cython.address(self.bend_at[0])
        ends_inside: cython.bint = self.end_vertex < 0
        step: cython.int = 0
        while h >= 0 and step != n_steps and (lx < reach or rx < reach):
            step += 1
            if n_steps >= 0:
                self.strip.push(self.across(h), h)
            ahead = table + h
            x: cython.double = rx + ahead.along * (lx - rx) + ahead.above * (ly - ry)
            y: cython.double = ry + ahead.along * (ly - ry) - ahead.above * (lx - rx)
            if bend_at[ahead.vertex] > i:
                self.aim(i, bend_at[ahead.vertex], hypot(x, y), line, step)
            if ends_inside and h // 3 == self.end_face:
                end = cython.address(self.end)
                along: cython.double = end.c[(h + 1) % 3] * lx + end.c[(h + 2) % 3] * rx + end.c[h % 3] * x
                beside: cython.double = end.c[(h + 1) % 3] * ly + end.c[(h + 2) % 3] * ry + end.c[h % 3] * y
                self.aim(i, self.layout.n_bends - 1, hypot(along, beside), line, step)
            if y > 0.0:
                lx, ly, h = x, y, ahead.after[1]
            else:
                rx, ry, h = x, y, ahead.after[0]
        return step

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def aim(
        self,
        i: cython.int,
        bend: cython.int,
        distance: cython.double,
        line: cython.pointer[cython.const[Line]],
        step: cython.int,
    ) -> cython.void:
        """Take the way from bend i to another one along a line, after so many edges, if it saves most so far."""
        if bend <= i:
            return
        saved: cython.double = self.remaining[i] - self.remaining[bend] - distance
        if saved > self.saved:
            self.saved, self.goal, self.best, self.n_steps = saved, bend, line[0], step

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def replace(self, i: cython.int) -> cython.bint:
        """Lead the strip along the best line, from bend i; False if no faces lead there."""
        first: cython.int = 0
        last: cython.int = self.kept.strip.count - 1
        v: cython.int = self.course.vertex
        to: cython.int = self.end_vertex
        onto: cython.int = self.end_face
        j: cython.int
        if i > 0:
            bend = cython.address(self.layout.bend[i])
            first = bend.first
            v = self.layout.gate[bend.last].vertex[bend.side]
        if self.goal < self.layout.n_bends - 1:
            bend = cython.address(self.layout.bend[self.goal])
            last = bend.last
            to = self.layout.gate[last].vertex[bend.side]
            onto = self.kept.strip.crossing[last].enter // 3
        self.strip.count = 0
        for j in range(first):
            self.strip.push(self.kept.strip.crossing[j].leave, self.kept.strip.crossing[j].enter)
        if not self.course.turn(v, self.course.last_face(), self.best.face, -1):
            return False
        self.follow(i, cython.address(self.best), self.n_steps)
        if to >= 0 and not self.course.turn(to, self.course.last_face(), onto, -1):
            return False
        for j in range(last + 1, self.kept.strip.count):
            self.strip.push(self.kept.strip.crossing[j].leave, self.kept.strip.crossing[j].enter)
        return True

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def keeps_class(self) -> cython.bint:
        """Whether the word of the strip, and then back along the one before, cancels."""
        if self.letter.shape[0] == 0:
            return True
        count: cython.int = self.strip.count
        total: cython.int = count + self.kept.strip.count
        j: cython.int
        n: cython.int = 0
        if self.word.shape[0] < total:
            with cython.gil:
                self.word = np.empty(2 * total, np.int32)
        for j in range(total):
            h: cython.int = self.strip.crossing[j].leave if j < count else self.kept.strip.crossing[total - 1 - j].enter
            a: cython.int = self.letter[h]
            if a == 0:
                continue
            if n > 0 and self.word[n - 1] == -a:
                n -= 1
            else:
                self.word[n] = a
                n += 1
        return n == 0
