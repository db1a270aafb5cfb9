"""Curves shortened within their class: open ones between fixed ends, loops as a whole.

On oriented manifolds a loop is first a polyline: joints, which are vertices, with straight parts between them. Where
the parts at a joint have an angle below pi on one side, a funnel finds the shortest path between the joints before and
after it in the strip that passes the joint on this side. The smallest angle comes first, as for flips of edges (Sharp
and Crane 2020). Each step looks at a few faces only, and there is no fixed point on the loop.

Then the loop is straightened as a path from a point of it to itself, the base, which is then moved: to a vertex at
which the path bends, or else to an edge that it crosses, along which it slides to where the loop is shortest. The
length falls with every such step unless the loop is locally shortest at the base too.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.shortening import (
    BOTH_WAYS,
    GAIN_OF_PART,
    MOST_BASES,
    SAME_ANGLE,
    SHORTEST_SLIDE,
)
from cython.cimports.heat_igl.kernels.paths.straightening import (
    GAIN,
    LARGEST_LOSS,
    NEARLY_STRAIGHT,
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
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.libc.math import INFINITY, M_PI, atan2, fabs, hypot, sqrt

_JOINT = np.dtype(
    [
        *((name, "f8") for name in ("length", "leave", "arrive")),
        *((name, "i4") for name in ("vertex", "face", "first", "count", "before", "after")),
    ],
    align=True,
)
_CROSSING = np.dtype([("leave", "i4"), ("enter", "i4")])
# Joints for which there is room at first.
_ROOM = 512


@cython.final
@cython.cclass
class Joints:
    """Joints that are linked in a ring, and a queue of those at which the loop can be shortened.

    `total` (n,) is the sum of the angles around each vertex, negative on the boundary.
    """

    def __init__(self, total):
        self.total = total
        self.crossing = np.empty(2 * _ROOM, _CROSSING)
        self.joint, self.free, self.queue = np.empty(_ROOM, _JOINT), np.empty(_ROOM, np.int32), PriorityQueue(_ROOM)

    def clear(self, count: cython.int) -> cython.int:
        """Forget the last loop, and make room for more than so many joints."""
        i: cython.int
        if 2 * count > self.joint.shape[0]:
            with cython.gil:
                self.joint, self.free = np.empty(4 * count, _JOINT), np.empty(4 * count, np.int32)
                self.queue = PriorityQueue(4 * count)
        while self.sharpest() >= 0:
            pass
        self.n_crossings = self.count = self.some = 0
        self.n_free = cython.cast(cython.int, self.joint.shape[0])
        for i in range(self.n_free):
            self.free[i] = self.n_free - 1 - i
        return 0

    def make(self, v: cython.int) -> cython.int:
        """A new joint at vertex v, the first with number 0."""
        self.n_free -= 1
        self.count += 1
        k: cython.int = self.free[self.n_free]
        self.joint[k].vertex = v
        return k

    def remove(self, k: cython.int) -> cython.void:
        """Forget a joint."""
        self.queue.set_key(k, 0.0)
        self.free[self.n_free] = k
        self.n_free += 1
        self.count -= 1
        if self.some == k:
            self.some = self.joint[k].before

    def remove_spur(self, p: cython.int, k: cython.int, q: cython.int) -> cython.bint:
        """Take away the way from joint p to joint k and back to joint q at the vertex of p.

        Returns whether p alone is left: the loop has contracted to a point.
        """
        self.remove(k)
        after: cython.int = self.joint[q].after
        before: cython.int = self.joint[p].before
        if p == q:
            self.joint[p].before = self.joint[p].after = p
            self.joint[p].count, self.joint[p].length = 0, 0.0
            return True
        self.joint[p] = self.joint[q]
        self.remove(q)
        if after == p:
            before = after = p
        self.joint[p].before, self.joint[p].after = before, after
        self.joint[before].after = self.joint[after].before = p
        self.some = p
        self.check(p)
        return False

    def sharpest(self) -> cython.int:
        """Take the joint with the smallest angle out of the queue; -1 if that is empty."""
        if self.queue.count == 0:
            return -1
        k: cython.int = cython.cast(cython.int, self.queue.first())
        self.queue.set_key(k, 0.0)
        return k

    def angle(self, k: cython.int, on_left: cython.pointer[cython.bint]) -> cython.double:
        """The smaller angle at joint k, and on which side it is."""
        total: cython.double = self.total[self.joint[k].vertex]
        # Counterclockwise from where the loop leaves to where it comes from.
        left: cython.double = self.joint[self.joint[k].before].arrive - self.joint[k].leave
        if total < 0.0:
            # On the boundary there is one side.
            on_left[0] = left > 0.0
            return fabs(left)
        if left < 0.0:
            left += total
        on_left[0] = left < 0.5 * total
        return left if on_left[0] else total - left

    def check(self, k: cython.int) -> cython.void:
        """Put joint k into the queue if the angle there is below pi, or else take it out."""
        on_left: cython.bint = False
        self.queue.set_key(k, max(M_PI - NEARLY_STRAIGHT - self.angle(k, cython.address(on_left)), 0.0))

    def set_crossings(self, k: cython.int, strip: Strip, begin: cython.int, end: cython.int) -> cython.int:
        """Let the part after joint k cross what a strip does from crossing `begin` to crossing `end`, exclusive."""
        j: cython.int
        count: cython.int = end - begin
        self.joint[k].first, self.joint[k].count = self.n_crossings, count
        if self.n_crossings + count > self.crossing.shape[0]:
            with cython.gil:
                self.crossing = np.concatenate([self.crossing, np.empty(self.n_crossings + count, _CROSSING)])
        for j in range(begin, end):
            self.crossing[self.n_crossings] = strip.crossing[j]
            self.n_crossings += 1
        return 0


@cython.final
@cython.cclass
class Polyline:
    """The loop of a course on an oriented manifold, as joints with straight parts between them.

    `polar` (3 m,) is the angle of each corner's right side around its vertex, counterclockwise; `total` (n,) the sum of
    the angles, negative on the boundary; `across` (3 m,) the half-edge on the other side, -1 for none. All are empty
    if the surface is not an oriented manifold: then nothing may be read.
    """

    def __init__(self, course: Course, n_corners, polar, total, across):
        self.course, self.s, self.part = course, course.s, Course(course.s, n_corners)
        self.polar, self.across = polar, across
        self.is_oriented = len(polar) > 0
        self.joints = Joints(total)

    def read(self) -> cython.bint:
        """Take the base of the loop of a course, a vertex, and the bends as joints; False if there are no bends."""
        n: cython.int = self.course.funnel.n_bends - 1
        i: cython.int
        if n < 2:
            return False
        self.joints.clear(n)
        # Joint 0 is the base, and joint i is at bend i.
        self.joints.make(self.course.vertex)
        for i in range(1, n):
            bend = cython.address(self.course.funnel.bend[i])
            self.joints.make(self.course.funnel.gate[bend.last].vertex[bend.side])
        for i in range(n):
            bend = cython.address(self.course.funnel.bend[i])
            self.begin(i, self.course.strip.crossing[bend.last].enter // 3 if i > 0 else self.course.face)
            self.part.strip.extend(self.course.strip.crossing, bend.last + 1, self.course.funnel.bend[i + 1].first)
            after: cython.int = i + 1 if i < n - 1 else 0
            if not self.lay_out(after) > 0.0:
                return False
            self.link(i, after)
        for i in range(n):
            self.joints.check(i)
        return True

    def relax(self) -> cython.int:
        """Shorten the loop at its joints until no angle is below pi, or one joint is left."""
        while self.joints.count > 1:
            k: cython.int = self.joints.sharpest()
            if k < 0:
                return 0
            self.shorten(k)
        return 0

    def shorten(self, k: cython.int) -> cython.int:
        """Lead the loop past joint k on the side of the smaller angle, if that makes it shorter."""
        joint = cython.address(self.joints.joint[k])
        p: cython.int = joint.before
        q: cython.int = joint.after
        before = cython.address(self.joints.joint[p])
        on_left: cython.bint = False
        angle: cython.double = self.joints.angle(k, cython.address(on_left))
        self.begin(p, before.face)
        self.part.strip.extend(self.joints.crossing, before.first, before.first + before.count)
        n: cython.int = self.part.strip.count
        if not self.turn(joint.vertex, joint.face, on_left, angle):
            # On a spur, rounding decides which side has the smaller angle, and no faces may lie on the other one.
            self.part.strip.count = n
            if not self.turn(joint.vertex, joint.face, not on_left, angle):
                return 0
        self.part.strip.extend(self.joints.crossing, joint.first, joint.first + joint.count)
        length: cython.double = self.lay_out(q)
        if self.part.strip.count == 0 and before.vertex == self.joints.joint[q].vertex:
            if self.joints.remove_spur(p, k, q):
                self.joints.joint[p].face = self.part.face
            return 1
        if not length < (before.length + joint.length) * (1.0 - GAIN_OF_PART):
            return 0
        if self.part.funnel.n_bends - 2 > self.joints.n_free:
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

    def begin(self, k: cython.int, face: cython.int) -> cython.int:
        """Begin a part at joint k in a face."""
        self.part.begin(face, at_corner(corner_of(self.s, face, self.joints.joint[k].vertex)))
        return 0

    def lay_out(self, k: cython.int) -> cython.double:
        """Find the shortest path in the strip of the part, to joint k; returns the length."""
        f: cython.int = self.part.last_face()
        self.part.end = at_corner(corner_of(self.s, f, self.joints.joint[k].vertex))
        return self.part.lay_out()

    def turn(self, v: cython.int, goal: cython.int, on_left: cython.bint, angle: cython.double) -> cython.bint:
        """Lead the part around v to face `goal`; False if the faces between span more than `angle`.

        The faces on the left of a path, which `on_left` takes, follow one another clockwise.
        """
        f: cython.int = self.part.last_face()
        between: cython.double = 0.0
        while f != goal:
            leave: cython.int = 3 * f + (corner_of(self.s, f, v) + (2 if on_left else 1)) % 3
            enter: cython.int = self.across[leave]
            if enter < 0:
                return False
            self.part.strip.push(leave, enter)
            f = enter // 3
            if f != goal:
                between += self.s.triangle[f].angle[corner_of(self.s, f, v)]
                if between > angle + SAME_ANGLE:
                    return False
        return True

    def link(self, a: cython.int, b: cython.int) -> cython.int:
        """Make the path that is laid out the way from joint a to joint b, with new joints at the bends."""
        n: cython.int = self.part.funnel.n_bends
        begin: cython.int = 0
        f: cython.int = self.part.face
        i: cython.int
        for i in range(1, n):
            bend = cython.address(self.part.funnel.bend[i])
            k: cython.int = b if i == n - 1 else self.joints.make(self.part.funnel.gate[bend.last].vertex[bend.side])
            self.joints.joint[a].after, self.joints.joint[k].before = k, a
            self.set_part(a, f, begin, bend.first, i)
            if i < n - 1:
                begin, f = bend.last + 1, self.part.strip.crossing[bend.last].enter // 3
            a = k
        return 0

    def set_part(self, a: cython.int, f: cython.int, begin: cython.int, end: cython.int, i: cython.int) -> cython.int:
        """Make the part after joint a the line to bend i of the layout: crossings `begin` to `end`, out of face f."""
        joint = cython.address(self.joints.joint[a])
        p = cython.address(self.part.funnel.bend[i - 1])
        q = cython.address(self.part.funnel.bend[i])
        dx: cython.double = q.x - p.x
        dy: cython.double = q.y - p.y
        c: cython.int = corner_of(self.s, f, joint.vertex)
        joint.face, joint.length = f, hypot(dx, dy)
        self.joints.set_crossings(a, self.part.strip, begin, max(begin, end))
        if joint.count == 0:
            # An edge of face f.
            t = cython.address(self.s.triangle[f])
            e: cython.int = corner_of(self.s, f, self.joints.joint[joint.after].vertex)
            joint.leave = self.polar[3 * f + c] + (0.0 if e == (c + 1) % 3 else t.angle[c])
            joint.arrive = self.polar[3 * f + e] + (0.0 if c == (e + 1) % 3 else t.angle[e])
            return 0
        # Seen from the start the right end of the first crossing is on the right, and from the end the left one.
        gate = cython.address(self.part.funnel.gate[begin])
        angle: cython.double = _left_of(gate.x[1] - p.x, gate.y[1] - p.y, dx, dy)
        joint.leave = self.polar[3 * f + c] + min(angle, self.s.triangle[f].angle[c])
        gate = cython.address(self.part.funnel.gate[end - 1])
        h: cython.int = self.part.strip.crossing[end - 1].enter
        angle = _left_of(gate.x[0] - q.x, gate.y[0] - q.y, -dx, -dy)
        joint.arrive = self.polar[h] + min(angle, self.s.triangle[h // 3].angle[h % 3])
        return 0

    def write(self) -> cython.int:
        """Make the loop the strip of the course, based at a joint."""
        k: cython.int = self.joints.some
        f: cython.int = self.joints.joint[k].face
        self.course.begin(f, at_corner(corner_of(self.s, f, self.joints.joint[k].vertex)))
        while True:
            joint = cython.address(self.joints.joint[k])
            self.course.strip.extend(self.joints.crossing, joint.first, joint.first + joint.count)
            k = joint.after
            if k == self.joints.some:
                break
            self.course.turn(self.joints.joint[k].vertex, self.joints.joint[k].face)
        f = self.course.last_face()
        self.course.end = at_corner(corner_of(self.s, f, self.course.vertex))
        return 0


@cython.final
@cython.cclass
class Loop:
    """The loop of a course, whose strip leads back to the start, the base."""

    def __init__(self, passing: Passing, n_corners, polar, total, across):
        self.course, self.passing = passing.course, passing
        self.polyline = Polyline(passing.course, n_corners, polar, total, across)
        self.kept, self.ring = Saved(), Strip()

    def shorten(self) -> cython.double:
        """Lead the strip to the shortest loop of its class that is found; returns the length."""
        self.relax()
        return self.tighten()

    def relax(self) -> cython.int:
        """Shorten the loop as a polyline as far as that goes."""
        if not self.polyline.is_oriented:
            return 0
        self.course.lay_out()
        if self.course.vertex < 0:
            # Joints are vertices.
            if self.course.funnel.n_bends == 2 or not self.move_base():
                return 0
            self.course.lay_out()
        if self.polyline.read():
            self.polyline.relax()
            self.polyline.write()
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
        c: cython.int
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
        share: cython.double
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
    """Shortens curves on the same faces, one after another; see `heat_igl.curves.shortening.Shortener`."""

    def __init__(self, faces: FaceTable, half_turn, most_corners, directions):
        self.course = Course(faces, most_corners)
        self.passing = Passing(self.course, half_turn)
        self.loop = Loop(self.passing, most_corners, *directions)

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
        c: cython.int
        i: cython.int
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


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _left_of(ax: cython.double, ay: cython.double, bx: cython.double, by: cython.double) -> cython.double:
    """Angle from direction a counterclockwise to direction b, at least 0."""
    return max(atan2(ax * by - ay * bx, ax * bx + ay * by), 0.0)
