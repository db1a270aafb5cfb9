"""Kernel of the paths: the way down a distance over a triangulation, and straightening of the strip of faces on it.

The way is the steepest descent, or, where the path becomes too long, found by aiming at what the distance says ahead.

A path is first a *strip*: a sequence of crossings, each from a half-edge of one face to a half-edge of the next on the
same edge. Laid out in the plane the strip is a polygon, in which a funnel finds the shortest path (Lee and Preparata
1984). Where that path bends at a vertex although another way around it has an angle of less than pi, the strip is led
that way, which makes the path shorter (Xin and Wang 2007); it is repeated until no such bend is left. At most vertices
the other way is the other side. Where more than two faces meet at an edge, a strip crosses it from any into any other
and the ways around its ends branch, so the shortest is searched for. Nothing here needs faces that are oriented alike.
Side "left" is the side of the second of a half-edge's ends for the first crossing of a strip, and carried along from
there.

All in one file, as in `heat_igl.unfolding.unfolding`, for the sake of numba's cache.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.fans import inline, jit
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["Surface", "trace"]

# A crossing nearer to a vertex than this, in edge lengths, passes through the vertex.
_SNAP = 1e-9
# A bend is worth repairing when the angle another way falls short of pi by more than this; it saves the square.
_STRAIGHT = 1e-7
# The end on a curve is moved at most this often in one strip; once is enough unless the last bend changes with it.
_MOST_SLIDES = 8
# A path that is longer than the distance by this part of it is traced a second time, by the other rule.
_TOO_LONG = 1e-3
# Of two paths the second is taken when it is shorter by this part: not for its rounding.
_GAIN = 1e-9
# A straight way to a source is taken when it is not longer than the distance says, to rounding.
_ROUNDING = 1e-9


class Surface(NamedTuple):
    """Triangles for the kernel.

    Attributes
    ----------
    F : (m, 3) int64
        Vertices.
    l : (m, 3) float64
        Edge lengths, opposite each corner; none of them 0.
    angle : (m, 3) float64
        Angle at each corner.
    edge : (3 m,) int64
        Edge of each half-edge.
    first_side, side : (k + 1,), (3 m,) int64
        Half-edges of edge e are ``side[first_side[e]:first_side[e + 1]]``.
    first_corner, corner : (n + 1,), (3 m,) int64
        Corners at vertex v are ``corner[first_corner[v]:first_corner[v + 1]]``, numbered like half-edges.
    """

    F: IntArray
    l: FloatArray  # noqa: E741 - the literature's name
    angle: FloatArray
    edge: IntArray
    first_side: IntArray
    side: IntArray
    first_corner: IntArray
    corner: IntArray


class Goals(NamedTuple):
    """Where paths may end.

    Attributes
    ----------
    is_source : (n,) bool
        The vertices that are sources.
    first_inside : (m + 1,) int64
        Sources inside face f are rows ``first_inside[f]`` to ``first_inside[f + 1]`` of `inside`.
    inside : (p, 2, 3) float64
        Barycentric coordinates of both ends of a segment, equal ones for a point.
    offset : (p,) float64
        The distance at which each begins.
    escape : (n,) int64
        The next vertex on a way along edges to a source, -1 where there is none: where descent ends too early.
    """

    is_source: BoolArray
    first_inside: IntArray
    inside: FloatArray
    offset: FloatArray
    escape: IntArray


@inline
def _corner_of(s: Surface, f: int, v: int) -> int:
    """The corner of face f at vertex v, -1 if it has none."""
    if s.F[f, 0] == v:
        return 0
    if s.F[f, 1] == v:
        return 1
    return 2 if s.F[f, 2] == v else -1


@jit
def _push(leave: list[int], enter: list[int], h: int, g: int) -> None:
    """Add a crossing from half-edge h to half-edge g; two over one edge are joined, and going back takes both away."""
    if len(leave) == 0 or enter[-1] != h:
        leave.append(h)
        enter.append(g)
    elif leave[-1] != g:
        enter[-1] = g
    else:
        leave.pop()
        enter.pop()


@jit
def _around(
    s: Surface, v: int, h: int, before: tuple[float, float], goal: int, other: int, end: int,
    after: tuple[float, float], limit: float, leave: list[int], enter: list[int],
) -> bool:  # fmt: skip
    """The shortest way around vertex v from the face of half-edge h to face `goal`, or to a face with vertex `other`.

    Its length is the sum of the angles at v: in the first face `before`, to h and to the other half-edge at v; in the
    last face `after`, from half-edge `end` and from the other; and those of the faces between. Appends the crossings.
    False if there is no way, or none below `limit`.
    """
    start = h // 3
    # Dijkstra's algorithm. A step enters a face: the half-edge that it enters through, the one to leave it through (-1
    # in the last face), and the step before it. Ways branch only at edges of more than two faces.
    steps = [(-1, h, -1), (-1, 3 * start + 3 - h % 3 - _corner_of(s, start, v), -1)]
    # The last step of each way that goes on, and its length to the edge where the face is left.
    ends = [(before[0], 0), (before[1], 1)]
    while len(ends) > 0:
        nearest = 0
        for i in range(1, len(ends)):
            if ends[i][0] < ends[nearest][0]:
                nearest = i
        length, at = ends.pop(nearest)
        out = steps[at][1]
        if length >= limit:
            return False
        if out < 0:
            n = len(leave)
            while steps[at][2] >= 0:
                leave.insert(n, steps[steps[at][2]][1])
                enter.insert(n, steps[at][0])
                at = steps[at][2]
            return True
        first, last = s.first_side[s.edge[out]], s.first_side[s.edge[out] + 1]
        for k in range(first, last):
            g = s.side[k]
            f = g // 3
            if g == out or f == start or (last - first > 2 and g in [step[0] for step in steps]):
                continue
            if f == goal or (other >= 0 and _corner_of(s, f, other) >= 0):
                step, angle = (g, -1, at), after[0] if g == end else after[1]
            else:
                c = _corner_of(s, f, v)
                step, angle = (g, 3 * f + 3 - g % 3 - c, at), s.angle[f, c]
            ends.insert(nearest, (length + angle, len(steps)))
            steps.append(step)
    return False


@jit
def _turn(s: Surface, v: int, f: int, goal: int, other: int, leave: list[int], enter: list[int]) -> bool:
    """Extend a strip that ends in face f at vertex v to face `goal`, or to a face with `other`, the shorter way round.

    False if the faces around v do not lead there.
    """
    if f == goal or (other >= 0 and _corner_of(s, f, other) >= 0):
        return True
    h = 3 * f + (_corner_of(s, f, v) + 1) % 3
    new_leave, new_enter = [0], [0]
    new_leave.clear()
    new_enter.clear()
    if not _around(s, v, h, (0.0, 0.0), goal, other, -1, (0.0, 0.0), math.inf, new_leave, new_enter):
        return False
    for i in range(len(new_leave)):
        _push(leave, enter, new_leave[i], new_enter[i])
    return True


@jit
def _descent(s: Surface, d: FloatArray, f: int, rate: FloatArray) -> float:
    """Steepest descent in face f: its slope, and up to a factor how fast each barycentric coordinate grows.

    -1 where a corner has no finite value.
    """
    d0, d1, d2 = d[s.F[f, 0]], d[s.F[f, 1]], d[s.F[f, 2]]
    if not (math.isfinite(d0) and math.isfinite(d1) and math.isfinite(d2)):
        return -1.0
    a, b, c = s.l[f, 0], s.l[f, 1], s.l[f, 2]
    half = 0.5 * (a + b + c)
    area = half * (half - a) * (half - b) * (half - c)  # squared
    # The scalar products of the gradients of two coordinates, times -4 area^2.
    dot01, dot12, dot20 = 0.5 * (a * a + b * b - c * c), 0.5 * (b * b + c * c - a * a), 0.5 * (c * c + a * a - b * b)
    rate[0] = (d1 - d0) * dot01 + (d2 - d0) * dot20
    rate[1] = (d0 - d1) * dot01 + (d2 - d1) * dot12
    rate[2] = (d0 - d2) * dot20 + (d1 - d2) * dot12
    squared = (d0 - d1) ** 2 * dot01 + (d1 - d2) ** 2 * dot12 + (d2 - d0) ** 2 * dot20
    return math.sqrt(max(squared, 0.0) / (4.0 * area)) if area > 0.0 else 0.0


@inline
def _product(s: Surface, f: int, x: FloatArray, y: FloatArray) -> float:
    """Scalar product of two vectors in face f, given by differences of barycentric coordinates."""
    return -0.5 * float(
        s.l[f, 0] ** 2 * (x[1] * y[2] + x[2] * y[1])
        + s.l[f, 1] ** 2 * (x[2] * y[0] + x[0] * y[2])
        + s.l[f, 2] ** 2 * (x[0] * y[1] + x[1] * y[0])
    )


@jit
def _apart(s: Surface, f: int, x: FloatArray, y: FloatArray) -> float:
    """How far two points of face f are apart."""
    return math.sqrt(max(_product(s, f, x - y, x - y), 0.0))


@jit
def _value(s: Surface, d: FloatArray, f: int, x: FloatArray) -> float:
    """The distance at point x of face f, where it is linear."""
    total = 0.0
    for c in range(3):
        if x[c] > 0.0:
            total += x[c] * d[s.F[f, c]]
    return total


@jit
def _nearest(s: Surface, f: int, segment: FloatArray, x: FloatArray, out: FloatArray) -> float:
    """The point `out` of a segment in face f that is nearest to its point x, and how far it is."""
    along = segment[1] - segment[0]
    squared = _product(s, f, along, along)
    share = _product(s, f, x - segment[0], along) / squared if squared > 0.0 else 0.0
    out[:] = segment[0] + min(max(share, 0.0), 1.0) * along
    return _apart(s, f, x, out)


@jit
def _source_in(s: Surface, d: FloatArray, goals: Goals, f: int, x: FloatArray, at_any_cost: bool) -> tuple[int, float]:
    """The nearest source inside face f from its point x, and the distance by it; -1 if d at x is less."""
    best, length = -1, math.inf
    if goals.first_inside[f] == goals.first_inside[f + 1]:
        return best, length
    point = np.empty(3)
    for i in range(goals.first_inside[f], goals.first_inside[f + 1]):
        apart = _nearest(s, f, goals.inside[i], x, point) + goals.offset[i]
        if apart < length:
            best, length = i, apart
    value = x[0] * d[s.F[f, 0]] + x[1] * d[s.F[f, 1]] + x[2] * d[s.F[f, 2]]
    if best >= 0 and (at_any_cost or length <= value * (1.0 + _ROUNDING)):
        return best, length
    return -1, math.inf


@jit
def _source_around(s: Surface, d: FloatArray, goals: Goals, v: int, at_any_cost: bool) -> tuple[int, int]:
    """The face at vertex v and the row of the nearest source inside it, -1 if there is none."""
    x = np.zeros(3)
    face, best, length = -1, -1, math.inf
    for k in range(s.first_corner[v], s.first_corner[v + 1]):
        f, c = s.corner[k] // 3, s.corner[k] % 3
        if goals.first_inside[f] == goals.first_inside[f + 1]:
            continue
        x[:] = 0.0
        x[c] = 1.0
        i, apart = _source_in(s, d, goals, f, x, at_any_cost)
        if apart < length:
            face, best, length = f, i, apart
    return face, best


@jit
def _leave_vertex(s: Surface, d: FloatArray, v: int, rate: FloatArray, x: FloatArray) -> tuple[int, int]:
    """Where the steepest descent leads from vertex v.

    Returns a face and -1, with x where it leaves that face again, or a face and the vertex at the end of an edge of it;
    -1 and -1 if nothing descends.
    """
    face, other, best = -1, -1, 0.0
    for k in range(s.first_corner[v], s.first_corner[v + 1]):
        f, c = s.corner[k] // 3, s.corner[k] % 3
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        slope = _descent(s, d, f, rate)
        if slope > best and rate[c1] > 0.0 and rate[c2] > 0.0:
            share = rate[c2] / (rate[c1] + rate[c2])
            if _SNAP < share < 1.0 - _SNAP:
                face, other, best = f, -1, slope
                x[c], x[c1], x[c2] = 0.0, 1.0 - share, share
        for c_other in (c1, c2):
            w = s.F[f, c_other]
            slope = (d[v] - d[w]) / s.l[f, 3 - c - c_other]
            if slope > best:
                face, other, best = f, w, slope
    return face, other


@jit
def _apex(a: float, b: float, side: float) -> tuple[float, float]:
    """The third corner of a triangle on a side along the axis, from its distances to both ends: along, and height."""
    along = 0.5 * ((a - b) * (a + b) / side + side)
    return along, math.sqrt(max(a * a - along * along, 0.0))


@jit
def _over(px: float, py: float, qx: float, qy: float, side: float) -> tuple[float, float]:
    """Where a straight line crosses a side, and its length: from py above it to qy below; inf if it passes it by."""
    share = (px + (qx - px) * py / (py + qy)) / side if py + qy > 0.0 else 0.0
    return share, math.hypot(qx - px, qy + py) if _SNAP < share < 1.0 - _SNAP else math.inf


@jit
def _aim(s: Surface, d: FloatArray, f: int, x: FloatArray, left: float, best: float, out: FloatArray) -> float:
    """Of ways to a source, from point x of face f over a side of it, the one whose length is nearest to `left`.

    They go straight to a corner, or straight over a side to the far corner of a face beyond it, and are as long as the
    distance says from there; or straight over a side to where the distances of its ends place the source, in the plane
    of the face. If the length differs from `left` by less than `best`, the difference is returned and `out` set to the
    point where the way leaves the face; `best` otherwise.
    """
    for c in range(3):
        a, b = (c + 1) % 3, (c + 2) % 3
        da, db, side = d[s.F[f, a]], d[s.F[f, b]], s.l[f, c]
        if x[c] <= 0.0 or not (math.isfinite(da) and math.isfinite(db)):
            continue
        # The side along the axis from a to b, the face above it.
        along, height = _apex(s.l[f, b], s.l[f, a], side)
        px, py = x[b] * side + x[c] * along, x[c] * height
        qx, qy = _apex(da, db, side)
        ways = [(0.0, math.hypot(px, py) + da), (1.0, math.hypot(px - side, py) + db), _over(px, py, qx, qy, side)]
        h = 3 * f + c
        for k in range(s.first_side[s.edge[h]], s.first_side[s.edge[h] + 1]):
            g = s.side[k]
            if g != h:
                e = g // 3
                qx, qy = _apex(s.l[e, _corner_of(s, e, s.F[f, b])], s.l[e, _corner_of(s, e, s.F[f, a])], side)
                share, length = _over(px, py, qx, qy, side)
                ways.append((share, length + d[s.F[e, g % 3]]))
        for share, length in ways:
            if abs(length - left) < best:
                best = abs(length - left)
                out[a], out[b], out[c] = 1.0 - share, share, 0.0
    return best


@jit
def _aim_from_vertex(s: Surface, d: FloatArray, v: int, x: FloatArray) -> tuple[int, int]:
    """Where the way from vertex v leads whose length is nearest to its distance; as `_leave_vertex` says it."""
    at, out = np.empty(3), np.empty(3)
    face, best = -1, math.inf
    for k in range(s.first_corner[v], s.first_corner[v + 1]):
        f = s.corner[k] // 3
        at[:] = 0.0
        at[s.corner[k] % 3] = 1.0
        off = _aim(s, d, f, at, d[v], best, out)
        if off < best:
            face, best = f, off
            x[:] = out
    c = _only_corner(x) if face >= 0 else -1
    return face, s.F[face, c] if c >= 0 else -1


@jit
def _exit(x: FloatArray, rate: FloatArray) -> int:
    """Move x in its face as far as the face reaches; returns the corner opposite the side where it leaves."""
    out, way = -1, math.inf
    for c in range(3):
        if rate[c] < 0.0 and x[c] < way * -rate[c]:
            out, way = c, x[c] / -rate[c]
    for c in range(3):
        x[c] = max(x[c] + way * rate[c], 0.0)
    x[out] = 0.0
    total = x[0] + x[1] + x[2]
    for c in range(3):
        x[c] /= total
    return out


@jit
def _only_corner(x: FloatArray) -> int:
    """The corner that point x is at, -1 if at none."""
    for c in range(3):
        if x[c] > 1.0 - _SNAP:
            return c
    return -1


@jit
def _moved(s: Surface, h: int, g: int, x: FloatArray, out: FloatArray) -> None:
    """Coordinates `out`, in the face of half-edge g, of a point x in the face of half-edge h on the same edge."""
    out[:] = 0.0
    f, other = h // 3, g // 3
    for c in range(3):
        if c != h % 3:
            out[_corner_of(s, other, s.F[f, c])] = x[c]


@inline
def _weighted(weights: FloatArray, px: FloatArray, py: FloatArray) -> FloatArray:
    return np.array(
        [
            weights[0] * px[0] + weights[1] * px[1] + weights[2] * px[2],
            weights[0] * py[0] + weights[1] * py[1] + weights[2] * py[2],
        ]
    )


@jit
def _lay_out(
    s: Surface, face: int, start: FloatArray, leave: list[int], enter: list[int]
) -> tuple[FloatArray, IntArray, FloatArray, FloatArray]:
    """The strip in the plane.

    Returns positions (k, 4) of the left and right end of each crossing, their vertices (k, 2), the start (2,) and the
    corners (3, 2) of the last face.
    """
    k = len(leave)
    place = np.empty((k, 4))
    ends = np.empty((k, 2), np.int64)
    px, py = np.zeros(3), np.zeros(3)
    a, b, c = s.l[face, 0], s.l[face, 1], s.l[face, 2]
    half = 0.5 * (a + b + c)
    px[1] = c
    px[2] = 0.5 * ((b - a) * (b + a) / c + c)
    py[2] = 2.0 * math.sqrt(max(half * (half - a) * (half - b) * (half - c), 0.0)) / c
    begin = _weighted(start, px, py)
    f, entered, left, right = face, -1, -1, -1
    for j in range(k):
        corner = leave[j] % 3
        if entered < 0:
            left, right = (corner + 2) % 3, (corner + 1) % 3
        elif corner == left:
            left = entered
        else:
            right = entered
        place[j, 0], place[j, 1], place[j, 2], place[j, 3] = px[left], py[left], px[right], py[right]
        ends[j, 0], ends[j, 1] = s.F[f, left], s.F[f, right]
        lx, ly, rx, ry = place[j]
        f, entered = enter[j] // 3, enter[j] % 3
        left, right = _corner_of(s, f, ends[j, 0]), _corner_of(s, f, ends[j, 1])
        a, b, c = s.l[f, left], s.l[f, right], s.l[f, entered]
        half = 0.5 * (a + b + c)
        # The far corner over the crossing: a is its distance from the right end, b from the left.
        x = 0.5 * ((a - b) * (a + b) / c + c) / c
        y = 2.0 * math.sqrt(max(half * (half - a) * (half - b) * (half - c), 0.0)) / (c * c)
        ux, uy = lx - rx, ly - ry
        px[left], py[left], px[right], py[right] = lx, ly, rx, ry
        px[entered], py[entered] = rx + x * ux + y * uy, ry + x * uy - y * ux
    return place, ends, begin, np.stack((px, py), axis=1)


@jit
def _funnel(place: FloatArray, ends: IntArray, begin: FloatArray, goal: FloatArray) -> tuple[FloatArray, IntArray, int]:
    """The shortest path through the crossings: its corners, and for each bend its side, first and last crossing.

    Row 0 of both is the start and row `count - 1` the end. Side 0 is left and 1 right.
    """
    k = len(place)
    corner, bend = np.empty((k + 2, 2)), np.empty((k + 2, 3), np.int64)
    corner[0] = begin
    bend[0, 0], bend[0, 1], bend[0, 2] = -1, -1, -1
    count = 1
    ax, ay = begin
    # For each side the limit of what the apex sees, and the crossing that set it; -1 for none yet.
    limit = np.zeros((2, 2))
    by = np.array([-1, -1])
    j = 0
    while j <= k:
        turned = False
        for side in (1, 0):
            x, y = (place[j, 2 * side], place[j, 2 * side + 1]) if j < k else (goal[0], goal[1])
            sign = 1.0 if side == 0 else -1.0
            x, y = x - ax, y - ay
            if by[side] >= 0 and sign * (limit[side, 0] * y - limit[side, 1] * x) > 0.0:
                continue  # opens the funnel
            opposite = 1 - side
            if by[opposite] >= 0 and sign * (limit[opposite, 0] * y - limit[opposite, 1] * x) < 0.0:
                at = by[opposite]
                ax, ay = place[at, 2 * opposite], place[at, 2 * opposite + 1]
                first = last = at
                while first > 0 and ends[first - 1, opposite] == ends[at, opposite]:
                    first -= 1
                while last + 1 < k and ends[last + 1, opposite] == ends[at, opposite]:
                    last += 1
                corner[count, 0], corner[count, 1] = ax, ay
                # What lies before the last bend is crossed before it, though this vertex may be in sight already.
                bend[count, 0], bend[count, 1], bend[count, 2] = opposite, max(first, bend[count - 1, 2]), last
                count += 1
                by[0] = by[1] = -1
                j = last + 1
                turned = True
                break
            limit[side, 0], limit[side, 1] = x, y
            by[side] = j
        if not turned:
            j += 1
    corner[count] = goal
    bend[count, 0], bend[count, 1], bend[count, 2] = -1, k, k
    return corner, bend, count + 1


@inline
def _angle(ax: float, ay: float, bx: float, by: float) -> float:
    """Angle between two directions, 0 to pi."""
    return math.atan2(abs(ax * by - ay * bx), ax * bx + ay * by)


@jit
def _slide(segment: FloatArray, face: FloatArray, p: FloatArray, out: FloatArray) -> None:
    """The point `out` of a segment, in coordinates of a face that is laid out, which is nearest to the position p."""
    a = _weighted(segment[0], face[:, 0], face[:, 1])
    b = _weighted(segment[1], face[:, 0], face[:, 1])
    squared = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
    share = ((p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1])) / squared if squared > 0.0 else 0.0
    out[:] = segment[0] + min(max(share, 0.0), 1.0) * (segment[1] - segment[0])


@jit
def _shorter_way(
    s: Surface, place: FloatArray, ends: IntArray, leave: list[int], enter: list[int], corner: FloatArray,
    bend: IntArray, i: int, new_leave: list[int], new_enter: list[int],
) -> bool:  # fmt: skip
    """Whether the path gets shorter another way around its i-th corner; if so, the crossings there."""
    side, first, last = bend[i, 0], bend[i, 1], bend[i, 2]
    v = ends[first, side]
    zx, zy = corner[i]
    far = 2 * (1 - side)
    h, g = leave[first], enter[last]
    f = h // 3
    start = _angle(corner[i - 1, 0] - zx, corner[i - 1, 1] - zy, place[first, far] - zx, place[first, far + 1] - zy)
    end = _angle(corner[i + 1, 0] - zx, corner[i + 1, 1] - zy, place[last, far] - zx, place[last, far + 1] - zy)
    if f == g // 3:
        return True  # straight through this face
    before = (start, s.angle[f, _corner_of(s, f, v)] - start)
    after = (end, s.angle[g // 3, _corner_of(s, g // 3, v)] - end)
    return _around(s, v, h, before, g // 3, -1, g, after, math.pi - _STRAIGHT, new_leave, new_enter)


@jit
def _straighten(
    s: Surface, face: int, start_vertex: int, start: FloatArray, leave: list[int], enter: list[int], end_vertex: int,
    ends_on: FloatArray, faces: list[int], points: list[float],
) -> float:  # fmt: skip
    """Append the segments of a locally shortest path: their faces, and the coordinates of start and end in them.

    Returns its length. It ends at `end_vertex`, or, if that is -1, where it is nearest on the segment `ends_on` in the
    last face.
    """
    ends_on = ends_on.copy()
    end = 0.5 * (ends_on[0] + ends_on[1])
    slides = end_vertex < 0 and (ends_on[0] != ends_on[1]).any()
    new_leave, new_enter, way_leave, way_enter = [0], [0], [0], [0]
    shortest, failures = math.inf, 0
    while True:
        face = _trimmed(s, face, start_vertex, start, leave, enter, end_vertex, end, ends_on)
        place, ends, begin, last_face = _lay_out(s, face, start, leave, enter)
        corner, bend, count = _funnel(place, ends, begin, _weighted(end, last_face[:, 0], last_face[:, 1]))
        for _ in range(_MOST_SLIDES if slides else 0):
            last_bend = bend[count - 2, 2]
            _slide(ends_on, last_face, corner[count - 2], end)
            corner, bend, count = _funnel(place, ends, begin, _weighted(end, last_face[:, 0], last_face[:, 1]))
            if bend[count - 2, 2] == last_bend:
                break
        length = 0.0
        for i in range(1, count):
            length += math.hypot(corner[i, 0] - corner[i - 1, 0], corner[i, 1] - corner[i - 1, 1])
        # Rounding can make two ways around a vertex look shorter than one another.
        failures = 0 if length < shortest * (1.0 - 1e-13) else failures + 1
        shortest = min(shortest, length)
        if failures > 3:
            break
        new_leave.clear()
        new_enter.clear()
        copied, has_changed = 0, False
        for i in range(1, count - 1):
            first, last = bend[i, 1], bend[i, 2]
            # Two bends repaired at once must not share a face.
            if has_changed and first <= copied:
                continue
            way_leave.clear()
            way_enter.clear()
            if not _shorter_way(s, place, ends, leave, enter, corner, bend, i, way_leave, way_enter):
                continue
            for j in range(copied, first):
                _push(new_leave, new_enter, leave[j], enter[j])
            for j in range(len(way_leave)):
                _push(new_leave, new_enter, way_leave[j], way_enter[j])
            copied, has_changed = last + 1, True
        if not has_changed:
            break
        for j in range(copied, len(leave)):
            _push(new_leave, new_enter, leave[j], enter[j])
        leave, new_leave = new_leave, leave
        enter, new_enter = new_enter, enter
    _emit(s, face, start, leave, enter, end, place, ends, corner, bend, faces, points)
    return length


@jit
def _trimmed(
    s: Surface, face: int, start_vertex: int, start: FloatArray, leave: list[int], enter: list[int], end_vertex: int,
    end: FloatArray, ends_on: FloatArray,
) -> int:  # fmt: skip
    """Drop crossings of edges on which the path starts or ends; returns the first face.

    Rounding would put such a point on either side of the edge.
    """
    moved = np.empty(3)
    while len(leave) > 0:
        h, g = leave[0], enter[0]
        if start_vertex >= 0:
            if s.F[h // 3, h % 3] == start_vertex:
                break
        elif start[h % 3] != 0.0:
            break
        else:
            _moved(s, h, g, start, moved)
            start[:] = moved
        face = g // 3
        leave.pop(0)
        enter.pop(0)
    while len(enter) > 0:
        h, g = leave[-1], enter[-1]
        if end_vertex >= 0:
            if s.F[g // 3, g % 3] == end_vertex:
                break
        elif ends_on[0, g % 3] != 0.0 or ends_on[1, g % 3] != 0.0:
            break
        else:
            for i in range(2):
                _moved(s, g, h, ends_on[i], moved)
                ends_on[i] = moved
            _moved(s, g, h, end, moved)
            end[:] = moved
        leave.pop()
        enter.pop()
    if start_vertex >= 0:
        start[:] = 0.0
        start[_corner_of(s, face, start_vertex)] = 1.0
    if end_vertex >= 0:
        end[:] = 0.0
        end[_corner_of(s, enter[-1] // 3 if len(enter) > 0 else face, end_vertex)] = 1.0
    return face


@jit
def _emit(
    s: Surface, face: int, start: FloatArray, leave: list[int], enter: list[int], end: FloatArray, place: FloatArray,
    ends: IntArray, corner: FloatArray, bend: IntArray, faces: list[int], points: list[float],
) -> None:  # fmt: skip
    """Append the segments of the path through the strip, without those of no length."""
    k = len(leave)
    i = 1
    x, y = start.copy(), np.empty(3)
    n_before = len(faces)
    for j in range(k + 1):
        f = enter[j - 1] // 3 if j > 0 else face
        if j == k:
            y[:] = end
        else:
            while bend[i, 2] < j:
                i += 1
            if bend[i, 0] >= 0 and bend[i, 1] <= j:
                share = 1.0 - bend[i, 0]
            else:
                share = _share(place[j], corner[i - 1], corner[i])
            y[:] = 0.0
            y[_corner_of(s, f, ends[j, 0])] = share
            y[_corner_of(s, f, ends[j, 1])] = 1.0 - share
        if x[0] != y[0] or x[1] != y[1] or x[2] != y[2] or (j == k and len(faces) == n_before):
            faces.append(f)
            for c in range(3):
                points.append(x[c])
            for c in range(3):
                points.append(y[c])
        if j < k:
            g = enter[j] // 3
            x[:] = 0.0
            x[_corner_of(s, g, ends[j, 0])] = share
            x[_corner_of(s, g, ends[j, 1])] = 1.0 - share


@jit
def _share(place: FloatArray, p: FloatArray, q: FloatArray) -> float:
    """How far from its right end (0) to its left end (1) the line from p to q passes a crossing."""
    ux, uy = q[0] - p[0], q[1] - p[1]
    to_left = ux * (place[1] - p[1]) - uy * (place[0] - p[0])
    to_right = ux * (place[3] - p[1]) - uy * (place[2] - p[0])
    share = to_right / (to_right - to_left) if to_right != to_left else 0.5
    # Between the feet of p and q, which is all that is left to say where the line runs along the crossing.
    ex, ey = place[0] - place[2], place[1] - place[3]
    squared = ex * ex + ey * ey
    foot_p = ((p[0] - place[2]) * ex + (p[1] - place[3]) * ey) / squared
    foot_q = ((q[0] - place[2]) * ex + (q[1] - place[3]) * ey) / squared
    share = min(max(share, min(foot_p, foot_q)), max(foot_p, foot_q))
    return float(min(max(share, 0.0), 1.0))


@jit
def _side_of(x: FloatArray) -> int:
    """The side that a point of a face lies on, -1 inside."""
    on = -1
    for c in range(3):
        if x[c] == 0.0:
            on = c
    return on


@jit
def _lowest_vertex(s: Surface, d: FloatArray, f: int, x: FloatArray) -> int:
    """Of the vertices of face f, or of the side that point x lies on, the one of the smallest distance."""
    c = -1
    for corner in range(3):
        if x[corner] > 0.0 and (c < 0 or d[s.F[f, corner]] < d[s.F[f, c]]):
            c = corner
    return int(s.F[f, c])


@jit
def _way_on(
    s: Surface, d: FloatArray, goals: Goals, f: int, x: FloatArray, aims: bool, left: float, is_first: bool,
    out: FloatArray,
) -> tuple[int, int, int]:  # fmt: skip
    """The face in which the way goes on from a point of face f, the half-edge that enters it, and the source in it.

    Each is -1 if there is none. When aiming, `out` is where the way leaves the face.
    """
    rate, moved = np.empty(3), np.empty(3)
    # The steeper the descent the better, and the less a way misses what is left of the length.
    goal, best, enter_by = -1, -math.inf if aims else 0.0, -1
    on = _side_of(x)
    if on < 0:
        i, _ = _source_in(s, d, goals, f, x, False)
        better = -_aim(s, d, f, x, left, math.inf, out) if aims else _descent(s, d, f, rate)
        return f if i >= 0 or better > best else -1, -1, i
    h = 3 * f + on
    for k in range(s.first_side[s.edge[h]], s.first_side[s.edge[h] + 1]):
        g = s.side[k]
        _moved(s, h, g, x, moved)
        i, _ = _source_in(s, d, goals, g // 3, moved, False)
        if i >= 0:
            return g // 3, g, i
        if aims:
            # Straight on is not back.
            better = -_aim(s, d, g // 3, moved, left, -best, out) if g != h or is_first else best
        else:
            better = _descent(s, d, g // 3, rate)
        if better > best and (aims or rate[g % 3] > 0.0):
            best, goal, enter_by = better, g // 3, g
    return goal, enter_by, -1


@jit
def _path(
    s: Surface, d: FloatArray, goals: Goals, face: int, target: FloatArray, max_steps: int, aims: bool,
    faces: list[int], points: list[float],
) -> float:  # fmt: skip
    """Go down from a point of a face to a source, by steepest descent or aiming, and append the straightened path.

    Returns its length and what the distance at its end is; inf if there is no way.
    """
    leave, enter = [0], [0]
    leave.clear()
    enter.clear()
    rate, out, moved, nowhere = np.empty(3), np.empty(3), np.empty(3), np.zeros((2, 3))
    x, start = target.copy(), target.copy()
    c = _only_corner(x)
    v = s.F[face, c] if c >= 0 else -1
    start_vertex, first, f = v, face, face
    is_free = v >= 0  # still at a vertex, and in no face in particular
    floor = math.inf  # descent goes on below this
    most = left = _value(s, d, face, x)  # of the length, when aiming
    length = 0.0
    steps = 0
    while True:
        steps += 1
        if aims and (steps > max_steps or left < -most):
            return math.inf  # a distance that says nothing may lead around in circles
        if steps > max_steps:
            floor = -math.inf
        goal, i, other = -1, -1, -1
        if v >= 0:
            if goals.is_source[v]:
                length += _straighten(s, first, start_vertex, start, leave, enter, v, nowhere, faces, points)
                return float(length + d[v])
            goal, i = _source_around(s, d, goals, v, False)
            if i < 0 and d[v] < floor:
                if aims:
                    goal, other = _aim_from_vertex(s, d, v, out)
                else:
                    goal, other = _leave_vertex(s, d, v, rate, out)
                if aims or goal < 0:
                    floor = d[v]
            if goal < 0:
                goal, i = _source_around(s, d, goals, v, True)
            if goal < 0:
                other = goals.escape[v]
                if other < 0:
                    return math.inf
                for k in range(s.first_corner[v], s.first_corner[v + 1]):
                    if _corner_of(s, s.corner[k] // 3, other) >= 0:
                        goal = s.corner[k] // 3
            if is_free:
                first = f = goal
                is_free = False
            elif not _turn(s, v, f, goal, other, leave, enter):
                # Only this vertex joins the two faces: the path cannot pass anywhere else.
                length += _straighten(s, first, start_vertex, start, leave, enter, v, nowhere, faces, points)
                leave.clear()
                enter.clear()
                start_vertex, first, f = v, goal, goal
            if other < 0 or i >= 0:
                f = goal
            elif len(enter) > 0:
                f = enter[-1] // 3
            else:
                f = first
            if i >= 0:
                length += _straighten(s, first, start_vertex, start, leave, enter, -1, goals.inside[i], faces, points)
                return float(length + goals.offset[i])
            if other >= 0:
                v = other
                continue
            moved[:] = 0.0
            moved[_corner_of(s, f, v)] = 1.0
            left = d[v] - _apart(s, f, moved, out)
            x[:] = out
            v = -1
        # At a point of face f that is no vertex: on one of its sides, or (at the start) inside.
        goal, enter_by, i = _way_on(s, d, goals, f, x, aims, left, steps == 1, out)
        h = 3 * f + _side_of(x)
        if enter_by >= 0 and enter_by != h:
            _moved(s, h, enter_by, x, moved)
            x[:] = moved
            f = goal
            _push(leave, enter, h, enter_by)
        if i >= 0:
            length += _straighten(s, first, start_vertex, start, leave, enter, -1, goals.inside[i], faces, points)
            return float(length + goals.offset[i])
        if goal < 0:
            # Level, or a valley along the side.
            v = _lowest_vertex(s, d, f, x)
            continue
        if aims:
            left -= _apart(s, f, x, out)
            x[:] = out
        else:
            _descent(s, d, f, rate)
            _exit(x, rate)
        c = _only_corner(x)
        if c >= 0:
            v = s.F[f, c]


@jit
def trace(
    s: Surface, d: FloatArray, goals: Goals, face: IntArray, barycentric: FloatArray, max_steps: int
) -> tuple[IntArray, FloatArray, IntArray]:
    """Paths from points down to sources.

    Parameters
    ----------
    s : Surface
        Triangles.
    d : (n,) float64
        What to descend.
    goals : Goals
        Where to end.
    face, barycentric : (k,) int64, (k, 3) float64
        Where to begin.
    max_steps : int
        After so many steps without an end the descent is given up for `Goals.escape`.

    Returns
    -------
    faces : (s,) int64
        Of all segments, path after path.
    points : (s, 2, 3) float64
        Barycentric coordinates of their starts and ends.
    first : (k + 1,) int64
        Segments of path i are ``first[i]`` to ``first[i + 1]``; none where no way was found.
    """
    faces, points, some_faces, some_points, other_faces, other_points = [0], [0.0], [0], [0.0], [0], [0.0]
    faces.clear()
    points.clear()
    first = np.zeros(len(face) + 1, np.int64)
    for i in range(len(face)):
        some_faces.clear()
        some_points.clear()
        length = _path(s, d, goals, face[i], barycentric[i], max_steps, False, some_faces, some_points)
        if _value(s, d, face[i], barycentric[i]) * (1.0 + _TOO_LONG) < length < math.inf:
            other_faces.clear()
            other_points.clear()
            if _path(s, d, goals, face[i], barycentric[i], max_steps, True, other_faces, other_points) < length * (
                1.0 - _GAIN
            ):
                some_faces, other_faces = other_faces, some_faces
                some_points, other_points = other_points, some_points
        faces.extend(some_faces)
        points.extend(some_points)
        first[i + 1] = len(faces)
    return np.array(faces), np.array(points).reshape(-1, 2, 3), first
