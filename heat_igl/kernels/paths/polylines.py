"""Loops as polylines: vertices with straight parts between them, shortened at one vertex after another.

Where the parts at a joint have an angle below pi on one side, a funnel finds the shortest path between the joints
before and after it in the strip that passes the joint on this side. The smallest angle comes first, as for flips of
edges (Sharp and Crane 2020). Each step looks at a few faces only, and there is no fixed point on the loop.
"""

import cython
from cython.cimports.heat_igl.kernels.paths.funnels import Layout
from cython.cimports.heat_igl.kernels.paths.joints import Joints
from cython.cimports.heat_igl.kernels.paths.polylines import GAIN_OF_PART, SAME_ANGLE
from cython.cimports.heat_igl.kernels.paths.straightening import Course
from cython.cimports.heat_igl.kernels.paths.strips import Strip
from cython.cimports.heat_igl.kernels.paths.surfaces import Place, at_corner, corner_of
from cython.cimports.libc.math import INFINITY, atan2, hypot

__all__ = ["Polyline"]


@cython.final
@cython.cclass
class Polyline:
    """The loop of a course on an oriented manifold, as joints with straight parts between them.

    `polar` (3 m,) is the angle of each corner's right side around its vertex, counterclockwise; `total` (n,) the sum of
    the angles, negative on the boundary; `across` (3 m,) the half-edge on the other side, -1 for none. All are empty
    if the surface is not an oriented manifold: then nothing may be read.
    """

    def __init__(self, course: Course, polar, total, across):
        self.course, self.s = course, course.s
        self.polar, self.across = polar, across
        self.is_oriented = len(polar) > 0
        self.joints, self.strip, self.layout = Joints(total), Strip(), Layout()

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def read(self) -> cython.bint:
        """Take the base of the loop of a course, a vertex, and the bends as joints; False if there are no bends."""
        n: cython.int = self.course.layout.n_bends - 1
        i: cython.int
        j: cython.int
        after: cython.int
        if n < 2:
            return False
        self.joints.clear(n)
        # Joint 0 is the base, and joint i is at bend i.
        self.joints.make(self.course.vertex)
        for i in range(1, n):
            bend = cython.address(self.course.layout.bend[i])
            self.joints.make(self.course.layout.gate[bend.last].vertex[bend.side])
        for i in range(n):
            bend = cython.address(self.course.layout.bend[i])
            self.face = self.course.strip.crossing[bend.last].enter // 3 if i > 0 else self.course.face
            self.strip.count = 0
            for j in range(bend.last + 1, self.course.layout.bend[i + 1].first):
                self.strip.push(self.course.strip.crossing[j].leave, self.course.strip.crossing[j].enter)
            after = i + 1 if i < n - 1 else 0
            self.trim(self.joints.joint[i].vertex, self.joints.joint[after].vertex)
            if not self.lay_out(self.joints.joint[i].vertex, self.joints.joint[after].vertex) > 0.0:
                return False
            self.link(i, after)
        for i in range(n):
            self.joints.check(i)
        return True

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def relax(self) -> cython.int:
        """Shorten the loop at its joints until no angle is below pi, or one joint is left."""
        while self.joints.count > 1:
            k: cython.int = self.joints.sharpest()
            if k < 0:
                return 0
            self.shorten(k)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def shorten(self, k: cython.int) -> cython.int:
        """Lead the loop past joint k on the side of the smaller angle, if that makes it shorter."""
        p: cython.int = self.joints.joint[k].before
        q: cython.int = self.joints.joint[k].after
        v: cython.int = self.joints.joint[p].vertex
        w: cython.int = self.joints.joint[q].vertex
        on_left: cython.bint = False
        angle: cython.double = self.joints.angle(k, cython.address(on_left))
        self.face, self.strip.count = self.joints.joint[p].face, 0
        self.joints.push(p, self.strip)
        n: cython.int = self.strip.count
        f: cython.int = self.last_face()
        goal: cython.int = self.joints.joint[k].face
        if not self.turn(self.strip, self.joints.joint[k].vertex, f, goal, on_left, angle):
            # On a spur, rounding decides which side has the smaller angle, and no faces may lie on the other one.
            self.strip.count = n
            if not self.turn(self.strip, self.joints.joint[k].vertex, f, goal, not on_left, angle):
                return 0
        self.joints.push(k, self.strip)
        self.trim(v, w)
        if self.strip.count == 0 and v == w:
            if self.joints.remove_spur(p, k, q):
                self.joints.joint[p].face = self.face
            return 1
        length: cython.double = self.joints.joint[p].length + self.joints.joint[k].length
        if not self.lay_out(v, w) < length * (1.0 - GAIN_OF_PART) or self.layout.n_bends - 2 > self.joints.n_free:
            return 0
        self.joints.remove(k)
        self.link(p, q)
        self.joints.check(p)
        k = self.joints.joint[p].after
        while k != q:
            self.joints.check(k)
            k = self.joints.joint[k].after
        self.joints.check(q)
        return 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def turn(
        self, strip: Strip, v: cython.int, f: cython.int, goal: cython.int, on_left: cython.bint, angle: cython.double
    ) -> cython.bint:
        """Lead a strip around v from face f to face `goal`; False if the faces between span more than `angle`.

        The faces on the left of a path, which `on_left` takes, follow one another clockwise.
        """
        between: cython.double = 0.0
        while f != goal:
            leave: cython.int = 3 * f + (corner_of(self.s, f, v) + (2 if on_left else 1)) % 3
            enter: cython.int = self.across[leave]
            if enter < 0:
                return False
            strip.push(leave, enter)
            f = enter // 3
            if f != goal:
                between += self.s.triangle[f].angle[corner_of(self.s, f, v)]
                if between > angle + SAME_ANGLE:
                    return False
        return True

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def lay_out(self, v: cython.int, w: cython.int) -> cython.double:
        """Find the shortest path in the strip, which is trimmed, from vertex v to vertex w; returns the length."""
        start: Place = at_corner(corner_of(self.s, self.face, v))
        self.layout.lay_out(self.s, self.face, cython.address(start), self.strip)
        c: cython.int = corner_of(self.s, self.last_face(), w)
        self.layout.pull_tight(self.layout.last.x[c], self.layout.last.y[c])
        return self.layout.length()

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def link(self, a: cython.int, b: cython.int) -> cython.int:
        """Make the path that is laid out the way from joint a to joint b, with new joints at the bends."""
        n: cython.int = self.layout.n_bends
        begin: cython.int = 0
        f: cython.int = self.face
        i: cython.int
        for i in range(1, n):
            bend = cython.address(self.layout.bend[i])
            k: cython.int = b if i == n - 1 else self.joints.make(self.layout.gate[bend.last].vertex[bend.side])
            self.joints.joint[a].after, self.joints.joint[k].before = k, a
            self.set_part(a, f, begin, bend.first, i)
            if i < n - 1:
                begin, f = bend.last + 1, self.strip.crossing[bend.last].enter // 3
            a = k
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def set_part(self, a: cython.int, f: cython.int, begin: cython.int, end: cython.int, i: cython.int) -> cython.int:
        """Make the part after joint a the line to bend i of the layout: crossings `begin` to `end`, out of face f."""
        joint = cython.address(self.joints.joint[a])
        p = cython.address(self.layout.bend[i - 1])
        q = cython.address(self.layout.bend[i])
        dx: cython.double = q.x - p.x
        dy: cython.double = q.y - p.y
        c: cython.int = corner_of(self.s, f, joint.vertex)
        joint.face, joint.length = f, hypot(dx, dy)
        self.joints.set_crossings(a, self.strip, begin, max(begin, end))
        if joint.count == 0:
            # An edge of face f.
            t = cython.address(self.s.triangle[f])
            e: cython.int = corner_of(self.s, f, self.joints.joint[joint.after].vertex)
            joint.leave = self.polar[3 * f + c] + (0.0 if e == (c + 1) % 3 else t.angle[c])
            joint.arrive = self.polar[3 * f + e] + (0.0 if c == (e + 1) % 3 else t.angle[e])
            return 0
        # Seen from the start the right end of the first crossing is on the right, and from the end the left one.
        gate = cython.address(self.layout.gate[begin])
        angle: cython.double = _left_of(gate.x[1] - p.x, gate.y[1] - p.y, dx, dy)
        joint.leave = self.polar[3 * f + c] + min(angle, self.s.triangle[f].angle[c])
        gate = cython.address(self.layout.gate[end - 1])
        h: cython.int = self.strip.crossing[end - 1].enter
        angle = _left_of(gate.x[0] - q.x, gate.y[0] - q.y, -dx, -dy)
        joint.arrive = self.polar[h] + min(angle, self.s.triangle[h // 3].angle[h % 3])
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def trim(self, v: cython.int, w: cython.int) -> cython.void:
        """Drop crossings at vertex v from the start of the strip, and crossings at vertex w from the end."""
        n_dropped: cython.int = 0
        while n_dropped < self.strip.count:
            h: cython.int = self.strip.crossing[n_dropped].leave
            if self.s.triangle[h // 3].vertex[h % 3] == v:
                break
            self.face = self.strip.crossing[n_dropped].enter // 3
            n_dropped += 1
        self.strip.drop(n_dropped)
        while self.strip.count > 0:
            g: cython.int = self.strip.crossing[self.strip.count - 1].enter
            if self.s.triangle[g // 3].vertex[g % 3] == w:
                break
            self.strip.count -= 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def write(self) -> cython.int:
        """Make the loop the strip of the course, based at a joint."""
        k: cython.int = self.joints.some
        f: cython.int = self.joints.joint[k].face
        start: Place = at_corner(corner_of(self.s, f, self.joints.joint[k].vertex))
        self.course.begin(f, self.joints.joint[k].vertex, cython.address(start))
        while True:
            self.joints.push(k, self.course.strip)
            k = self.joints.joint[k].after
            if k == self.joints.some:
                return 0
            self.lead(self.joints.joint[k].vertex, self.course.last_face(), self.joints.joint[k].face)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def lead(self, v: cython.int, f: cython.int, goal: cython.int) -> cython.bint:
        """Lead the strip of the course around v from face f to face `goal`, the shorter way; False if there is none."""
        total: cython.double = self.joints.total[v]
        left: cython.double = self.polar[3 * f + corner_of(self.s, f, v)]
        left -= self.polar[3 * goal + corner_of(self.s, goal, v)]
        if total > 0.0 and left < 0.0:
            left += total
        on_left: cython.bint = left < 0.5 * total if total > 0.0 else left > 0.0
        return self.turn(self.course.strip, v, f, goal, on_left, INFINITY)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def last_face(self) -> cython.int:
        """The face in which the part that is made ends."""
        n: cython.int = self.strip.count
        if n == 0:
            return self.face
        return self.strip.crossing[n - 1].enter // 3


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _left_of(ax: cython.double, ay: cython.double, bx: cython.double, by: cython.double) -> cython.double:
    """Angle from direction a counterclockwise to direction b, at least 0."""
    return max(atan2(ax * by - ay * bx, ax * bx + ay * by), 0.0)
