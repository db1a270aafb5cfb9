"""Straight lines from the bends of a path to later ones: shortcuts that pass several vertices on their other sides."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.fans import GAIN_OF_LINE, HALF_FAN, MOST_STEPS
from cython.cimports.heat_igl.kernels.passing import Saved
from cython.cimports.heat_igl.kernels.straightening import Course
from cython.cimports.heat_igl.kernels.surfaces import Place, corner_of
from cython.cimports.libc.math import atan2, ceil, cos, hypot, sin, sqrt

__all__ = ["Fan"]


@cython.final
@cython.cclass
class Fan:
    """Shortcuts of the path of a course along straight lines that leave near the path.

    From each bend all lines are followed that leave within `HALF_FAN` of the path, on both sides of all vertices that
    they pass. One that meets a later bend or the end on a shorter way replaces the path in between, if both ways are of
    one class. `letter` (3 m,) tells classes apart, see `heat_igl.curves.letters`.
    """

    def __init__(self, course: Course, n_vertices, letter, apex):
        self.course, self.kept = course, Saved()
        self.s, self.strip, self.layout = course.s, course.strip, course.layout
        self.bend_at, self.remaining = np.full(n_vertices, -1, np.int32), np.empty(64)
        self.apex = apex
        self.letter, self.word = letter, np.empty(64, np.int32)
        self.most_rays = 24.0
        self.half = HALF_FAN

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-2, check=False)
    def shorten(self, begin: cython.int, end: cython.pointer[cython.const[Place]]) -> cython.int:
        """Lead the strip of a settled path along a line from bend `begin` or a later one.

        Returns the bend, -1 if no line promises to be shorter; the length has to be seen, and `kept` is the path before.
        `end` is the end of the path in the last face, and stays.
        """
        n: cython.int = self.layout.n_bends
        i: cython.int
        if self.remaining.shape[0] < n:
            with cython.gil:
                self.remaining = np.empty(2 * n)
        self.remaining[n - 1] = 0.0
        for i in range(n - 2, -1, -1):
            p = cython.address(self.layout.bend[i])
            q = cython.address(self.layout.bend[i + 1])
            self.remaining[i] = self.remaining[i + 1] + hypot(q.x - p.x, q.y - p.y)
        self.end, self.end_face = end[0], self.course.last_face()
        self.is_inside = not (self.end.c[0] == 1.0 or self.end.c[1] == 1.0 or self.end.c[2] == 1.0)
        self.kept.save(self.course)
        self.mark(n, True)
        found: cython.int = -1
        for i in range(begin, n - 1):
            self.goal = -1
            self.saved = GAIN_OF_LINE * self.remaining[0]
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
        c: cython.int
        for i in range(1, n - 1):
            bend = cython.address(self.layout.bend[i])
            self.bend_at[self.layout.gate[bend.last].vertex[bend.side]] = i if is_marked else -1
        for c in range(3):
            if self.end.c[c] == 1.0:
                self.bend_at[self.s.triangle[self.end_face].vertex[c]] = n - 1 if is_marked else -1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def look(self, i: cython.int) -> cython.int:
        """Look for shortcuts from bend i: in the face into which the path leaves, and in those beside it around a vertex."""
        p = cython.address(self.layout.bend[i])
        dx: cython.double = self.layout.bend[i + 1].x - p.x
        dy: cython.double = self.layout.bend[i + 1].y - p.y
        v: cython.int = self.course.vertex
        f: cython.int = self.course.face
        r: cython.int
        x: cython.double
        y: cython.double
        self.spacing = max(self.half / self.most_rays, 1.0 / (self.strip.count - (p.last if i > 0 else 0) + 1))
        if i == 0:
            if v < 0:
                return 0
            r = (corner_of(self.s, f, v) + 1) % 3
            x, y = self.layout.first.x[r] - p.x, self.layout.first.y[r] - p.y
        else:
            gate = cython.address(self.layout.gate[p.last])
            v = gate.vertex[p.side]
            f = self.strip.crossing[p.last].enter // 3
            r = corner_of(self.s, f, gate.vertex[1 - p.side])
            x, y = gate.x[1 - p.side] - p.x, gate.y[1 - p.side] - p.y
        c: cython.int = corner_of(self.s, f, v)
        # The angle from the path to the right corner.
        beta: cython.double = atan2(dx * y - dy * x, dx * x + dy * y)
        if i > 0 and p.side == 1:
            # This is the left one.
            beta -= self.s.triangle[f].angle[c]
            r = 3 - c - r
        self.open(i, f, c, r, beta)
        turn: cython.int
        for turn in range(2):
            g: cython.int = f
            corner: cython.int = c
            right: cython.int = r
            angle: cython.double = beta
            while True:
                here = cython.address(self.s.triangle[g])
                if turn == 0:
                    angle += here.angle[corner]
                    if not angle < self.half:
                        break
                elif not angle > -self.half:
                    break
                # To the left across the edge opposite the right corner, and the other way round.
                left: cython.int = 3 - corner - right
                over: cython.int = self.across(3 * g + (right if turn == 0 else left))
                if over < 0 or over // 3 == f:
                    break
                shared: cython.int = here.vertex[left if turn == 0 else right]
                g = over // 3
                corner = corner_of(self.s, g, v)
                right = corner_of(self.s, g, shared)
                if turn == 1:
                    right = 3 - corner - right
                    angle -= self.s.triangle[g].angle[corner]
                self.open(i, g, corner, right, angle)
            return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def open(self, i: cython.int, f: cython.int, c: cython.int, r: cython.int, beta: cython.double) -> cython.int:
        """Follow lines from corner c of face f; its right corner r is at the angle beta from the path."""
        t = cython.address(self.s.triangle[f])
        left: cython.int = 3 - c - r
        gamma: cython.double = beta + t.angle[c]
        self.aim(i, self.bend_at[t.vertex[r]], t.length[left], f, c, 0.0, beta, 0, r)
        self.aim(i, self.bend_at[t.vertex[left]], t.length[r], f, c, 0.0, beta, 0, r)
        k: cython.int = cython.cast(cython.int, ceil(max(beta, -self.half) / self.spacing))
        while k * self.spacing < min(gamma, self.half):
            if k != 0 and k * self.spacing > beta:
                self.follow(i, f, c, r, beta, k * self.spacing, -1)
            k += 1
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def across(self, h: cython.int) -> cython.int:
        """The half-edge on the other side of an edge; -1 on the boundary, and if more than two faces meet there."""
        edge: cython.int = self.s.triangle[h // 3].edge[h % 3]
        first: cython.int = self.s.first_side[edge]
        if self.s.first_side[edge + 1] != first + 2:
            return -1
        return self.s.side[first] + self.s.side[first + 1] - h

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def follow(
        self,
        i: cython.int,
        f: cython.int,
        c: cython.int,
        r: cython.int,
        beta: cython.double,
        angle: cython.double,
        n_steps: cython.int,
    ) -> cython.int:
        """Follow a line from corner c of face f past corners of faces that are bends, or push so many of its crossings."""
        t = cython.address(self.s.triangle[f])
        left: cython.int = 3 - c - r
        # In the plane in which the line is the x axis.
        rx: cython.double = t.length[left] * cos(beta - angle)
        ry: cython.double = t.length[left] * sin(beta - angle)
        lx: cython.double = t.length[r] * cos(beta + t.angle[c] - angle)
        ly: cython.double = t.length[r] * sin(beta + t.angle[c] - angle)
        reach: cython.double = self.remaining[i]
        at_left: cython.int = t.vertex[left]
        h: cython.int = 3 * f + c
        step: cython.int = 0
        while step != n_steps and step < MOST_STEPS:
            enter: cython.int = self.across(h)
            if enter < 0 or (lx > reach and rx > reach):
                break
            step += 1
            if n_steps >= 0:
                self.strip.push(h, enter)
            g: cython.int = enter // 3
            e: cython.int = enter - 3 * g
            t = cython.address(self.s.triangle[g])
            left = corner_of(self.s, g, at_left)
            right: cython.int = 3 - e - left
            x: cython.double = self.apex[enter, 0]
            y: cython.double = self.apex[enter, 1]
            if right != (e + 1) % 3:
                x = 1.0 - x
            ux: cython.double = lx - rx
            uy: cython.double = ly - ry
            px: cython.double = rx + x * ux + y * uy
            py: cython.double = ry + x * uy - y * ux
            if n_steps < 0:
                v: cython.int = t.vertex[e]
                if self.bend_at[v] > i and px > 0.0:
                    self.aim(i, self.bend_at[v], sqrt(px * px + py * py), f, c, angle, beta, step, r)
                if g == self.end_face and self.is_inside:
                    end = cython.address(self.end)
                    qx: cython.double = end.c[left] * lx + end.c[right] * rx + end.c[e] * px
                    qy: cython.double = end.c[left] * ly + end.c[right] * ry + end.c[e] * py
                    self.aim(i, self.layout.n_bends - 1, sqrt(qx * qx + qy * qy), f, c, angle, beta, step, r)
            if py > 0.0:
                lx, ly, at_left = px, py, t.vertex[e]
                h = 3 * g + left
            else:
                rx, ry = px, py
                h = 3 * g + right
        return step

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def aim(
        self,
        i: cython.int,
        bend: cython.int,
        distance: cython.double,
        f: cython.int,
        c: cython.int,
        angle: cython.double,
        beta: cython.double,
        step: cython.int,
        r: cython.int,
    ) -> cython.void:
        """Take the way from bend i to another one along a line from corner c of face f, if it saves most so far."""
        if bend <= i:
            return
        saved: cython.double = self.remaining[i] - self.remaining[bend] - distance
        if saved > self.saved:
            self.saved, self.goal, self.first_face, self.corner = saved, bend, f, c
            self.right = r
            self.angle, self.beta, self.n_steps = angle, beta, step

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def replace(self, i: cython.int) -> cython.bint:
        """Lead the strip along the best line, from bend i; False if no faces lead there."""
        j: cython.int
        v: cython.int = (
            self.course.vertex
            if i == 0
            else self.layout.gate[self.layout.bend[i].last].vertex[self.layout.bend[i].side]
        )
        self.strip.count = 0
        for j in range(self.layout.bend[i].first if i > 0 else 0):
            self.strip.push(self.kept.strip.crossing[j].leave, self.kept.strip.crossing[j].enter)
        if not self.course.turn(v, self.course.last_face(), self.first_face, -1):
            return False
        self.follow(i, self.first_face, self.corner, self.right, self.beta, self.angle, self.n_steps)
        if self.goal == self.layout.n_bends - 1:
            for j in range(3):
                if self.end.c[j] == 1.0:
                    v = self.s.triangle[self.end_face].vertex[j]
                    return self.course.turn(v, self.course.last_face(), self.end_face, -1)
            return True
        last: cython.int = self.layout.bend[self.goal].last
        v = self.layout.gate[last].vertex[self.layout.bend[self.goal].side]
        if not self.course.turn(v, self.course.last_face(), self.kept.strip.crossing[last].enter // 3, -1):
            return False
        for j in range(last + 1, self.kept.strip.count):
            self.strip.push(self.kept.strip.crossing[j].leave, self.kept.strip.crossing[j].enter)
        return True

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def keeps_class(self) -> cython.bint:
        """Whether the word of the strip, and then back through the one before, cancels."""
        if self.letter.shape[0] == 0:
            return True
        j: cython.int
        a: cython.int
        n: cython.int = 0
        if self.word.shape[0] < self.strip.count + self.kept.strip.count:
            with cython.gil:
                self.word = np.empty(2 * (self.strip.count + self.kept.strip.count), np.int32)
        for j in range(self.strip.count + self.kept.strip.count):
            if j < self.strip.count:
                a = self.letter[self.strip.crossing[j].leave]
            else:
                a = self.letter[self.kept.strip.crossing[self.kept.strip.count - 1 - (j - self.strip.count)].enter]
            if a != 0 and n > 0 and self.word[n - 1] == -a:
                n -= 1
            elif a != 0:
                self.word[n] = a
                n += 1
        return n == 0
