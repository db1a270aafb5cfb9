"""Where straight paths leave their last bend: laid out from their ends, triangle by triangle."""

import cython
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.walks import Query, View, seen_from_point
from cython.cimports.libc.math import NAN, atan2, fabs, sqrt

__all__ = ["depart"]


def depart(
    tables,
    walk,
    first_inside,
    inside,
    entered: cython.const[cython.int][::1],
    crossing: cython.const[cython.double][::1],
    max_steps: cython.int,
):
    """Fill the fan, angle and departure of the walks (n + p,) whose reach and root are known.

    Parameters
    ----------
    tables, walk, first_inside, inside
        As for `heat_igl.kernels.walks.Query`. Only vertices with a root are followed: others must have the root -1.
    entered : (n,) int32
        The half-edge opposite each vertex over which its straight path comes; -1 if it begins inside a face there.
    crossing : (n,) float64
        How far from the tail of that half-edge.
    max_steps : int
        Triangles that one path may cross.
    """
    q = Query(tables, walk, first_inside, inside, 0.0, 0.0, 0)
    v: cython.int
    with cython.nogil:
        for v in range(entered.shape[0]):
            if q.walk[v].root < 0:
                continue
            if entered[v] >= 0:
                _follow(q, v, entered[v], crossing[v], max_steps)
            else:
                q.walk[v].departure = q.walk[v].angle = NAN


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _follow(
    q: Query, v: cython.int, entered: cython.int, crossing: cython.double, max_steps: cython.int
) -> cython.void:
    """Lay out the strip of triangles from v to the root; the departure is nan if the root is not met."""
    walk = cython.address(q.walk[v])
    k: cython.int = q.t.first[v]
    while q.t.turn[k].corner != entered:
        k += 1
    spoke = cython.address(q.t.spoke[k])
    turn = cython.address(q.t.turn[k])
    view: View
    view.ax, view.ay = -spoke.along, -spoke.height
    view.bx, view.by = view.ax + spoke.base, view.ay
    view.h, view.spoke = turn.across, k
    # The direction of the path, back from v.
    dx: cython.double = view.ax + crossing
    dy: cython.double = view.ay
    size: cython.double = sqrt(dx * dx + dy * dy)
    walk.fan, walk.total = turn.fan_here, q.t.total[turn.fan_here]
    walk.angle = turn.here + atan2(view.ax * dy - view.ay * dx, view.ax * dx + view.ay * dy)
    walk.departure = NAN
    if not size > 0.0:
        return
    dx, dy = dx / size, dy / size
    near: cython.double = 1e-6 * walk.reach
    if spoke.neighbour == walk.root and _is_near(view.ax, view.ay, dx, dy, walk.reach, near):
        walk.departure = turn.there
        return
    if spoke.next_neighbour == walk.root and _is_near(view.bx, view.by, dx, dy, walk.reach, near):
        walk.departure = q.t.turn[spoke.next].there
        return
    for _ in range(max_steps):
        if view.h < 0:
            return
        step = cython.address(q.t.step[view.h])
        # Where the path goes next is known late, but both ways are known now.
        prefetch(cython.address(q.t.step[max(step.to_right, 0)]))
        prefetch(cython.address(q.t.step[max(step.to_left, 0)]))
        ux: cython.double = view.ax - view.bx
        uy: cython.double = view.ay - view.by
        wx: cython.double = view.bx + step.x * ux - step.y * uy
        wy: cython.double = view.by + step.x * uy + step.y * ux
        if step.vertex == walk.root and _is_near(wx, wy, dx, dy, walk.reach, near):
            walk.departure = step.direction + atan2(
                wx * view.by - wy * view.bx, wx * (wx - view.bx) + wy * (wy - view.by)
            )
            return
        if q.first_inside.shape[0] > 0 and _meets_point(q, walk.root, view, wx, wy, dx, dy, walk.reach, near, v):
            return
        # Past the vertex; where rounding leads over the boundary, on the other side.
        passes_right: cython.bint = dx * wy - dy * wx > 0.0
        if (step.to_right if passes_right else step.to_left) < 0:
            passes_right = not passes_right
        if passes_right:
            view.bx, view.by, view.h = wx, wy, step.to_right
        else:
            view.ax, view.ay, view.h = wx, wy, step.to_left


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _is_near(
    x: cython.double,
    y: cython.double,
    dx: cython.double,
    dy: cython.double,
    reach: cython.double,
    near: cython.double,
) -> cython.bint:
    """Whether a point of the plane is the end of the path."""
    return fabs(x - reach * dx) <= near and fabs(y - reach * dy) <= near


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _meets_point(
    q: Query,
    root: cython.int,
    view: View,
    wx: cython.double,
    wy: cython.double,
    dx: cython.double,
    dy: cython.double,
    reach: cython.double,
    near: cython.double,
    v: cython.int,
) -> cython.bint:
    """Whether the face behind a view holds the root, a source point, at the end of the path of v."""
    at_w: cython.int = view.h % 3
    entry: cython.int = q.first_inside[view.h // 3]
    while entry >= 0:
        point = cython.address(q.inside[entry])
        a: cython.double = point.barycentric[(at_w + 2) % 3]
        b: cython.double = point.barycentric[(at_w + 1) % 3]
        w: cython.double = point.barycentric[at_w]
        x: cython.double = w * wx + a * view.ax + b * view.bx
        y: cython.double = w * wy + a * view.ay + b * view.by
        if point.row == root and _is_near(x, y, dx, dy, reach, near):
            q.walk[v].departure = seen_from_point(view, wx, wy, x, y) + point.turn
            return True
        entry = point.following
    return False
