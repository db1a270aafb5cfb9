"""Kernel of the unfolding: every vertex by the straightest path that its neighbours' paths lead to.

A walk stands at a vertex v in the origin and looks into the cone between its right limit R and its left limit L, two
vertices. Half-edges that it crosses run from right (a) to left (b). Why it decides as it does is derived in
docs/refinement.md. All in one file, long as it is: numba's cache notices changes in the file of the compiled function,
not in others whose functions are compiled into it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.fans import (
    ALONG,
    ANGLE_HERE,
    ANGLE_THERE,
    BASE,
    CORNER,
    FAN_HERE,
    FAN_THERE,
    FAR,
    FAR_ANGLE,
    FAR_FAN,
    FAR_X,
    FAR_Y,
    HEIGHT,
    LENGTH,
    MANY,
    NEIGHBOUR,
    NEXT_NEIGHBOUR,
    NEXT_SPOKE,
    TO_LEFT,
    TO_RIGHT,
    Tables,
    inline,
    jit,
)
from heat_igl.runtime.prefetch import prefetch, uncounted
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["NO_FAN", "Points", "unfold", "views"]

# Columns of the state of a vertex: its distance; the distance of the last bend (or source) of its path; how far that
# is away in a straight line; the direction in which it lies, as an angle in the fan of the vertex.
DISTANCE, OFFSET, REACH, ANGLE, FAN, TOTAL = 0, 1, 2, 3, 4, 5
# Bends by less than this are rounding.
_STRAIGHT = 1e-9
# How much more may be lost on a part of a path, in proportion, than on the whole.
_SHARE = 1.5
# In place of an angle, for a path that cannot be pulled tight.
_REAL_BEND = 100.0
# A vertex without a fan has no direction: sources, and vertices not yet visited.
NO_FAN = -1
# Vertices that may wait for one another when the order is wrong.
_MAX_WAITING = 64
# Cones that may wait in a search.
_MAX_CONES = 256


@inline
def _savings(incoming: float, outgoing: float, total: float) -> tuple[float, float]:
    """By how much less than pi a path turns at a vertex on its right and on its left side.

    The path comes from the direction `incoming` and leaves in the direction `outgoing`, angles in a fan that sums to
    `total` (negative: open, and there is no way around through the boundary). A positive value: passing the vertex on
    that side is shorter.
    """
    right = outgoing - incoming
    if total > 0.0:
        if right < 0.0:
            right += total
        return math.pi - right, math.pi - (total - right)
    if right >= 0.0:
        return math.pi - right, -10.0
    return -10.0, math.pi + right


@inline
def _promise(length: float, offset: float, reach: float, saving: float) -> float:
    """Length of the path by a vertex `length` away once its bend, `saving` short of straight, is pulled tight."""
    s = saving * saving
    # 1 - cos(saving), to 2e-9 up to 1 and to 1e-3 at pi.
    versine = s * (0.5 - s * (1 / 24 - s * (1 / 720 - s * (1 / 40320 - s / 3628800))))
    squared = (length + reach) ** 2 - 2.0 * length * reach * versine
    return offset + (math.sqrt(squared) if squared > 0.0 else 0.0)


@inline
def _take(
    found: FloatArray,
    distance: float,
    z: int,
    zx: float,
    zy: float,
    saving: float,
    k: int,
    ax: float,
    ay: float,
) -> None:
    """Note the path of length `distance`, if it is the shortest so far, for `_settle` to make a state of.

    It leads straight to the vertex z at (zx, zy) and on by z's own path. `saving` is what pulling it tight saves in
    angle, positive when z is passed on its left and negative on its right; `_REAL_BEND` where it bends at z for good.
    (ax, ay) is the direction of v's spoke k.
    """
    if distance < found[0]:
        found[0], found[1], found[2], found[3] = distance, z, zx, zy
        found[4], found[5], found[6], found[7] = saving, k, ax, ay


@inline
def _settle(v: int, t: Tables, state: FloatArray, found: FloatArray) -> None:
    """Give v the path that was found, and the direction of that path once it is pulled tight."""
    z, zx, zy, saving, k, ax, ay = int(found[1]), found[2], found[3], found[4], int(found[5]), found[6], found[7]
    reach = math.sqrt(zx * zx + zy * zy)
    offset = state[z, DISTANCE]
    if saving != _REAL_BEND and state[z, REACH] > 0.0:
        # On to the last bend of z, in the direction in which it is seen from z.
        cosine, sine, further = math.cos(saving), math.sin(saving), state[z, REACH] / reach
        zx, zy = zx + further * (zx * cosine - zy * sine), zy + further * (zx * sine + zy * cosine)
        reach = math.sqrt(zx * zx + zy * zy)
        offset = state[z, OFFSET]
    fan = t.turn_id[k, FAN_HERE]
    state[v, DISTANCE], state[v, OFFSET], state[v, REACH] = found[0], offset, reach
    state[v, ANGLE] = t.turn[k, ANGLE_HERE] + math.atan2(ax * zy - ay * zx, ax * zx + ay * zy)
    state[v, FAN], state[v, TOTAL] = fan, t.total[fan]


@inline
def _may_agree(
    state: FloatArray, right: int, right_length: float, right_saving: float, left: int, left_length: float,
    left_saving: float,
) -> bool:  # fmt: skip
    """Whether two vertices may see the last bend of their paths in the same place: quick, and right for nearly all."""
    if right_saving <= 0.0 or left_saving <= 0.0:
        return False
    one = _promise(right_length, state[right, OFFSET], state[right, REACH], right_saving)
    other = _promise(left_length, state[left, OFFSET], state[left, REACH], left_saving)
    # Beyond 1, beside the source, the promise is not as good as that.
    return bool(abs(one - other) <= 1e-6 * one or max(right_saving, left_saving) > 1.0)


@jit
def _common_source(
    state: FloatArray,
    right: int,
    rx: float,
    ry: float,
    right_saving: float,
    left: int,
    lx: float,
    ly: float,
    left_saving: float,
) -> float:
    """Length of the straight path between two vertices whose straight paths come from one point; ``inf`` if not so.

    Both limits of a cone see the last bend of their paths in the same place of the plane: then no curvature lies
    between the two paths, and the cone is flat as far as that point. Exact, and the walk need not go on.
    """
    right_reach, left_reach, offset = state[right, REACH], state[left, REACH], state[right, OFFSET]
    scale = offset + right_reach
    # Paths that were cut short by the tolerance are not straight.
    if (
        abs(offset - state[left, OFFSET]) > 1e-12 * scale
        or state[right, DISTANCE] - offset - right_reach > 1e-11 * scale
        or state[left, DISTANCE] - state[left, OFFSET] - left_reach > 1e-11 * scale
    ):
        return np.inf
    cosine, sine, further = math.cos(right_saving), math.sin(right_saving), right_reach / math.sqrt(rx * rx + ry * ry)
    qx, qy = rx + further * (rx * cosine - ry * sine), ry + further * (rx * sine + ry * cosine)
    cosine, sine, further = math.cos(left_saving), -math.sin(left_saving), left_reach / math.sqrt(lx * lx + ly * ly)
    off_x, off_y = lx + further * (lx * cosine - ly * sine) - qx, ly + further * (lx * sine + ly * cosine) - qy
    if off_x * off_x + off_y * off_y > (1e-9 * scale) ** 2 or rx * qy - ry * qx < 0.0 or qx * ly - qy * lx < 0.0:
        return np.inf
    return float(offset + math.sqrt(qx * qx + qy * qy))


@jit
def _over_many(k: int, t: Tables, state: FloatArray, found: FloatArray) -> None:
    """Note the straight path over an edge of more than two faces, left of a spoke k of the vertex to be visited.

    Which face it comes from, the ends of the edge know: if both see one point in a straight line, at the distances and
    at an angle that belong together in a plane, the leaf in which they see it is flat as far as that point.
    """
    a, b = t.spoke_id[k, NEIGHBOUR], t.spoke_id[k, NEXT_NEIGHBOUR]
    ra, rb, begin = state[a, REACH], state[b, REACH], state[a, OFFSET]
    if not (0.0 < ra < np.inf and 0.0 < rb < np.inf):
        return
    rounding = 1e-11 * (begin + ra)
    if (
        abs(begin - state[b, OFFSET]) > rounding
        or abs(state[a, DISTANCE] - begin - ra) > rounding
        or abs(state[b, DISTANCE] - begin - rb) > rounding
    ):
        return
    along, height, base = t.spoke[k, ALONG], t.spoke[k, HEIGHT], t.spoke[k, BASE]
    x = 0.5 * ((ra - rb) * (ra + rb) / base + base)
    y = math.sqrt(max(ra * ra - x * x, 0.0))
    crossing = x * height + along * y
    distance = begin + math.sqrt((along - x) ** 2 + (height + y) ** 2)
    if not 0.0 <= crossing <= (y + height) * base or distance >= found[0]:
        return
    for i in range(t.first[a], t.first[a + 1]):
        if t.spoke_id[i, NEIGHBOUR] == b and t.turn_id[i, FAN_HERE] == state[a, FAN]:
            turn = abs(state[a, ANGLE] - t.turn[i, ANGLE_HERE])
            if state[a, TOTAL] > 0.0:
                turn = min(turn, state[a, TOTAL] - turn)
            if abs(turn - math.atan2(y, x)) < 1e-8:
                # Seen from v, a lies at (-along, -height), and the point x further along and y below it.
                saving = math.atan2(along * y + height * x, height * y - along * x)
                _take(found, distance, a, -along, -height, saving, k, -along, -height)
                return


@inline
def _look_around(
    v: int,
    t: Tables,
    state: FloatArray,
    found: FloatArray,
    side: AnyArray,
    saving: FloatArray,
    promise: FloatArray,
) -> float:
    """Judge v's neighbours: the best path along an edge, and what each neighbour promises.

    For each spoke, counted from v's first: `side` +1 if its neighbour's path is shorter passing left of it, -1 right,
    0 if it really bends there, 2 if not visited yet; `saving` and `promise`. Returns the smallest promise.
    """
    smallest = np.inf
    for k in range(t.first[v], t.first[v + 1]):
        i = k - t.first[v]
        w = t.spoke_id[k, NEIGHBOUR]
        promise[i] = np.inf
        if state[w, DISTANCE] == np.inf:
            side[i] = 2
            continue
        length = t.spoke[k, LENGTH]
        side[i] = 0
        most = right = left = -1.0
        if state[w, FAN] == t.turn_id[k, FAN_THERE]:
            right, left = _savings(t.turn[k, ANGLE_THERE], state[w, ANGLE], state[w, TOTAL])
            most = max(right, left)
            if most > _STRAIGHT:
                side[i] = 1 if left >= right else -1
                saving[i] = most
                promise[i] = _promise(length, state[w, OFFSET], state[w, REACH], most)
                smallest = min(smallest, promise[i])
        bend = _REAL_BEND
        if most >= -_STRAIGHT:
            bend = most if left >= right else -most
        _take(found, length + state[w, DISTANCE], w, length, 0.0, bend, k, 1.0, 0.0)
    return float(smallest)


class Points(NamedTuple):
    """Sources inside faces, for walks to end at. One on an edge is listed in the faces on both sides.

    Attributes
    ----------
    first : (m,) int64
        First entry of each face, -1 if it has none.
    following : (e,) int64
        The next entry of the same face, -1 after the last.
    barycentric : (e, 3) float64
        Where the point lies in that face.
    row : (e,) int64
        Row of the state that stands for the point.
    """

    first: IntArray
    following: IntArray
    barycentric: FloatArray
    row: IntArray


@jit
def _arrive(
    points: Points | None, t: Tables, state: FloatArray, found: FloatArray, h: int, k: int, first_x: float,
    first_y: float, wx: float, wy: float, ax: float, ay: float, bx: float, by: float, rx: float, ry: float,
    lx: float, ly: float,
) -> bool:  # fmt: skip
    """Note the straight paths to the sources inside the face behind half-edge `h`; whether one is the shortest so far.

    That face is a, w, b; only what lies in the cone is seen in a straight line.
    """
    arrived = False
    if points is None:
        return arrived
    face, right_of_w = t.step_id[h, TO_RIGHT] // 3, t.step_id[h, TO_RIGHT] % 3
    entry = points.first[face]
    while entry >= 0:
        # From w, its face runs first to b and then to a.
        at_w, at_b = points.barycentric[entry, right_of_w - 1], points.barycentric[entry, right_of_w]
        at_a = points.barycentric[entry, right_of_w - 2]
        x, y = at_w * wx + at_a * ax + at_b * bx, at_w * wy + at_a * ay + at_b * by
        slack = 1e-12 * (x * x + y * y)
        row = points.row[entry]
        distance = state[row, DISTANCE] + math.sqrt(x * x + y * y)
        if rx * y - ry * x >= -slack and x * ly - y * lx >= -slack and distance < found[0]:
            _take(found, distance, row, x, y, _REAL_BEND, k, first_x, first_y)
            arrived = True
        entry = points.following[entry]
    return arrived


@jit
def _hand_on(label: IntArray | None, v: int, z: int) -> None:
    """Give v the label of z, if there are labels."""
    if label is not None:
        label[v] = label[z]


@jit
def views(faces: IntArray, barycentric: FloatArray, F: IntArray, t: Tables) -> tuple[IntArray, FloatArray]:
    """How the corners (3 k,) of faces see points in them: the state (3 k, 6) of each, for a source at distance 0."""
    vertex = np.empty(3 * len(faces), np.int64)
    state = np.zeros((3 * len(faces), 6))
    for i in range(len(faces)):
        for c in range(3):
            h = 3 * faces[i] + c
            v = vertex[3 * i + c] = F[faces[i], c]
            k = t.first[v]
            while t.turn_id[k, CORNER] != h:
                k += 1
            base = t.spoke[k, BASE]
            ax, ay = -t.spoke[k, ALONG], -t.spoke[k, HEIGHT]
            at_a, at_b = barycentric[i, (c + 1) % 3], barycentric[i, (c + 2) % 3]
            x, y = at_a * ax + at_b * (ax + base), (at_a + at_b) * ay
            row = state[3 * i + c]
            row[DISTANCE] = row[REACH] = math.sqrt(x * x + y * y)
            # A source at v itself leaves v without a direction.
            row[FAN] = t.turn_id[k, FAN_HERE] if row[REACH] > 1e-12 * base else NO_FAN
            row[ANGLE] = t.turn[k, ANGLE_HERE] + math.atan2(ax * y - ay * x, ax * x + ay * y)
            row[TOTAL] = t.total[t.turn_id[k, FAN_HERE]]
    return vertex, state


@inline
def _walk(
    v: int,
    k: int,
    t: Tables,
    points: Points | None,
    state: FloatArray,
    side: AnyArray,
    saving: FloatArray,
    found: FloatArray,
    tolerance: float,
) -> int:
    """Walk from v through the corner left of its spoke k, between the vertices that say left and those that say right.

    Returns the vertex to visit first if the walk meets one that is not visited yet, -1 otherwise.
    """
    k_left = t.spoke_id[k, NEXT_SPOKE]
    i, i_left = k - t.first[v], k_left - t.first[v]
    base = t.spoke[k, BASE]
    right, left = t.spoke_id[k, NEIGHBOUR], t.spoke_id[k, NEXT_NEIGHBOUR]
    ax, ay = -t.spoke[k, ALONG], -t.spoke[k, HEIGHT]
    bx, by = ax + base, ay
    first_x, first_y = ax, ay
    rx, ry, lx, ly = ax, ay, bx, by
    right_saving = saving[i] if side[i] == 1 else -1.0
    left_saving = saving[i_left] if side[i_left] == -1 else -1.0
    right_length, left_length = t.spoke[k, LENGTH], t.spoke[k_left, LENGTH]
    if _may_agree(state, right, right_length, right_saving, left, left_length, left_saving):
        distance = _common_source(state, right, rx, ry, right_saving, left, lx, ly, left_saving)
        if distance < np.inf:
            _take(found, distance, right, rx, ry, right_saving, k, first_x, first_y)
            return -1
    far = 4.0 * found[0] * found[0]
    h = t.turn_id[k, CORNER]
    wait_for = -1
    while True:
        w = t.step_id[h, FAR]
        if w < 0:
            break
        # Where the walk goes next is known late, but both ways are known now.
        prefetch(t.step, t.step_id[h, TO_RIGHT])
        prefetch(t.step, t.step_id[h, TO_LEFT])
        ux, uy = ax - bx, ay - by
        x, y = t.step[h, FAR_X], t.step[h, FAR_Y]
        wx = bx + x * ux - y * uy
        wy = by + x * uy + y * ux
        if _arrive(points, t, state, found, h, k, first_x, first_y, wx, wy, ax, ay, bx, by, rx, ry, lx, ly):
            break
        # Outside the cone there is nothing to decide.
        if rx * wy - ry * wx <= 0.0:
            ax, ay = wx, wy
            h = t.step_id[h, TO_LEFT]
        elif wx * ly - wy * lx <= 0.0:
            bx, by = wx, wy
            h = t.step_id[h, TO_RIGHT]
        else:
            if state[w, DISTANCE] == np.inf:
                wait_for = w
                break
            squared = wx * wx + wy * wy
            length = math.sqrt(squared)
            # Of a bend close behind w, pulling tight may leave nothing.
            reach = max(state[w, REACH], min(length, state[w, DISTANCE]))
            to_right = to_left = -1.0
            if state[w, FAN] == t.step_id[h, FAR_FAN]:
                back = t.step[h, FAR_ANGLE] + math.atan2(wx * by - wy * bx, squared - (bx * wx + by * wy))
                to_right, to_left = _savings(back, state[w, ANGLE], state[w, TOTAL])
            most = max(to_right, to_left)
            if most < _STRAIGHT:
                # A source, a real bend, or straight on along a path that is known: the walk is over.
                bend = most if most >= -_STRAIGHT else _REAL_BEND
                _take(found, length + state[w, DISTANCE], w, wx, wy, bend, k, first_x, first_y)
                return -1
            if to_left >= to_right:
                rx, ry, right, right_saving, right_length = wx, wy, w, most, length
                ax, ay = wx, wy
                h = t.step_id[h, TO_LEFT]
            else:
                lx, ly, left, left_saving, left_length = wx, wy, w, most, length
                bx, by = wx, wy
                h = t.step_id[h, TO_RIGHT]
            # What is left to gain by going on, to second order in the bend: little on the whole path, and also on the
            # way to w, so that many short ways do not add up.
            gain = 0.5 * most * most * length * reach
            enough = tolerance * min(length + state[w, DISTANCE], _SHARE * length) * (length + reach)
            if gain < enough and right_saving > 0.0 and left_saving > 0.0:
                if _may_agree(state, right, right_length, right_saving, left, left_length, left_saving):
                    distance = _common_source(state, right, rx, ry, right_saving, left, lx, ly, left_saving)
                    if distance < np.inf:
                        _take(found, distance, right, rx, ry, right_saving, k, first_x, first_y)
                break
        if ax * ax + ay * ay > far and bx * bx + by * by > far:
            break
    bend = right_saving if right_saving > 0.0 else _REAL_BEND
    _take(found, right_length + state[right, DISTANCE], right, rx, ry, bend, k, first_x, first_y)
    bend = -left_saving if left_saving > 0.0 else _REAL_BEND
    _take(found, left_length + state[left, DISTANCE], left, lx, ly, bend, k, first_x, first_y)
    return wait_for


@inline
def _cone_forecast(
    ax: float, ay: float, bx: float, by: float, da: float, db: float, rx: float, ry: float, lx: float, ly: float
) -> float:
    """Length of the shortest way from the origin through the cone to a source at distances da and db behind ab."""
    ux, uy = bx - ax, by - ay
    scale = 1.0 / (ux * ux + uy * uy)
    x = 0.5 * ((da - db) * (da + db) * scale + 1.0)
    y_squared = da * da * scale - x * x
    y = math.sqrt(y_squared) if y_squared > 0.0 else 0.0
    sx, sy = ax + x * ux + y * uy, ay + x * uy - y * ux
    if rx * sy - ry * sx < 0.0:
        return math.sqrt(rx * rx + ry * ry) + math.sqrt((sx - rx) ** 2 + (sy - ry) ** 2)
    if sx * ly - sy * lx < 0.0:
        return math.sqrt(lx * lx + ly * ly) + math.sqrt((sx - lx) ** 2 + (sy - ly) ** 2)
    return math.sqrt(sx * sx + sy * sy)


@jit
def _push(
    cones: FloatArray, ids: AnyArray, top: int, forecast: float, a: int, b: int, h: int, spoke: int,
    ax: float, ay: float, bx: float, by: float, rx: float, ry: float, lx: float, ly: float,
) -> int:  # fmt: skip
    if top == len(cones):
        return top
    row = cones[top]
    row[0], row[1], row[2], row[3], row[4] = forecast, ax, ay, bx, by
    row[5], row[6], row[7], row[8] = rx, ry, lx, ly
    ids[top, 0], ids[top, 1], ids[top, 2], ids[top, 3] = a, b, h, spoke
    return top + 1


@jit
def _search(
    v: int,
    t: Tables,
    points: Points | None,
    state: FloatArray,
    found: FloatArray,
    cones: FloatArray,
    ids: AnyArray,
    max_steps: int,
) -> None:
    """Look for a shorter path from v among all cones whose forecast is better than what is known, best first.

    The cone splits at every vertex in it, so that both sides are tried; the circles about the ends of an edge tell
    what lies behind it.
    """
    top = 0
    for k in range(t.first[v], t.first[v + 1]):
        corner = t.turn_id[k, CORNER]
        if corner < 0:
            continue
        a, b = t.spoke_id[k, NEIGHBOUR], t.spoke_id[k, NEXT_NEIGHBOUR]
        base = t.spoke[k, BASE]
        ax, ay = -t.spoke[k, ALONG], -t.spoke[k, HEIGHT]
        bx, by = ax + base, ay
        forecast = _cone_forecast(ax, ay, bx, by, state[a, DISTANCE], state[b, DISTANCE], ax, ay, bx, by)
        if forecast < found[0]:
            top = _push(cones, ids, top, forecast, a, b, corner, k, ax, ay, bx, by, ax, ay, bx, by)
    for i in range(1, top):  # the most promising on top
        for j in range(i, 0, -1):
            if cones[j, 0] > cones[j - 1, 0]:
                for column in range(9):
                    cones[j, column], cones[j - 1, column] = cones[j - 1, column], cones[j, column]
                for column in range(4):
                    ids[j, column], ids[j - 1, column] = ids[j - 1, column], ids[j, column]
    steps = 0
    while top > 0 and steps < max_steps:
        top -= 1
        row = cones[top]
        if not row[0] < found[0] * (1 - 1e-9):
            continue
        ax, ay, bx, by, rx, ry, lx, ly = row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8]
        a, b, h, spoke = ids[top, 0], ids[top, 1], ids[top, 2], ids[top, 3]
        while steps < max_steps:
            steps += 1
            w = t.step_id[h, FAR]
            if w < 0:
                break
            ux, uy = ax - bx, ay - by
            x, y = t.step[h, FAR_X], t.step[h, FAR_Y]
            wx = bx + x * ux - y * uy
            wy = by + x * uy + y * ux
            to_right, to_left = t.step_id[h, TO_RIGHT], t.step_id[h, TO_LEFT]
            first_x, first_y = -t.spoke[spoke, ALONG], -t.spoke[spoke, HEIGHT]
            _arrive(points, t, state, found, h, spoke, first_x, first_y, wx, wy, ax, ay, bx, by, rx, ry, lx, ly)
            if rx * wy - ry * wx <= 0.0:
                a, ax, ay, h = w, wx, wy, to_left
                continue
            if wx * ly - wy * lx <= 0.0:
                b, bx, by, h = w, wx, wy, to_right
                continue
            if state[w, DISTANCE] < np.inf:
                right = left = -1.0
                if state[w, FAN] == t.step_id[h, FAR_FAN]:
                    back = t.step[h, FAR_ANGLE] + math.atan2(wx * by - wy * bx, wx * (wx - bx) + wy * (wy - by))
                    right, left = _savings(back, state[w, ANGLE], state[w, TOTAL])
                bend = left if left >= right else -right
                if max(right, left) < -_STRAIGHT:
                    bend = _REAL_BEND
                length = math.sqrt(wx * wx + wy * wy)
                _take(found, length + state[w, DISTANCE], w, wx, wy, bend, spoke, first_x, first_y)
                if state[w, FAN] == NO_FAN:
                    break
            right_forecast = _cone_forecast(ax, ay, wx, wy, state[a, DISTANCE], state[w, DISTANCE], rx, ry, wx, wy)
            left_forecast = _cone_forecast(wx, wy, bx, by, state[w, DISTANCE], state[b, DISTANCE], wx, wy, lx, ly)
            limit = found[0] * (1 - 1e-9)
            if not min(right_forecast, left_forecast) < limit:
                break
            if right_forecast <= left_forecast:
                if left_forecast < limit:
                    top = _push(cones, ids, top, left_forecast, w, b, to_left, spoke, wx, wy, bx, by, wx, wy, lx, ly)
                b, bx, by, lx, ly, h = w, wx, wy, wx, wy, to_right
            else:
                if right_forecast < limit:
                    top = _push(cones, ids, top, right_forecast, a, w, to_right, spoke, ax, ay, wx, wy, rx, ry, wx, wy)
                a, ax, ay, rx, ry, h = w, wx, wy, wx, wy, to_left


class _Workspace(NamedTuple):
    found: FloatArray
    side: AnyArray
    saving: FloatArray
    promise: FloatArray
    cones: FloatArray
    ids: AnyArray


@inline
def _visit(
    v: int,
    may_wait: bool,
    t: Tables,
    points: Points | None,
    state: FloatArray,
    label: IntArray | None,
    work: _Workspace,
    tolerance: float,
    shortfall: float,
    max_steps: int,
) -> int:
    """Give v the best path that can be found from its neighbours', or name a vertex to visit first."""
    found, side, promise = work.found, work.side, work.promise
    old = state[v, DISTANCE]
    found[0] = old
    smallest = _look_around(v, t, state, found, side, work.saving, promise)
    for _ in range(2):
        best, best_promise = -1, found[0] * (1 - 1e-12)
        for k in range(t.first[v], t.first[v + 1]):
            if t.turn_id[k, CORNER] < 0:
                continue
            if t.turn_id[k, MANY] > 0:
                _over_many(k, t, state, found)
            i, i_left = k - t.first[v], t.spoke_id[k, NEXT_SPOKE] - t.first[v]
            # A way in lies where one neighbour says left and the next one right (or is not known yet).
            if side[i] > 0 and (side[i_left] == -1 or side[i_left] == 2):
                forecast = np.inf
                if side[i] == 1:
                    forecast = promise[i]
                if side[i_left] == -1:
                    forecast = min(forecast, promise[i_left])
                if forecast < best_promise:
                    best, best_promise = k, forecast
        if best < 0:
            break
        wait_for = _walk(v, best, t, points, state, side, work.saving, found, tolerance)
        if wait_for >= 0 and may_wait:
            return wait_for
        promise[best - t.first[v]] = np.inf
        promise[t.spoke_id[best, NEXT_SPOKE] - t.first[v]] = np.inf
    if found[0] > smallest * (1 + shortfall):
        _search(v, t, points, state, found, work.cones, work.ids, max_steps)
    if found[0] < old:
        _settle(v, t, state, found)
        _hand_on(label, v, int(found[1]))
    return -1


@inline
def _read_ahead(order: IntArray, i: int, t: Tables, state: FloatArray) -> None:
    """Have what the next visits begin with fetched: a third of the time would go by waiting for it."""
    if i + 3 < len(order):
        prefetch(t.first, order[i + 3])
    if i + 2 < len(order):
        v = order[i + 2]
        for k in range(t.first[v], t.first[v + 1]):
            prefetch(t.spoke, k)
            prefetch(t.turn, k)
    if i + 1 < len(order):
        v = order[i + 1]
        for k in range(t.first[v], t.first[v + 1]):
            prefetch(state, t.spoke_id[k, NEIGHBOUR])
            prefetch(t.step, t.turn_id[k, CORNER])


@jit
def _unfold(
    order: IntArray,
    t: Tables,
    state: FloatArray,
    label: IntArray | None,
    points: Points | None,
    is_stale: AnyArray,
    work: _Workspace,
    waiting: IntArray,
    tolerance: float,
    shortfall: float,
    max_steps: int,
    max_passes: int,
) -> None:
    """Pass over `order` until nothing is stale."""
    order, t, state, label, points = uncounted((order, t, state, label, points))
    is_stale, work, waiting = uncounted((is_stale, work, waiting))
    for _ in range(max_passes):
        found_stale = False
        for i in range(len(order)):
            _read_ahead(order, i, t, state)
            start = order[i]
            if not is_stale[start]:
                continue
            waiting[0] = start
            depth = 1
            # A source that begins later has a path already.
            may_wait = state[start, FAN] != NO_FAN or state[start, DISTANCE] == np.inf
            while depth > 0:
                v = waiting[depth - 1]
                old = state[v, DISTANCE]
                wait_for = _visit(v, may_wait, t, points, state, label, work, tolerance, shortfall, max_steps)
                if wait_for >= 0:
                    may_wait = depth < _MAX_WAITING
                    for j in range(depth):
                        may_wait = may_wait and waiting[j] != wait_for
                    if may_wait:
                        waiting[depth] = wait_for
                        depth += 1
                    continue
                depth -= 1
                # One that stays without a path must not be waited for again.
                may_wait = state[v, DISTANCE] < np.inf
                is_stale[v] = False
                if state[v, DISTANCE] < old * (1 - 1e-9):
                    for k in range(t.first[v], t.first[v + 1]):
                        w = t.spoke_id[k, NEIGHBOUR]
                        # Farther, or without a path so far, and visited before this one.
                        if not is_stale[w] and state[v, DISTANCE] < state[w, DISTANCE]:
                            is_stale[w] = found_stale = True
        if not found_stale:
            break


@jit
def unfold(
    order: IntArray,
    t: Tables,
    state: FloatArray,
    label: IntArray | None,
    points: Points | None,
    tolerance: float,
    shortfall: float,
    max_steps: int,
    max_passes: int,
) -> None:
    """Distance by straight paths through strips of triangles, to be read from `state`.

    Parameters
    ----------
    order : (n,) int64
        Vertices, near ones first. One that comes too early is visited again.
    t : Tables
        The triangulation.
    state : (n + p, 6) float64
        What is known of each vertex and of each of p sources inside faces; changed in place. Distance is ``inf`` where
        nothing is known, and where no source is reached.
    label : (n + p,) int64 or None
        Handed on from the end of a path to its beginning.
    points : Points or None
        The sources inside faces.
    tolerance : float
        Relative gain below which a path is not straightened further.
    shortfall : float
        A vertex that is by more than this fraction farther than a neighbour promised is searched for a better path.
    max_steps : int
        Triangles that one search may cross.
    max_passes : int
        Passes over vertices that a later one may have improved.
    """
    n = len(t.first) - 1
    is_stale = np.ones(n, np.bool_)
    for v in range(n):
        # A source that begins later may be overtaken; a corner that sees a source in its face hardly is.
        is_stale[v] = state[v, DISTANCE] == np.inf or (state[v, DISTANCE] > 0.0 and state[v, FAN] == NO_FAN)
    degree = 0
    for v in range(n):
        degree = max(degree, t.first[v + 1] - t.first[v])
    work = _Workspace(
        np.zeros(8),
        np.zeros(degree, np.int8),
        np.zeros(degree),
        np.zeros(degree),
        np.zeros((_MAX_CONES, 9)),
        np.zeros((_MAX_CONES, 4), np.int32),
    )
    waiting = np.empty(_MAX_WAITING, np.int64)
    _unfold(order, t, state, label, points, is_stale, work, waiting, tolerance, shortfall, max_steps, max_passes)
