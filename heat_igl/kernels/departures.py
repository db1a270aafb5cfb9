"""Straight paths laid out from their ends, triangle by triangle: where they leave their last bend."""

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
):
    """Fill the fan, angle and departure of the walks (n + p,) whose reach and root are known.

    Parameters
    ----------
    tables, walk, first_inside, inside
        As for `heat_igl.kernels.walks.Query`. Only vertices with a root are followed: others must have the root -1. A
        departure is nan if the root is not met.
    entered : (n,) int32
        The half-edge opposite each vertex over which its straight path comes; -1 if the path lies inside one face.
    crossing : (n,) float64
        How far from the tail of that half-edge.
    """
    q = Query(tables, walk, first_inside, inside, 0.0, 0.0, 0)
    v: cython.int
    k: cython.int
    with cython.nogil:
        for v in range(entered.shape[0]):
            one = cython.address(q.walk[v])
            if one.root < 0:
                continue
            one.angle = one.departure = NAN
            if entered[v] < 0:
                continue
            k = q.t.first[v]
            while q.t.turn[k].corner != entered[v]:
                k += 1
            spoke = cython.address(q.t.spoke[k])
            x: cython.double = crossing[v] - spoke.along
            y: cython.double = -spoke.height
            size: cython.double = sqrt(x * x + y * y)
            one.fan, one.total = q.t.turn[k].fan_here, q.t.total[q.t.turn[k].fan_here]
            one.angle = q.t.turn[k].here + atan2(
                -spoke.along * y + spoke.height * x, spoke.height * spoke.height - spoke.along * x
            )
            one.departure = _follow(q, k, one.root, x / size, y / size, one.reach, 1e-6 * one.reach)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _follow(
    q: Query,
    k: cython.int,
    root: cython.int,
    dx: cython.double,
    dy: cython.double,
    reach: cython.double,
    near: cython.double,
) -> cython.double:
    """Lay out the triangles along the direction (dx, dy), left of spoke k, until the root is met `reach` away.

    Returns the direction back at the root, an angle in its fan or in its face; nan if it is not met within `near`.
    """
    spoke = cython.address(q.t.spoke[k])
    view: View
    view.ax, view.ay = -spoke.along, -spoke.height
    view.bx, view.by = view.ax + spoke.base, view.ay
    view.h, view.spoke = q.t.turn[k].across, k
    there: cython.double = NAN
    far: cython.double = reach + near
    aim_x: cython.double = reach * dx
    aim_y: cython.double = reach * dy
    if spoke.neighbour == root and _is_near(view.ax, view.ay, aim_x, aim_y, near):
        return q.t.turn[k].there
    if spoke.next_neighbour == root and _is_near(view.bx, view.by, aim_x, aim_y, near):
        return q.t.turn[spoke.next].there
    while view.h >= 0 and (view.ax * dx + view.ay * dy < far or view.bx * dx + view.by * dy < far):
        step = cython.address(q.t.step[view.h])
        # Both triangles that may come next, before it is known which.
        prefetch(cython.address(q.t.step[max(step.to_left, 0)]))
        prefetch(cython.address(q.t.step[max(step.to_right, 0)]))
        wx: cython.double = view.bx + step.x * (view.ax - view.bx) - step.y * (view.ay - view.by)
        wy: cython.double = view.by + step.x * (view.ay - view.by) + step.y * (view.ax - view.bx)
        if step.vertex == root and _is_near(wx, wy, aim_x, aim_y, near):
            back: cython.double = atan2(wx * view.by - wy * view.bx, wx * (wx - view.bx) + wy * (wy - view.by))
            return step.direction + back
        if q.first_inside.shape[0] > 0 and _meets_point(
            q, root, view, wx, wy, aim_x, aim_y, near, cython.address(there)
        ):
            return there
        # Past the vertex; where rounding leads over the boundary, on the other side.
        passes_right: cython.bint = dx * wy - dy * wx > 0.0
        if (step.to_right if passes_right else step.to_left) < 0:
            passes_right = not passes_right
        if passes_right:
            view.bx, view.by, view.h = wx, wy, step.to_right
        else:
            view.ax, view.ay, view.h = wx, wy, step.to_left
    return there


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _is_near(
    x: cython.double, y: cython.double, aim_x: cython.double, aim_y: cython.double, near: cython.double
) -> cython.bint:
    return fabs(x - aim_x) <= near and fabs(y - aim_y) <= near


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _meets_point(
    q: Query,
    root: cython.int,
    view: View,
    wx: cython.double,
    wy: cython.double,
    aim_x: cython.double,
    aim_y: cython.double,
    near: cython.double,
    there: cython.p_double,
) -> cython.bint:
    """Whether the face behind a view holds the root, a source point, within `near` of the aim."""
    at_w: cython.int = view.h % 3
    entry: cython.int = q.first_inside[view.h // 3]
    while entry >= 0:
        point = cython.address(q.inside[entry])
        a: cython.double = point.barycentric[(at_w + 2) % 3]
        b: cython.double = point.barycentric[(at_w + 1) % 3]
        w: cython.double = point.barycentric[at_w]
        x: cython.double = w * wx + a * view.ax + b * view.bx
        y: cython.double = w * wy + a * view.ay + b * view.by
        if point.row == root and _is_near(x, y, aim_x, aim_y, near):
            there[0] = seen_from_point(view, wx, wy, x, y) + point.turn
            return True
        entry = point.following
    return False
