"""Search through all cones from a vertex, best first, for vertices at which no walk found the promised distance."""

import cython
from cython.cimports.heat_igl.kernels.walks import (
    NO_FAN,
    REAL_BEND,
    STRAIGHT,
    Cone,
    Query,
    Savings,
    View,
    arrive,
    savings,
    take,
)
from cython.cimports.libc.math import INFINITY, atan2, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def search(q: Query, v: cython.int) -> cython.void:
    """Look for a shorter path from v among all cones whose forecast is better than the known distance, best first.

    A cone is split at every vertex in it, so that both sides are tried. `_forecast` places the source behind an edge by
    the distances at both ends.
    """
    top: cython.int = _first_cones(q, v)
    steps: cython.int = 0
    has_points: cython.bint = q.first_inside.shape[0] > 0
    side: View  # of a cone that has been split
    while top > 0 and steps < q.max_steps:
        top -= 1
        cone: Cone = q.cone[top]
        if not cone.forecast < q.found.distance * (1 - 1e-9):
            continue
        view: View = cone.view
        a: cython.int = cone.a
        b: cython.int = cone.b
        while steps < q.max_steps:
            steps += 1
            if view.h < 0:
                break
            step = cython.address(q.t.step[view.h])
            ux: cython.double = view.ax - view.bx
            uy: cython.double = view.ay - view.by
            wx: cython.double = view.bx + step.x * ux - step.y * uy
            wy: cython.double = view.by + step.x * uy + step.y * ux
            if has_points:
                arrive(q, view, wx, wy)
            if view.rx * wy - view.ry * wx <= 0.0:
                a, view.ax, view.ay, view.h = step.vertex, wx, wy, step.to_left
                continue
            if wx * view.ly - wy * view.lx <= 0.0:
                b, view.bx, view.by, view.h = step.vertex, wx, wy, step.to_right
                continue
            w = cython.address(q.walk[step.vertex])
            if w.distance < INFINITY:
                _take_over(q, view, step.vertex, wx, wy, step.direction, w.fan == step.fan)
                if w.fan == NO_FAN:
                    break
            # Between a and w, with w as the left limit; and between w and b.
            side = view
            side.bx, side.by, side.lx, side.ly, side.h = wx, wy, wx, wy, step.to_right
            view.ax, view.ay, view.rx, view.ry, view.h = wx, wy, wx, wy, step.to_left
            right: cython.double = _forecast(side, q.walk[a].distance, w.distance)
            left: cython.double = _forecast(view, w.distance, q.walk[b].distance)
            limit: cython.double = q.found.distance * (1 - 1e-9)
            if not min(right, left) < limit:
                break
            if right <= left:
                if left < limit:
                    top = _push(q, top, left, view, step.vertex, b)
                b, view = step.vertex, side
            else:
                if right < limit:
                    top = _push(q, top, right, side, a, step.vertex)
                a = step.vertex


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _take_over(
    q: Query,
    view: View,
    end: cython.int,
    x: cython.double,
    y: cython.double,
    direction: cython.double,
    has_direction: cython.bint,
) -> cython.void:
    """Note the path straight to vertex `end` at (x, y), which ends the faces of a view, and on by that one's own path.

    `direction` is that of the edge from `end` to b, in the fan of the path if `has_direction`.
    """
    w = cython.address(q.walk[end])
    first = cython.address(q.t.spoke[view.spoke])
    turned: Savings
    turned.right = turned.left = -1.0
    there: cython.double = direction + atan2(x * view.by - y * view.bx, x * (x - view.bx) + y * (y - view.by))
    if has_direction:
        turned = savings(there, w)
    bend: cython.double = turned.left if turned.left >= turned.right else -turned.right
    if max(turned.right, turned.left) < -STRAIGHT:
        bend = REAL_BEND
    distance: cython.double = sqrt(x * x + y * y) + w.distance
    take(q, distance, end, x, y, bend, view.spoke, -first.along, -first.height, there)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _first_cones(q: Query, v: cython.int) -> cython.int:
    """Put the corners of v on the stack, the most promising on top; returns how many."""
    top: cython.int = 0
    i: cython.int
    j: cython.int
    k: cython.int
    view: View
    for k in range(q.t.first[v], q.t.first[v + 1]):
        if q.t.turn[k].corner < 0:
            continue
        view.h, view.spoke = q.t.turn[k].across, k
        spoke = cython.address(q.t.spoke[k])
        view.ax, view.ay = -spoke.along, -spoke.height
        view.bx, view.by = view.ax + spoke.base, view.ay
        view.rx, view.ry, view.lx, view.ly = view.ax, view.ay, view.bx, view.by
        forecast: cython.double = _forecast(
            view, q.walk[spoke.neighbour].distance, q.walk[spoke.next_neighbour].distance
        )
        if forecast < q.found.distance:
            top = _push(q, top, forecast, view, spoke.neighbour, spoke.next_neighbour)
    for i in range(1, top):
        for j in range(i, 0, -1):
            if not q.cone[j].forecast > q.cone[j - 1].forecast:
                break
            lower: Cone = q.cone[j]
            q.cone[j] = q.cone[j - 1]
            q.cone[j - 1] = lower
    return top


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _push(
    q: Query,
    top: cython.int,
    forecast: cython.double,
    view: View,
    a: cython.int,
    b: cython.int,
) -> cython.int:
    """Put a cone on the stack unless that is full; returns the new height."""
    if top == q.cone.shape[0]:
        return top
    cone = cython.address(q.cone[top])
    cone.view, cone.forecast, cone.a, cone.b = view, forecast, a, b
    return top + 1


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _forecast(view: View, da: cython.double, db: cython.double) -> cython.double:
    """Length of the shortest way from the origin through the cone to a source at distances da and db behind ab."""
    ux: cython.double = view.bx - view.ax
    uy: cython.double = view.by - view.ay
    scale: cython.double = 1.0 / (ux * ux + uy * uy)
    x: cython.double = 0.5 * ((da - db) * (da + db) * scale + 1.0)
    y_squared: cython.double = da * da * scale - x * x
    y: cython.double = sqrt(y_squared) if y_squared > 0.0 else 0.0
    sx: cython.double = view.ax + x * ux + y * uy
    sy: cython.double = view.ay + x * uy - y * ux
    if view.rx * sy - view.ry * sx < 0.0:
        return _by(view.rx, view.ry, sx, sy)
    if sx * view.ly - sy * view.lx < 0.0:
        return _by(view.lx, view.ly, sx, sy)
    return sqrt(sx * sx + sy * sy)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _by(px: cython.double, py: cython.double, qx: cython.double, qy: cython.double) -> cython.double:
    """Length of the way from the origin by p to q."""
    return sqrt(px * px + py * py) + sqrt((qx - px) * (qx - px) + (qy - py) * (qy - py))
