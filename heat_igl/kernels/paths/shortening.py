"""Curves shortened within their class: open ones between fixed ends, loops as a whole.

A strip of faces that are laid out in the plane is a polygon, in which a funnel finds the shortest path. If that path
bends at a vertex although another way around it has an angle of less than pi, the strip is led that way,
which makes the path shorter (Xin and Wang 2007); this is repeated until no such bend is left. At vertices with less
than 2 pi both ways can be locally shortest, and the other one is tried.

A loop is a path from a point of it to itself, the base. First the strip is led past the bends of that path once from
each of a few bases, so that no point of the loop is held for long. Then the path is straightened, and the base moved:
to a vertex at which the path bends, or else to an edge that it crosses, along which it slides to where the loop is
shortest. The length falls with every such step unless the loop is locally shortest at the base too.
"""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, M_PI, acos, atan2, cos, fabs, sqrt

# Ranges are of 4000 paths and 300 loops through random vertices of eight shapes.

# A bend is worth repairing when the angle another way falls short of pi by more than this; it saves the square. Curves
# have the same bits from 1e-12 on, and the same lengths up to 1e-5.
_NEARLY_STRAIGHT = cython.declare(cython.double, 1e-7)
# A curve that becomes shorter by less than this share has not changed: rounding. From 1e-14 to 1e-10 lengths are the
# same; with 1e-15 those of three paths and four loops are not.
_GAIN = cython.declare(cython.double, 1e-13)
# Cosine by which the angle that a path spans may fall short of half of those around the vertex. With 0.01, 27 paths are
# longer, by up to 1 %; with 0.1, 128 are shorter, and one is longer.
_MARGIN_OF_TURN = cython.declare(cython.double, 0.03)
# So many vertices are noted at a time, and tried altogether on one path. With 16, 44 and 46 paths are longer; with
# 1024, one is shorter, and of the second nothing changes from 64 on.
_MOST_CHOICES = cython.declare(cython.int, 64)
_MOST_TRIED = cython.declare(cython.int, 256)
# A loop whose length stays the same from this many bases, one after another, is straight at all of them. With 1, two
# loops are longer; with 3 none changes.
_BOTH_WAYS = cython.declare(cython.int, 2)
# Before the loop is straightened from one, it is led past its bends from so many: with 3 and without bound, more loops
# are longer than those of flips of edges.
_FIRST_BASES = cython.declare(cython.int, 8)
# From so many at most: a loop moves to the next vertex with each. No loop of the 300 moves 30 times.
_MOST_BASES = cython.declare(cython.int, 100000)

_CHOICE = np.dtype([("saved", "f8"), ("vertex", "i4"), ("first", "i4"), ("last", "i4")], align=True)


@cython.final
@cython.cclass
class Shortener:
    """Shortens curves on the same faces, one after another; see `heat_igl.curves.GeodesicPathSolver`.

    `half_turn` (n,) is the cosine of half the sum of the angles at each vertex, -1 where only one side of it can be
    locally shortest; no vertex has more than `most_corners` faces.
    """

    def __init__(self, faces: FaceTable, half_turn, most_corners):
        self.s, self.half_turn = faces, half_turn
        self.strip, self.other, self.kept = Strip(), Strip(), Strip()
        self.detour, self.funnel, self.segments = Detour(most_corners), Funnel(), SegmentList()
        self.choice, self.tried = np.empty(_MOST_CHOICES, _CHOICE), np.empty(_MOST_TRIED, np.int32)

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
        start: Place
        end: Place
        stuck: cython.Py_ssize_t = -1
        for c in range(3):
            start.c[c], end.c[c] = ends[0, c], ends[1, c]
        self.segments.n, self.length, self.is_loop = 0, 0.0, is_closed
        with cython.nogil:
            self.begin(face[0], start)
            for i in range(join.shape[0]):
                v: cython.int = join[i, 2]
                f: cython.int = face[i + 1 if i + 1 < face.shape[0] else 0]
                if join[i, 0] >= 0:
                    self.strip.push(join[i, 0], join[i, 1])
                elif v >= 0 and not self.turn(v, f):
                    # Only this vertex joins the two faces.
                    if is_closed:
                        stuck = i
                        break
                    self.ends.end = at_corner(corner_of(self.s, self.last_face(), v))
                    self.length += self.settle()
                    self.emit()
                    self.begin(f, at_corner(corner_of(self.s, f, v)))
            if stuck < 0:
                self.ends.end = end
                self.length += self.shorten_loop() if is_closed else self.improve(self.settle())
                self.emit()
        return stuck, self.length, *self.segments.arrays()

    def begin(self, face, start):
        """Begin a strip."""
        self.ends.face, self.ends.start, self.strip.count = face, start, 0
        self.ends.vertex = vertex_at(self.s, face, cython.address(start))

    def last_face(self):
        """The face that the strip ends in."""
        return self.strip.crossing[self.strip.count - 1].enter // 3 if self.strip.count > 0 else self.ends.face

    def turn(self, v, goal):
        """Lead the strip, which ends at vertex v, around it to face `goal`, the shorter way; False if there is none."""
        f: cython.int = self.last_face()
        if f == goal:
            return True
        nothing: Sides = Sides(0.0, 0.0)
        h: cython.int = 3 * f + (corner_of(self.s, f, v) + 1) % 3
        count: cython.int = self.detour.find(self.s, v, h, nothing, goal, -1, nothing, INFINITY)
        self.strip.extend(self.detour.way, 0, count)
        return count >= 0

    def save(self):
        """Keep the path as it is now, in place of the one kept before."""
        self.kept_ends = self.ends
        return self.kept.copy(self.strip)

    def restore(self):
        """Return to the path that was kept."""
        self.ends = self.kept_ends
        return self.strip.copy(self.kept)

    def emit(self):
        """Append the segments of the path through the strip, without those of no length."""
        k: cython.int = self.strip.count
        i: cython.int = 1
        share: cython.double = 0.0
        f: cython.int = self.ends.face
        x: Place = self.ends.start
        y: Place
        n_before: cython.longlong = self.segments.n
        for j in range(k + 1):
            if j == k:
                y = self.ends.end
            else:
                while self.funnel.bend[i].last < j:
                    i += 1
                share = self.funnel.share(j, i)
                y = self.on(j, f, share)
            is_point: cython.bint = x.c[0] == y.c[0] and x.c[1] == y.c[1] and x.c[2] == y.c[2]
            if not is_point or (j == k and self.segments.n == n_before):
                self.segments.append(f, x.c, y.c)
            if j < k:
                f = self.strip.crossing[j].enter // 3
                x = self.on(j, f, share)
        return 0

    def on(self, j, f, share):
        """The place in face f that lies `share` of the way from the right to the left end of crossing j."""
        gate = cython.address(self.funnel.gate[j])
        x: Place
        x.c[0] = x.c[1] = x.c[2] = 0.0
        x.c[corner_of(self.s, f, gate.vertex[0])] = share
        x.c[corner_of(self.s, f, gate.vertex[1])] = 1.0 - share
        return x

    def settle(self):
        """Lead the strip until the shortest path in it is locally shortest; returns the length."""
        shortest: cython.double = INFINITY
        failures: cython.int = 0
        while True:
            length: cython.double = self.lay_out()
            # Rounding can make two ways around a vertex look shorter than one another.
            failures = 0 if length < shortest * (1.0 - _GAIN) else failures + 1
            shortest = min(shortest, length)
            if failures > 3 or not self.repair():
                break
        return length

    def lay_out(self):
        """Find the shortest path in the strip as it is; returns the length."""
        self.trim()
        self.funnel.lay_out(self.s, self.ends.face, cython.address(self.ends.start), self.strip)
        end = cython.address(self.ends.end)
        self.funnel.pull_tight(weighted(end, self.funnel.last.x), weighted(end, self.funnel.last.y))
        return self.funnel.length()

    def repair(self):
        """Lead the strip the other way around the bends if that is shorter; 0 if there are none."""
        self.other.count = 0
        copied: cython.int = 0
        has_changed: cython.bint = False
        for i in range(1, self.funnel.n_bends - 1):
            bend = cython.address(self.funnel.bend[i])
            # Two bends repaired at once must not share a face.
            if has_changed and bend.first <= copied:
                continue
            count: cython.int = self.shorter_way(i)
            if count < 0:
                continue
            self.other.extend(self.strip.crossing, copied, bend.first)
            self.other.extend(self.detour.way, 0, count)
            copied, has_changed = bend.last + 1, True
        if not has_changed:
            return 0
        self.other.extend(self.strip.crossing, copied, self.strip.count)
        self.strip.copy(self.other)
        return 1

    def shorter_way(self, i):
        """Find a shorter way around the i-th bend; returns the number of crossings in ``detour.way``, -1 if none."""
        bend = cython.address(self.funnel.bend[i])
        first = cython.address(self.funnel.gate[bend.first])
        last = cython.address(self.funnel.gate[bend.last])
        v: cython.int = first.vertex[bend.side]
        far: cython.int = 1 - bend.side
        h: cython.int = self.strip.crossing[bend.first].leave
        g: cython.int = self.strip.crossing[bend.last].enter
        f: cython.int = h // 3
        e: cython.int = g // 3
        if f == e:
            return 0  # straight through this face
        from_here = cython.address(self.funnel.bend[i - 1])
        to_there = cython.address(self.funnel.bend[i + 1])
        before: Sides
        after: Sides
        before.this = _angle(from_here.x - bend.x, from_here.y - bend.y, first.x[far] - bend.x, first.y[far] - bend.y)
        after.this = _angle(to_there.x - bend.x, to_there.y - bend.y, last.x[far] - bend.x, last.y[far] - bend.y)
        before.other = self.s.triangle[f].angle[corner_of(self.s, f, v)] - before.this
        after.other = self.s.triangle[e].angle[corner_of(self.s, e, v)] - after.this
        if self.is_one_way(bend.first, bend.last, v):
            before.this = INFINITY  # on the side of the strip there is no other way
        return self.detour.find(self.s, v, h, before, e, g, after, M_PI - _NEARLY_STRAIGHT)

    def is_one_way(self, first, last, v):
        """Whether these crossings at v neither close around it nor cross an edge at which ways branch.

        Then the angle on the side of the strip, pi at least, is the only one there.
        """
        for j in range(first, last + 1):
            if self.s.twin[self.strip.crossing[j].leave] < 0:
                return False
        return last - first < self.s.first_corner[v + 1] - self.s.first_corner[v] - 1

    def trim(self):
        """Drop crossings of edges on which the path starts or ends: rounding would put it on either side."""
        n_dropped: cython.int = 0
        end_vertex: cython.int = vertex_at(self.s, self.last_face(), cython.address(self.ends.end))
        while n_dropped < self.strip.count:
            h, g = self.strip.crossing[n_dropped].leave, self.strip.crossing[n_dropped].enter
            if self.ends.vertex >= 0:
                if self.s.triangle[h // 3].vertex[h % 3] == self.ends.vertex:
                    break
            elif self.ends.start.c[h % 3] != 0.0:
                break
            else:
                self.ends.start = moved(self.s, h, g, cython.address(self.ends.start))
            self.ends.face = g // 3
            n_dropped += 1
        self.strip.drop(n_dropped)
        while self.strip.count > 0:
            h, g = self.strip.crossing[self.strip.count - 1].leave, self.strip.crossing[self.strip.count - 1].enter
            if end_vertex >= 0:
                if self.s.triangle[g // 3].vertex[g % 3] == end_vertex:
                    break
            elif self.ends.end.c[g % 3] != 0.0:
                break
            else:
                self.ends.end = moved(self.s, g, h, cython.address(self.ends.end))
            self.strip.count -= 1
        if self.ends.vertex >= 0:
            self.ends.start = at_corner(corner_of(self.s, self.ends.face, self.ends.vertex))
        if end_vertex >= 0:
            self.ends.end = at_corner(corner_of(self.s, self.last_face(), end_vertex))

    def improve(self, length):
        """Lead a settled path past vertices on the other side while that makes it shorter; returns the length."""
        self.n_tried = 0
        is_better: cython.bint = True
        while is_better and self.propose() > 0:
            is_better = False
            for i in range(self.n_choices):
                if not self.lead(self.choice[i]):
                    continue
                trial: cython.double = self.settle()
                if trial < length * (1.0 - _GAIN):
                    length = trial
                    is_better = True
                    break
            if not is_better:
                self.restore()
                self.settle()
        return length

    def propose(self):
        """Keep the strip of a straightened path, and note the vertices not tried before; returns their number.

        Laid flat, a path around one vertex is shorter on the other side if it spans more than half of the angles there.
        """
        self.save()
        self.n_choices = 0
        for i in range(1, self.funnel.n_bends):
            p = cython.address(self.funnel.bend[i - 1])
            q = cython.address(self.funnel.bend[i])
            squared: cython.double = (q.x - p.x) * (q.x - p.x) + (q.y - p.y) * (q.y - p.y)
            for j in range(p.last + 1, q.first):
                gate = cython.address(self.funnel.gate[j])
                for side in range(2):
                    half: cython.double = self.half_turn[gate.vertex[side]]
                    if half <= -1.0:
                        continue
                    if j > p.last + 1 and self.funnel.gate[j - 1].vertex[side] == gate.vertex[side]:
                        continue
                    px: cython.double = p.x - gate.x[side]
                    py: cython.double = p.y - gate.y[side]
                    qx: cython.double = q.x - gate.x[side]
                    qy: cython.double = q.y - gate.y[side]
                    product: cython.double = sqrt((px * px + py * py) * (qx * qx + qy * qy))
                    spanned: cython.double = px * qx + py * qy
                    if spanned < (half + _MARGIN_OF_TURN) * product:
                        # The law of cosines, for the angles on both sides.
                        turn: cython.double = 2.0 * acos(half) - acos(max(spanned / product, -1.0))
                        self.note(j, side, 2.0 * (product * cos(turn) - spanned) / squared)
        return self.n_choices

    def note(self, j, side, saved):
        """Insert the vertex at a side of crossing j into the sorted choices."""
        v: cython.int = self.funnel.gate[j].vertex[side]
        # The promise looks at one vertex alone, and those beside it may turn a loss into a gain: an open path tries it.
        # A loop, which is straightened from many bases, would often slide off to a shorter one far away, or to none.
        if self.is_loop and not saved > 0.0:
            return
        for k in range(self.n_tried):
            if self.tried[k] == v:
                return
        if self.n_choices == _MOST_CHOICES:
            if not saved > self.choice[self.n_choices - 1].saved:
                return
            self.n_choices -= 1
        i: cython.int = self.n_choices
        while i > 0 and self.choice[i - 1].saved < saved:
            self.choice[i] = self.choice[i - 1]
            i -= 1
        self.n_choices += 1
        at: FunnelCorner = self.funnel.corner(j, side)
        self.choice[i] = Choice(saved, v, at.first, at.last)

    def lead(self, choice):
        """Lead the path that was kept around a vertex the other way; False if no faces are there."""
        if self.n_tried == _MOST_TRIED:
            return False
        self.tried[self.n_tried] = choice.vertex
        self.n_tried += 1
        h: cython.int = self.kept.crossing[choice.first].leave
        g: cython.int = self.kept.crossing[choice.last].enter
        if h // 3 == g // 3:
            return False
        before: Sides = Sides(INFINITY, 0.0)
        after: Sides = Sides(0.0, 0.0)
        count: cython.int = self.detour.find(self.s, choice.vertex, h, before, g // 3, g, after, INFINITY)
        if count < 0:
            return False
        self.ends = self.kept_ends
        self.strip.count = 0
        self.strip.extend(self.kept.crossing, 0, choice.first)
        self.strip.extend(self.detour.way, 0, count)
        self.strip.extend(self.kept.crossing, choice.last + 1, self.kept.count)
        return True

    def shorten_loop(self):
        """Lead the strip to the shortest loop of its class that is found; returns the length."""
        # Past all bends once, from each of the first bases.
        for _ in range(_FIRST_BASES):
            self.lay_out()
            if not self.repair():
                break
            self.lay_out()
            if self.strip.count == 0 or not self.move_base():
                break
        shortest: cython.double = INFINITY
        n_stalled: cython.int = 0
        length: cython.double = 0.0
        for _ in range(_MOST_BASES):
            length = self.slide(self.settle())
            if not length < shortest * (1.0 - _GAIN):
                length = self.improve(length)
            # One more base shows whether the loop is straight at the one before.
            n_stalled = 0 if length < shortest * (1.0 - _GAIN) else n_stalled + 1
            shortest = min(shortest, length)
            if n_stalled == _BOTH_WAYS or self.strip.count == 0 or not self.move_base():
                break
        return length

    def slide(self, length):
        """Move the base of a settled loop without a bend along the edge that it is on; returns the length."""
        side: cython.int = side_of(cython.address(self.ends.start))
        if self.ends.vertex >= 0 or side < 0 or self.funnel.n_bends > 2:
            return length
        f: cython.int = self.ends.face
        g: cython.int = self.last_face()
        t = cython.address(self.s.triangle[f])
        a: cython.int = (side + 1) % 3
        b: cython.int = (side + 2) % 3
        a_end: cython.int = corner_of(self.s, g, t.vertex[a])
        b_end: cython.int = corner_of(self.s, g, t.vertex[b])
        if a_end < 0 or b_end < 0:
            return length
        p = cython.address(self.funnel.first)
        q = cython.address(self.funnel.last)
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
        if not sqrt(dx * dx + dy * dy) < length * (1.0 - _GAIN):
            return length
        here: cython.double = self.ends.start.c[b]
        self.save()
        # The straight line may leave the strip. The length is a convex function of the share: a shorter way helps.
        while fabs(share - here) > SNAP:
            self.place_base(f, a, b, a_end, b_end, share)
            trial: cython.double = self.settle()
            if trial < length * (1.0 - _GAIN):
                return trial
            self.restore()
            share = 0.5 * (share + here)
        return self.settle()

    def place_base(self, f, a, b, a_end, b_end, share):
        """Put the base `share` of the way from a to b: corners of the first face f, and of the last face."""
        for c in range(3):
            self.ends.start.c[c] = self.ends.end.c[c] = 0.0
        if share < SNAP:
            share = 0.0
        elif share > 1.0 - SNAP:
            share = 1.0
        self.ends.start.c[a] = self.ends.end.c[a_end] = 1.0 - share
        self.ends.start.c[b] = self.ends.end.c[b_end] = share
        self.ends.face = f
        self.ends.vertex = vertex_at(self.s, f, cython.address(self.ends.start))

    def move_base(self):
        """Base the loop elsewhere: at the middle one of its bends, or else on the middle one of its edges."""
        n_bends: cython.int = self.funnel.n_bends
        at: cython.int = self.strip.count // 2
        if n_bends > 2:
            bend = cython.address(self.funnel.bend[n_bends // 2])
            at = bend.first
            share = 1.0 - bend.side
        else:
            share = self.funnel.share(at, 1)
        left: cython.int = self.funnel.gate[at].vertex[0]
        right: cython.int = self.funnel.gate[at].vertex[1]
        if not self.close():
            return False
        leave: cython.int = self.strip.crossing[at].leave
        enter: cython.int = self.strip.crossing[at].enter
        # The strip begins after this crossing and ends before it.
        self.other.copy(self.strip)
        self.strip.count = 0
        self.strip.extend(self.other.crossing, at + 1, self.other.count)
        self.strip.extend(self.other.crossing, 0, at)
        f: cython.int = enter // 3
        g: cython.int = leave // 3
        self.place_base(
            f,
            corner_of(self.s, f, right),
            corner_of(self.s, f, left),
            corner_of(self.s, g, right),
            corner_of(self.s, g, left),
            share,
        )
        return True

    def close(self):
        """Lead the strip on past the base into the first face; False if no face leads there."""
        f: cython.int = self.last_face()
        if f == self.ends.face:
            return True
        if self.ends.vertex >= 0:
            return self.turn(self.ends.vertex, self.ends.face)
        h: cython.int = 3 * f + side_of(cython.address(self.ends.end))
        self.strip.push(h, 3 * self.ends.face + side_of(cython.address(self.ends.start)))
        return True


@cython.cfunc
@cython.nogil
def _angle(ax: cython.double, ay: cython.double, bx: cython.double, by: cython.double) -> cython.double:
    """Angle between two directions, 0 to pi."""
    return atan2(fabs(ax * by - ay * bx), ax * bx + ay * by)
