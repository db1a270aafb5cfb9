"""Distance along edges of a body around which ways bend, and the way around such an edge to a point."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.bodies.edge_distances import Edge, Piece
from cython.cimports.heat_igl.kernels.bodies.rays import GAIN, NUDGE, Line, Ray
from cython.cimports.libc.math import INFINITY, fabs, sqrt

# Share of that edge by which a vertex may lie below the plane of a wall and still be on it.
_LEVEL = cython.declare(cython.double, 1e-6)
# Share of an edge by which the fitted distance may be wrong at its quarters. On 32 bodies, a fifth of it makes 515
# vertices longer by .2 to .6 %, four times as much 739 shorter by .2 to 1.8 %.
_MISFIT = cython.declare(cython.double, 1e-3)
# By how much slopes along an edge may fall from point to point, before two fronts are looked for in between. A quarter
# of it changes one vertex by more than .2 %, four times as much makes 12 longer by .2 to .5 %.
_FALL = cython.declare(cython.double, 0.016)
# Change of the slope along an edge below which a front is straight there.
_STRAIGHT_FRONT = cython.declare(cython.double, 1e-7)
# No front.
_NONE = cython.declare(cython.int, -3)


@cython.cclass
class EdgeDistances(Ray):
    """Edges of a body around which ways bend, and distance along them.

    Distance along an edge that `fits` is ``start + |(x - along, height)|``, x along the edge; at its ends, the quarters
    and the middle it is `at`. On another edge, it is linear in `count` - 1 `pieces` between these points and those at
    which two fronts meet. Each has the `value` at its beginning, and a `slope`, and lines meet the edge there with a
    `lean`, their way along it for each unit across. The way comes to the middle from `before`, a place along `outward`
    and `across`, 0 if it is not known.

    Of the way that was last asked for, `bend` (3,) is the point at which it bends last, and `share` the place of this
    point along the edge. `followed` (e,) are the points of an edge whose ways have been followed, in bits, and
    `refuted` is an edge at which one was hidden, or negative.

    A way comes from a front: the number of an edge, or with `n_edges` added that of a source. Of the last point of an
    edge, `front` is that of its way, `slope` that of distance along the edge, and `origin` the source. The edges that
    end at vertex v are at ``first_at_end[v]`` to ``last_at_end[v]`` of `at_end`, followed by those that are no sources
    yet; `point_of` (e,) is the number of the last `point` of an edge for which an edge was a candidate; `n_near` are
    `near`, on ways of `near_value`.

    `edges`, `outward`, `wall` and `way` are those of `bends.bend_around`, the others those of `Ray`.
    """

    def __init__(self, body, sources, offset, d, label, edges, outward, wall, way):
        super().__init__(body, sources, offset, d, label)
        n, e = len(d), len(edges)
        n_first = len(outward)
        outward, wall = np.pad(outward, ((0, e - n_first), (0, 0))), np.pad(wall, (0, e - n_first))
        ends = np.asarray(self.body.positions)[np.asarray(edges)]
        # A vertex as an edge has a length that divides.
        lengths = np.maximum(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1, keepdims=True), 1e-300)
        tangent = (ends[:, 1] - ends[:, 0]) / lengths
        beyond, across = np.full((e, 1), np.inf), np.cross(tangent, outward)
        known = [ends[:, 0], tangent, beyond, np.zeros((e, 1)), outward, across, np.zeros((e, 2))]
        known += [wall[:, None], lengths, np.zeros((e, 3)), beyond.repeat(5, axis=1)]
        size: cython.int = cython.sizeof(Edge) // cython.sizeof(cython.double)
        self.table = np.zeros((e + 1) * size)
        # From the next beginning of a line of the cache on.
        skipped: cython.int = -(cython.cast(cython.size_t, cython.address(self.table[0])) // 8) % 8
        rows = np.asarray(self.table)[skipped : skipped + e * size].reshape(e, size)
        rows[:, : sum(numbers.shape[1] for numbers in known)] = np.concatenate(known, axis=1)
        self.edge = cython.cast(cython.pointer[Edge], cython.address(self.table[skipped]))
        self.edges, self.n_edges, self.way = edges, e, way
        self.at_end = (np.argsort(np.ravel(edges), kind="stable") // 2).astype(np.int32)
        self.first_at_end = np.append(0, np.cumsum(np.bincount(np.ravel(edges), minlength=n))).astype(np.int32)
        self.last_at_end = np.array(self.first_at_end[1:])
        np.asarray(self.last_at_end)[np.asarray(edges)[n_first:, 0]] -= 2
        self.followed, self.refuted, self.point_of = np.zeros(e, np.uint8), -1, np.zeros(e, np.int32)

    def fit(self, i, follows):
        """Find distance along an edge, at its ends, quarters and middle, whose ways it follows or may presume.

        If the ways to both ends come from one source or edge, so do those to points between, or they are hidden.
        """
        x: cython.double[3]
        slope: cython.double[5]
        front: cython.int[5]
        label: cython.int[5]
        edge: cython.pointer[Edge] = cython.address(self.edge[i])
        a: cython.int = self.edges[i, 0]
        b: cython.int = self.edges[i, 1]
        front[0], front[4] = self.front_at(a), self.front_at(b)
        self.point_along(i, 2, x)
        edge.before[0] = edge.before[1] = 0.0
        if front[0] >= 0:
            self.look_back(front[0], x)
            for k in range(3):
                edge.before[0] += (self.line.goal[k] - edge.end[k]) * edge.outward[k]
                edge.before[1] += (self.line.goal[k] - edge.end[k]) * edge.across[k]
        edge.at[0], edge.at[4] = min(self.d[a], self.d[b] + edge.length), min(self.d[b], self.d[a] + edge.length)
        label[0] = self.label[a if edge.at[0] == self.d[a] else b]
        label[4] = self.label[b if edge.at[4] == self.d[b] else a]
        part: cython.double = 0.25 * edge.length
        follows = follows or front[0] < 0 or front[0] != front[4]
        self.followed[i] = 255 if follows else 0
        for j in range(1, 4):
            self.point_along(i, j, x)
            most: cython.double = min(edge.at[j - 1] + part, edge.at[4] + (4 - j) * part)
            # Along the edge, if no way is found.
            self.front, self.slope = _NONE, 1 if most == edge.at[j - 1] + part else -1
            self.origin = label[j - 1 if self.slope > 0 else 4]
            edge.at[j] = self.shortest_to(i, x, most) if follows else min(most, self.from_front(front[0], x))
            front[j], slope[j], label[j] = self.front, self.slope, self.origin
        for j in range(3, 0, -1):
            if edge.at[j] > edge.at[j + 1] + part:
                edge.at[j], front[j], slope[j], label[j] = edge.at[j + 1] + part, _NONE, -1, label[j + 1]
        self.lay_flat(i, a, b)
        for c in range(2):
            slope[4 * c] = 1 - 2 * c
            if front[4 * c] >= 0 and not edge.fits:
                self.look_back(front[4 * c], cython.address(self.body.positions[self.edges[i, c], 0]))
                slope[4 * c] = self.slope_along(i)
        edge.count, edge.least = 0, INFINITY
        if edge.fits and 0 < edge.along < edge.length:
            edge.least = edge.start + edge.height
        for j in range(5):
            if j > 0 and follows and not edge.fits:
                hidden: cython.bint = front[j - 1] != front[j]
                hidden = hidden and (self.is_hidden(i, j, front[j - 1]) or self.is_hidden(i, j - 1, front[j]))
                self.origin = label[j]
                self.meet(i, j, slope[j - 1], slope[j], hidden)
            self.add_piece(i, j * part, edge.at[j], label[j])

    def meet(self, i, j, one, other, hidden):
        """Begin a piece between points j - 1 and j of an edge, at which distance has these slopes, if two fronts meet.

        That is if one of the fronts is `hidden` at the other's point, or slopes do not grow from one to the next. The
        place is where both are equal; a front that cannot come to the other point as late comes along the edge.
        """
        x: cython.double[3]
        edge: cython.pointer[Edge] = cython.address(self.edge[i])
        part: cython.double = 0.25 * edge.length
        rise: cython.double = (edge.at[j] - edge.at[j - 1]) / part
        # By how much, in parts, either front is later at the other's point.
        behind: cython.double = one - rise
        ahead: cython.double = rise - other
        if hidden or max(behind, ahead) > _FALL:
            behind = behind if behind > 0 else 1 - rise
            ahead = ahead if ahead > 0 else 1 + rise
            # Not too near to either point, which it would tell nothing of.
            share: cython.double = max(0.1, min(ahead / (ahead + behind), 0.9))
            self.point_along(i, j - 1 + share, x)
            most: cython.double = min(edge.at[j - 1] + share * part, edge.at[j] + (1 - share) * part)
            value: cython.double = self.shortest_to(i, x, most)
            self.add_piece(i, (j - 1 + share) * part, value, self.origin)

    def is_hidden(self, i, j, f):
        """Whether the way from a front, as of `front_at`, would be shorter to point j of an edge than the shortest."""
        x: cython.double[3]
        self.point_along(i, j, x)
        return f >= 0 and self.from_front(f, x) < self.edge[i].at[j] * (1 - GAIN)

    def slope_along(self, i):
        """The slope of distance along an edge, at the origin of the `line`."""
        along: cython.double = 0.0
        squared: cython.double = 0.0
        for k in range(3):
            off: cython.double = self.line.origin[k] - self.line.goal[k]
            along += off * self.edge[i].tangent[k]
            squared += off * off
        return along / sqrt(squared) if squared > 0 else 0.0

    def add_piece(self, i, begin, value, label):
        """Let a piece of an edge begin at a place and a distance, where the one before it ends."""
        edge: cython.pointer[Edge] = cython.address(self.edge[i])
        piece: cython.pointer[Piece] = cython.address(edge.pieces[edge.count])
        piece.begin, piece.value, edge.label[edge.count] = begin, value, label
        edge.least = min(edge.least, value)
        if edge.count > 0:
            last: cython.pointer[Piece] = cython.address(edge.pieces[edge.count - 1])
            last.slope = max(-1.0, min((value - last.value) / (begin - last.begin), 1.0))
            last.lean = last.slope / sqrt(max(1 - last.slope * last.slope, 1e-12))
        edge.count += 1

    def label_at(self, i):
        """The source of the point of an edge at its `share`: that of the beginning of a piece next to it."""
        edge: cython.pointer[Edge] = cython.address(self.edge[i])
        best: cython.int = 0
        place: cython.double = self.share * edge.length
        for j in range(1, edge.count):
            if fabs(edge.pieces[j].begin - place) < fabs(edge.pieces[best].begin - place):
                best = j
        return edge.label[best]

    def front_at(self, v):
        """The edge around which the way to v bends last; if that is straight, e added to its source; -2 if unknown."""
        return self.n_edges + self.label[v] if self.way[v] == -1 else self.way[v]

    def from_front(self, f, x):
        """The way to a point that comes from an edge or a source, as `front_at` numbers them."""
        if f < self.n_edges:
            return self.around(f, x, INFINITY)
        return self.offset[f - self.n_edges] + self.body.away(self.sources[f - self.n_edges], x)

    def point_along(self, i, j, x):
        """Set x to the place j quarters along an edge."""
        for k in range(3):
            x[k] = self.body.positions[self.edges[i, 0], k] + 0.25 * j * self.edge[i].length * self.edge[i].tangent[k]

    def holds(self, i):
        """Whether the ways to the points of an edge are clear; they are followed when one bends between its ends."""
        x: cython.double[3]
        quarters: cython.double = 4 * self.share
        front: cython.int = self.front_at(self.edges[i, 0])
        for j in range(1, 4):
            if fabs(j - quarters) < 1 and not (self.followed[i] >> j) & 1:
                self.point_along(i, j, x)
                # First, as where edges touch, each may rely on the other.
                self.followed[i] |= 1 << j
                if front < 0 or not self.is_lit(i, front, x) or (front < self.n_edges and not self.holds(front)):
                    self.followed[i] &= 255 - (1 << j)
                    return False
        return True

    def lay_flat(self, i, a, b):
        """Find the point beside an edge from which distance along it is measured, and whether there is one."""
        edge: cython.pointer[Edge] = cython.address(self.edge[i])
        size: cython.double = edge.length
        to_a: cython.double = edge.at[0]
        middle: cython.double = edge.at[2] - to_a
        to_b: cython.double = edge.at[4] - to_a
        turn: cython.double = to_b - 2 * middle
        if self.way[a] == -1 and self.way[b] == -1 and self.label[a] == self.label[b]:
            edge.start = self.offset[self.label[a]] - to_a
        else:
            turn = max(turn, _STRAIGHT_FRONT * size)
            edge.start = (to_b * to_b - 2 * middle * middle - 0.5 * size * size) / (2 * turn)
        radius: cython.double = -edge.start
        other: cython.double = to_b - edge.start
        edge.along = 0.5 * ((radius - other) * (radius + other) / size + size)
        squared: cython.double = radius * radius - edge.along * edge.along
        edge.fits = radius >= 0 and other >= 0 and squared >= 0
        edge.start += to_a
        edge.height = sqrt(max(squared, 0.0))
        for j in range(1, 4):
            off: cython.double = 0.25 * j * size - edge.along
            if fabs(edge.start + sqrt(off * off + squared) - edge.at[j]) > _MISFIT * size:
                edge.fits = False

    def shortest_to(self, i, x, most):
        """The shortest way to a point of edge i whose last line stays inside, or `most`.

        It bends last around an edge at an end of i, around an edge around which the way to such an end or to one of its
        neighbours does, around one that shares an end with such an edge, or around an edge at a triangle that hides
        another candidate, at both walls of i if it is hidden at once. Or it is the straight line from the source of an
        end, if one of them sees a source.
        """
        self.n_near, self.point = 0, self.point + 1
        self.point_of[i] = self.point
        sees: cython.bint = False
        for c in range(2):
            v: cython.int = self.edges[i, c]
            self.add_at(i, v, x, most)
            for k in range(self.body.first_neighbour[v] - 1, self.body.first_neighbour[v + 1]):
                way: cython.int = self.way[v if k < self.body.first_neighbour[v] else self.body.neighbours[k]]
                sees = sees or way == -1
                if way >= 0:
                    self.add(i, way, x, most)
        for c in range(2 if sees else 0):
            label: cython.int = self.label[self.edges[i, c]]
            if label >= 0 and (c == 0 or label != self.label[self.edges[i, 0]]):
                self.near[self.n_near] = self.n_edges + label
                self.near_value[self.n_near] = self.offset[label] + self.body.away(self.sources[label], x)
                self.n_near += 1
        while self.n_near > 0:
            best: cython.int = 0
            for k in range(self.n_near):
                if self.near_value[k] < self.near_value[best]:
                    best = k
            front: cython.int = self.near[best]
            value: cython.double = self.near_value[best]
            self.n_near -= 1
            self.near[best], self.near_value[best] = self.near[self.n_near], self.near_value[self.n_near]
            if value >= most:
                return most
            if self.is_lit(i, front, x):
                slope: cython.double = self.slope_along(i)
                origin: cython.int = front - self.n_edges if front >= self.n_edges else self.label_at(front)
                if front >= self.n_edges or self.holds(front):
                    self.slope, self.front, self.origin, most = slope, front, origin, value
                    # Edges that share an end with it may give shorter ways.
                    for c in range(2 if front < self.n_edges else 0):
                        self.add_at(i, self.edges[front, c], x, most)
                else:
                    self.refuted = front
                continue
            if self.line.t < 0:
                self.add_beside(i, x, most)
            else:
                for c in range(1, 4):
                    self.add_at(i, self.body.cells[self.line.t, (self.line.out + c) & 3], x, most)
        return most

    def add_beside(self, e, x, most):
        """Make the edges at the walls beside edge e candidates for its `point` x."""
        a: cython.int = self.edges[e, 0]
        b: cython.int = self.edges[e, 1]
        k: cython.int = self.next_around(e, self.body.first[a])
        while k >= 0:
            at: cython.pointer[cython.const[cython.int]] = cython.address(
                self.body.cells[self.body.incident[k] >> 2, 0]
            )
            # A wall opposite corner c, with corner w besides the ends of the edge.
            for c in range(4):
                for w in range(4):
                    if at[4 + c] < 0 and w != c and at[c] not in (a, b) and at[w] not in (a, b):
                        self.add_at(e, at[w], x, most)
            k = self.next_around(e, k + 1)

    def next_around(self, e, k):
        """The place from k on at which the next tetrahedron around edge e is `incident` to its first end, or -1."""
        for i in range(k, self.body.first[self.edges[e, 0] + 1]):
            at: cython.pointer[cython.const[cython.int]] = cython.address(
                self.body.cells[self.body.incident[i] >> 2, 0]
            )
            if self.edges[e, 1] in (at[0], at[1], at[2], at[3]):
                return i
        return -1

    def add_at(self, e, v, x, most):
        """Make the edges that end at v candidates for the `point` x of edge e."""
        for k in range(self.first_at_end[v], self.last_at_end[v]):
            self.add(e, self.at_end[k], x, most)

    def add(self, e, i, x, most):
        """Make edge i one of 256 candidates (65 at most so far) for the `point` x of e if its way may be shorter."""
        if self.point_of[i] != self.point:
            self.point_of[i] = self.point
            most *= 1 - GAIN
            value: cython.double = self.around(i, x, most)
            is_shorter: cython.bint = value < most and self.n_near < 256
            if is_shorter and self.is_hidden_from_before(i, x, self.edge[e].length):
                self.near[self.n_near], self.near_value[self.n_near] = i, value
                self.n_near += 1

    def around(self, i, x, most):
        """Length of the way to a point that bends around an edge last, at `place` / `whole`, if it is below `most`.

        Otherwise something that is not, without a look at the pieces where the `least` distance tells.
        """
        edge: cython.pointer[Edge] = cython.address(self.edge[i])
        away: cython.double = 0.0
        along: cython.double = 0.0
        for k in range(3):
            off: cython.double = x[k] - edge.end[k]
            away += off * off
            along += off * edge.tangent[k]
        squared: cython.double = max(away - along * along, 0.0)
        height: cython.double = sqrt(squared)
        if edge.least + height >= most:
            return INFINITY
        if edge.fits:
            both: cython.double = height + edge.height
            self.place, self.whole = edge.along * height + along * edge.height, both * edge.length
            if 0 < self.place < self.whole:
                return edge.start + sqrt((along - edge.along) * (along - edge.along) + both * both)
        self.whole = edge.length
        best: cython.double = INFINITY
        # The way bends where it meets a piece with its lean, or between two of which neither has such a place.
        comes_to_end: cython.bint = True
        for j in range(edge.count):
            piece: cython.pointer[Piece] = cython.address(edge.pieces[j])
            begin: cython.double = piece.begin
            through: cython.double = piece.value
            if edge.fits:
                if 0 < j < edge.count - 1:
                    continue
            elif j < edge.count - 1:
                off = along - piece.lean * height - begin
                came_to_end: cython.bint = comes_to_end
                comes_to_end = off >= edge.pieces[j + 1].begin - begin
                if comes_to_end or (off <= 0 and not came_to_end):
                    continue
                if off > 0:
                    through += piece.slope * off
                    begin += off
            elif not comes_to_end:
                continue
            through += sqrt(squared + (along - begin) * (along - begin))
            if through < best:
                best, self.place = through, begin
        return best

    def look_back(self, f, x):
        """Make the place from which a way comes to x the goal of the `line`; f is its front, as of `front_at`."""
        line: cython.pointer[Line] = cython.address(self.line)
        line.origin = x
        if f < self.n_edges:
            self.around(f, x, INFINITY)
            self.share = self.place / self.whole
            for k in range(3):
                self.bend[k] = self.edge[f].end[k] + self.share * self.edge[f].length * self.edge[f].tangent[k]
            line.goal = self.bend
            line.goal_a = self.edges[f, 1 if self.share > 1 - NUDGE else 0]
            line.goal_b = self.edges[f, 0 if self.share < NUDGE else 1]
        else:
            line.goal_a = line.goal_b = self.sources[f - self.n_edges]
            line.goal = cython.address(self.body.positions[line.goal_a, 0])

    def is_lit(self, e, f, x):
        """Whether the line back from a point x of edge e, as of `look_back`, stays inside; t is -1 if it never is."""
        self.look_back(f, x)
        line: cython.pointer[Line] = cython.address(self.line)
        line.t = -1
        if self.leaves_at_once(e, x):
            return False
        a: cython.int = self.edges[e, 0]
        k: cython.int = self.next_around(e, self.body.first[a])
        while k >= 0:
            found: cython.int = self.arrives(line, self.body.incident[k] & ~3, -1, -1)
            if found > 0 or (found == -1 and self.is_blocked(line, 2 * NUDGE * self.body.reach[a])):
                return found > 0
            k = self.next_around(e, k + 1)
        return False

    def leaves_at_once(self, e, x):
        """Whether the `line` from a point x of edge e begins between the two walls outside the body."""
        edge: cython.pointer[Edge] = cython.address(self.edge[e])
        out: cython.double = 0.0
        side: cython.double = 0.0
        for k in range(3):
            off: cython.double = self.line.goal[k] - x[k]
            out += off * edge.outward[k]
            side += off * edge.across[k]
        return out - edge.wall * sqrt(out * out + side * side) > _LEVEL * edge.length

    def is_hidden_from_before(self, i, x, size):
        """Whether x lies behind the edge, or beside that at most by a size, that of the longest edge at x.

        Seen along the edge, the line from x to the point from which the way comes passes outside, and x is not below
        the plane of the wall behind the edge. No line to the edge needs those below: each triangle that it passes
        through has a corner on the other side of the plane, and such corners are neighbours from one to the next.
        """
        edge: cython.pointer[Edge] = cython.address(self.edge[i])
        out: cython.double = 0.0
        side: cython.double = 0.0
        for k in range(3):
            off: cython.double = x[k] - edge.end[k]
            out += off * edge.outward[k]
            side += off * edge.across[k]
        # Both are 0 where more than two walls meet, and the way is not known where that to its beginning is.
        below: cython.double = out - edge.wall * sqrt(out * out + side * side)
        far: cython.double = sqrt(edge.before[0] * edge.before[0] + edge.before[1] * edge.before[1])
        side = side if edge.before[1] >= 0 else -side
        behind: cython.double = out * fabs(edge.before[1]) - side * edge.before[0]
        return below <= _LEVEL * size and side * far <= size * far and behind >= -size * far
