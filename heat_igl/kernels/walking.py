"""Walks: the path from a vertex is followed straight through a strip of triangles, past vertices left or right.

Vertex v is the origin, and the walk goes on inside the cone between two vertices, the right limit R and the left limit
L. Half-edges that it crosses run from right (a) to left (b). At a vertex inside the cone, the known path from there
tells on which side to pass; docs/refinement.md derives the rule.
"""

import cython
from cython.cimports.heat_igl.kernels.between import take_between
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.walking import SHARE
from cython.cimports.heat_igl.kernels.walks import (
    BENDS,
    NOT_VISITED,
    REAL_BEND,
    SAYS_LEFT,
    SAYS_RIGHT,
    STRAIGHT,
    Limit,
    Query,
    Savings,
    View,
    Walk,
    arrive,
    promise,
    savings,
    take,
)
from cython.cimports.libc.math import INFINITY, atan2, cos, fabs, sin, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def look_around(q: Query, v: cython.int) -> cython.double:
    """Find the best path along an edge at v, and in ``q.advice`` the better side of each neighbour.

    Returns the smallest length that a neighbour promises: that of the path over it, once the bend there is removed.
    """
    smallest: cython.double = INFINITY
    first: cython.int = q.t.first[v]
    k: cython.int
    turned: Savings
    for k in range(first, q.t.first[v + 1]):
        spoke = cython.address(q.t.spoke[k])
        turn = cython.address(q.t.turn[k])
        w = cython.address(q.walk[spoke.neighbour])
        advice = cython.address(q.advice[k - first])
        advice.promise = INFINITY
        if w.distance == INFINITY:
            advice.side = NOT_VISITED
            continue
        advice.side = BENDS
        most: cython.double = -1.0
        bend: cython.double = REAL_BEND
        if w.fan == turn.fan_there:
            turned = savings(turn.there, w)
            most = max(turned.right, turned.left)
            if most > STRAIGHT:
                advice.side = SAYS_LEFT if turned.left >= turned.right else SAYS_RIGHT
                advice.saving = most
                advice.promise = promise(spoke.length, w, most)
                smallest = min(smallest, advice.promise)
            if most >= -STRAIGHT:
                bend = most if turned.left >= turned.right else -most
        take(q, spoke.length + w.distance, spoke.neighbour, spoke.length, 0.0, bend, k, 1.0, 0.0, turn.there)
    return smallest


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def walk_through(q: Query, v: cython.int, k: cython.int) -> cython.int:
    """Walk from v through the corner left of spoke k, past each vertex on the better side.

    Returns the vertex to visit first if the walk meets one that is not visited yet, -1 otherwise.
    """
    view: View
    right: Limit
    left: Limit
    view = _cone_over(q, v, k, cython.address(right), cython.address(left))
    first_x: cython.double = view.ax
    first_y: cython.double = view.ay
    if _take_at_once(q, cython.address(right), cython.address(left), k):
        return -1
    has_points: cython.bint = q.first_inside.shape[0] > 0
    far: cython.double = 4.0 * q.found.distance * q.found.distance
    wait_for: cython.int = -1
    turned: Savings
    while view.h >= 0 and not _is_barrier(q, view.h):
        step = cython.address(q.t.step[view.h])
        # Where the walk goes next is known late, but both ways are known now.
        prefetch(cython.address(q.t.step[max(step.to_right, 0)]))
        prefetch(cython.address(q.t.step[max(step.to_left, 0)]))
        ux: cython.double = view.ax - view.bx
        uy: cython.double = view.ay - view.by
        wx: cython.double = view.bx + step.x * ux - step.y * uy
        wy: cython.double = view.by + step.x * uy + step.y * ux
        if has_points and arrive(q, view, wx, wy):
            break
        # Outside the cone there is nothing to decide.
        if view.rx * wy - view.ry * wx <= 0.0:
            view.ax, view.ay, view.h = wx, wy, step.to_left
        elif wx * view.ly - wy * view.lx <= 0.0:
            view.bx, view.by, view.h = wx, wy, step.to_right
        else:
            w = cython.address(q.walk[step.vertex])
            if w.distance == INFINITY:
                wait_for = step.vertex
                break
            squared: cython.double = wx * wx + wy * wy
            length: cython.double = sqrt(squared)
            # Of a bend close behind w, pulling tight may leave nothing.
            reach: cython.double = max(w.reach, min(length, w.distance))
            turned.right = turned.left = -1.0
            back: cython.double = atan2(wx * view.by - wy * view.bx, squared - (view.bx * wx + view.by * wy))
            if w.fan == step.fan:
                turned = savings(step.direction + back, w)
            most: cython.double = max(turned.right, turned.left)
            if most < STRAIGHT:
                # A source, a real bend, or straight on along a path that is known: the walk is over.
                bend: cython.double = most if most >= -STRAIGHT else REAL_BEND
                there: cython.double = step.direction + back
                take(q, length + w.distance, step.vertex, wx, wy, bend, k, first_x, first_y, there)
                return -1
            if turned.left >= turned.right:
                right.x, right.y, right.length, right.saving, right.vertex = wx, wy, length, most, step.vertex
                view.rx, view.ry, view.ax, view.ay, view.h = wx, wy, wx, wy, step.to_left
            else:
                left.x, left.y, left.length, left.saving, left.vertex = wx, wy, length, most, step.vertex
                view.lx, view.ly, view.bx, view.by, view.h = wx, wy, wx, wy, step.to_right
            if take_between(q, cython.address(right), cython.address(left), k, q.roughness):
                return -1
            if right.saving > 0.0 and left.saving > 0.0 and _is_little(q, length, w.distance, reach, most):
                _take_common_source(q, cython.address(right), cython.address(left), k)
                break
        if view.ax * view.ax + view.ay * view.ay > far and view.bx * view.bx + view.by * view.by > far:
            break
    _take_limit(q, cython.address(right), 1.0, k)
    _take_limit(q, cython.address(left), -1.0, k)
    return wait_for


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _is_barrier(q: Query, h: cython.int) -> cython.bint:
    """Whether a curve that is a source runs behind half-edge h: nothing beyond is nearer."""
    return q.barrier.shape[0] > 0 and q.barrier[h // 3] != 0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _is_little(
    q: Query, length: cython.double, distance: cython.double, reach: cython.double, bend: cython.double
) -> cython.bint:
    """Whether going on gains little, to second order in the bend at a vertex `length` away.

    Little of the whole path, and also of the way to that vertex, so that many short ways do not add up.
    """
    gain: cython.double = 0.5 * bend * bend * length * reach
    return gain < q.tolerance * min(length + distance, SHARE * length) * (length + reach)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _cone_over(
    q: Query, v: cython.int, k: cython.int, right: cython.pointer[Limit], left: cython.pointer[Limit]
) -> View:
    """The view from v through the corner left of the spoke k of v; sets the limits to the ends of the side opposite."""
    spoke = cython.address(q.t.spoke[k])
    view: View
    view.ax, view.ay = -spoke.along, -spoke.height
    view.bx, view.by = view.ax + spoke.base, view.ay
    view.h, view.spoke = q.t.turn[k].across, k
    view.rx, view.ry, view.lx, view.ly = view.ax, view.ay, view.bx, view.by
    right_advice = cython.address(q.advice[k - q.t.first[v]])
    left_advice = cython.address(q.advice[spoke.next - q.t.first[v]])
    right.vertex, right.length = spoke.neighbour, spoke.length
    left.vertex, left.length = spoke.next_neighbour, q.t.spoke[spoke.next].length
    right.there, left.there = q.t.turn[k].there, q.t.turn[spoke.next].there
    right.saving = right_advice.saving if right_advice.side == SAYS_LEFT else -1.0
    left.saving = left_advice.saving if left_advice.side == SAYS_RIGHT else -1.0
    right.x, right.y, left.x, left.y = view.ax, view.ay, view.bx, view.by
    return view


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _take_limit(q: Query, limit: cython.pointer[Limit], side: cython.double, k: cython.int) -> cython.void:
    """Note the path over a limit of the cone at spoke k: the right one, for `side` 1, or the left one, for -1."""
    spoke = cython.address(q.t.spoke[k])
    distance: cython.double = limit.length + q.walk[limit.vertex].distance
    bend: cython.double = side * limit.saving if limit.saving > 0.0 else REAL_BEND
    take(q, distance, limit.vertex, limit.x, limit.y, bend, k, -spoke.along, -spoke.height, limit.there)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _take_common_source(
    q: Query, right: cython.pointer[Limit], left: cython.pointer[Limit], k: cython.int
) -> cython.bint:
    """Note the straight path between the limits of the cone at spoke k, if both see one source; whether they do."""
    if not _may_agree(q, right, left):
        return False
    distance: cython.double = _common_source(q, right[0], left[0])
    if not distance < INFINITY:
        return False
    spoke = cython.address(q.t.spoke[k])
    take(q, distance, right.vertex, right.x, right.y, right.saving, k, -spoke.along, -spoke.height, 0.0)
    return True


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _take_at_once(q: Query, right: cython.pointer[Limit], left: cython.pointer[Limit], k: cython.int) -> cython.bint:
    """Note the path between the limits of the cone at spoke k, if what they know gives it; whether it does."""
    return _take_common_source(q, right, left, k) or take_between(q, right, left, k, q.roughness)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _may_agree(q: Query, right: cython.pointer[Limit], left: cython.pointer[Limit]) -> cython.bint:
    """Whether two vertices may see the last bend of their paths in the same place: quick, and right for nearly all."""
    if right.saving <= 0.0 or left.saving <= 0.0:
        return False
    one: cython.double = promise(right.length, cython.address(q.walk[right.vertex]), right.saving)
    other: cython.double = promise(left.length, cython.address(q.walk[left.vertex]), left.saving)
    # Beyond 1, beside the source, the promise is not as good as that.
    return fabs(one - other) <= 1e-6 * one or max(right.saving, left.saving) > 1.0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _common_source(q: Query, right: Limit, left: Limit) -> cython.double:
    """Length of the straight path between two vertices whose straight paths come from one point; ``inf`` if not so.

    Both limits of a cone see the last bend of their paths in the same place of the plane: then no curvature lies
    between the two paths, and the cone is flat as far as that point. Exact, and the walk need not go on. On a surface
    with holes that proves nothing: one may lie between the two paths.
    """
    if q.has_holes:
        return INFINITY
    one: Walk = q.walk[right.vertex]
    other: Walk = q.walk[left.vertex]
    scale: cython.double = one.offset + one.reach
    # Paths that were cut short by the tolerance are not straight.
    if (
        fabs(one.offset - other.offset) > 1e-12 * scale
        or one.distance - one.offset - one.reach > 1e-11 * scale
        or other.distance - other.offset - other.reach > 1e-11 * scale
    ):
        return INFINITY
    c: cython.double = cos(right.saving)
    s: cython.double = sin(right.saving)
    further: cython.double = one.reach / sqrt(right.x * right.x + right.y * right.y)
    qx: cython.double = right.x + further * (right.x * c - right.y * s)
    qy: cython.double = right.y + further * (right.x * s + right.y * c)
    c, s = cos(left.saving), -sin(left.saving)
    further = other.reach / sqrt(left.x * left.x + left.y * left.y)
    off_x: cython.double = left.x + further * (left.x * c - left.y * s) - qx
    off_y: cython.double = left.y + further * (left.x * s + left.y * c) - qy
    near: cython.double = 1e-9 * scale
    if (
        off_x * off_x + off_y * off_y > near * near
        or right.x * qy - right.y * qx < 0.0
        or qx * left.y - qy * left.x < 0.0
    ):
        return INFINITY
    return one.offset + sqrt(qx * qx + qy * qy)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def cross_crowded(q: Query, k: cython.int) -> cython.void:
    """Note the straight path over an edge of more than two faces, left of a spoke k of the vertex to be visited.

    Which face it comes from, the ends of the edge know: if both see one point in a straight line, at the distances and
    at an angle that belong together in a plane, the leaf in which they see it is flat as far as that point.
    """
    spoke = cython.address(q.t.spoke[k])
    a = cython.address(q.walk[spoke.neighbour])
    b = cython.address(q.walk[spoke.next_neighbour])
    begin: cython.double = a.offset
    if not (0.0 < a.reach < INFINITY and 0.0 < b.reach < INFINITY):
        return
    rounding: cython.double = 1e-11 * (begin + a.reach)
    if (
        fabs(begin - b.offset) > rounding
        or fabs(a.distance - begin - a.reach) > rounding
        or fabs(b.distance - begin - b.reach) > rounding
    ):
        return
    along: cython.double = spoke.along
    height: cython.double = spoke.height
    x: cython.double = 0.5 * ((a.reach - b.reach) * (a.reach + b.reach) / spoke.base + spoke.base)
    y: cython.double = sqrt(max(a.reach * a.reach - x * x, 0.0))
    crossing: cython.double = x * height + along * y
    distance: cython.double = begin + sqrt((along - x) * (along - x) + (height + y) * (height + y))
    if not 0.0 <= crossing <= (y + height) * spoke.base or distance >= q.found.distance:
        return
    i: cython.int
    for i in range(q.t.first[spoke.neighbour], q.t.first[spoke.neighbour + 1]):
        if q.t.spoke[i].neighbour != spoke.next_neighbour or q.t.turn[i].fan_here != a.fan:
            continue
        turn: cython.double = fabs(a.angle - q.t.turn[i].here)
        if a.total > 0.0:
            turn = min(turn, a.total - turn)
        if fabs(turn - atan2(y, x)) < 1e-8:
            # Seen from v, a lies at (-along, -height), and the point x further along and y below it.
            saving: cython.double = atan2(along * y + height * x, height * y - along * x)
            take(q, distance, spoke.neighbour, -along, -height, saving, k, -along, -height, 0.0)
            return
