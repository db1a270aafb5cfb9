"""Unfolding: the shortest path to every vertex that is found from the paths of the neighbours.

Vertices are visited in order, and take the shortest path of those that `walking` finds by following one strip of
triangles and `searching` by trying all. The record of a path at a vertex is a `Walk`.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.half_edges import HalfEdges
from cython.cimports.heat_igl.kernels.prefetch import prefetch
from cython.cimports.heat_igl.kernels.searching import search
from cython.cimports.heat_igl.kernels.unfolding import MAX_WAITING
from cython.cimports.heat_igl.kernels.walking import cross_crowded, look_around, walk_through
from cython.cimports.heat_igl.kernels.walks import (
    BETWEEN,
    NO_FAN,
    NOT_VISITED,
    REAL_BEND,
    SAYS_LEFT,
    SAYS_RIGHT,
    Query,
    Walk,
)
from cython.cimports.libc.math import INFINITY, atan2, cos, sin, sqrt

__all__ = ["unfold", "views"]


def unfold(
    order: cython.const[cython.int][::1],
    tables,
    walk,
    points,
    rules,
    barrier,
    begins,
):
    """Pass over the vertices `order` (n,) until nothing is stale; see `heat_igl.unfolding.walks.unfold`."""
    ways = _Ways(begins)
    q = Query(tables, walk, points, rules, barrier)
    max_passes: cython.int = rules.max_passes
    v: cython.int
    n: cython.int = q.t.first.shape[0] - 1
    is_stale: cython.uchar[::1] = np.empty(n, np.uint8)
    with cython.nogil:
        for v in range(n):
            # A source that begins later may be overtaken; a corner that sees a source in its face hardly is.
            known: cython.double = q.walk[v].distance
            is_stale[v] = known == INFINITY or (known > 0.0 and q.walk[v].fan == NO_FAN)
        _run(q, order, is_stale, max_passes, ways)


@cython.final
@cython.cclass
class _Ways:
    """Fills the arrays of `heat_igl.unfolding.walks.Begins`, unless they are empty."""

    entered: cython.int[::1]
    share: cython.double[::1]
    reach: cython.double[::1]

    def __init__(self, begins):
        self.entered, self.share, self.reach = begins.entered, begins.share, begins.reach

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def note(self, q: Query, v: cython.int, behind: cython.double) -> cython.void:
        """Note the path that was found for v, whose end has a path of length `behind`."""
        found = cython.address(q.found)
        x: cython.double = found.x
        y: cython.double = found.y
        reach: cython.double = sqrt(x * x + y * y)
        if found.distance < (reach + behind) * (1 - 1e-12):
            # Straight past that vertex, to the last bend of its path.
            c: cython.double = cos(found.saving)
            s: cython.double = sin(found.saving)
            further: cython.double = q.walk[found.end].reach / reach
            x, y = x + further * (x * c - y * s), y + further * (x * s + y * c)
            reach = sqrt(x * x + y * y)
        self.entered[v], self.reach[v] = -1, reach
        if found.y != 0.0:
            spoke = cython.address(q.t.spoke[found.spoke])
            self.entered[v] = q.t.turn[found.spoke].corner
            self.share[v] = (spoke.along - x * spoke.height / y) / spoke.base


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _run(
    q: Query,
    order: cython.const[cython.int][::1],
    is_stale: cython.uchar[::1],
    max_passes: cython.int,
    ways: _Ways,
) -> cython.void:
    i: cython.Py_ssize_t
    j: cython.int
    k: cython.int
    waiting: cython.int[MAX_WAITING]
    for _ in range(max_passes):
        found_stale: cython.bint = False
        for i in range(order.shape[0]):
            _read_ahead(q, order, i)
            v: cython.int = order[i]
            if not is_stale[v]:
                continue
            waiting[0] = v
            depth: cython.int = 1
            # A source that begins later has a path already.
            may_wait: cython.bint = q.walk[v].fan != NO_FAN or q.walk[v].distance == INFINITY
            while depth > 0:
                v = waiting[depth - 1]
                old: cython.double = q.walk[v].distance
                wait_for: cython.int = _visit(q, v, may_wait)
                if wait_for >= 0:
                    may_wait = depth < MAX_WAITING
                    for j in range(depth):
                        may_wait = may_wait and waiting[j] != wait_for
                    if may_wait:
                        waiting[depth] = wait_for
                        depth += 1
                    continue
                depth -= 1
                distance: cython.double = q.walk[v].distance
                # One that stays without a path must not be waited for again.
                may_wait = distance < INFINITY
                is_stale[v] = False
                if distance < old and ways.entered.shape[0] > 0:
                    ways.note(q, v, q.walk[q.found.end].distance)
                if distance < old * (1 - 1e-9):
                    for k in range(q.t.first[v], q.t.first[v + 1]):
                        w: cython.int = q.t.spoke[k].neighbour
                        # Farther, or without a path so far, and visited before this one.
                        if not is_stale[w] and distance < q.walk[w].distance:
                            is_stale[w] = found_stale = True
        if not found_stale:
            break


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _read_ahead(q: Query, order: cython.const[cython.int][::1], i: cython.Py_ssize_t) -> cython.void:
    """Prefetch the data of the next visits: a third of the time would go by waiting for it."""
    n: cython.Py_ssize_t = order.shape[0]
    k: cython.int
    v: cython.int
    if i + 3 < n:
        prefetch(cython.address(q.t.first[order[i + 3]]))
    if i + 2 < n:
        v = order[i + 2]
        for k in range(q.t.first[v], q.t.first[v + 1]):
            prefetch(cython.address(q.t.spoke[k]))
            prefetch(cython.address(q.t.turn[k]))
    if i + 1 < n:
        v = order[i + 1]
        for k in range(q.t.first[v], q.t.first[v + 1]):
            prefetch(cython.address(q.walk[q.t.spoke[k].neighbour]))
            prefetch(cython.address(q.t.step[max(q.t.turn[k].across, 0)]))


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _visit(q: Query, v: cython.int, may_wait: cython.bint) -> cython.int:
    """Give v the best path found from the neighbours' paths, or name a vertex to visit first; -1 if none."""
    first: cython.int = q.t.first[v]
    k: cython.int
    old: cython.double = q.walk[v].distance
    q.found.distance = old
    smallest: cython.double = look_around(q, v)
    for _ in range(2):
        best: cython.int = -1
        best_promise: cython.double = q.found.distance * (1 - 1e-12)
        for k in range(first, q.t.first[v + 1]):
            turn = cython.address(q.t.turn[k])
            if turn.corner < 0:
                continue
            if turn.across < -1:
                cross_crowded(q, k)
            # A way in lies between spokes of which one neighbour says left and the next one right (or is not known
            # yet).
            right = cython.address(q.advice[k - first])
            left = cython.address(q.advice[q.t.spoke[k].next - first])
            if right.side > 0 and (left.side == SAYS_RIGHT or left.side == NOT_VISITED):
                forecast: cython.double = INFINITY
                if right.side == SAYS_LEFT:
                    forecast = right.promise
                if left.side == SAYS_RIGHT:
                    forecast = min(forecast, left.promise)
                if forecast < best_promise:
                    best, best_promise = k, forecast
        if best < 0:
            break
        wait_for: cython.int = walk_through(q, v, best)
        if wait_for >= 0 and may_wait:
            return wait_for
        q.advice[best - first].promise = INFINITY
        q.advice[q.t.spoke[best].next - first].promise = INFINITY
    if q.found.distance > smallest * (1 + q.shortfall):
        search(q, v)
    if q.found.distance < old:
        _settle(q, v)
    return -1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _settle(q: Query, v: cython.int) -> cython.void:
    """Give v the path that was found, and the direction of that path once it is pulled tight."""
    found = cython.address(q.found)
    end = cython.address(q.walk[found.end])
    walk = cython.address(q.walk[v])
    turn = cython.address(q.t.turn[found.spoke])
    x: cython.double = found.x
    y: cython.double = found.y
    reach: cython.double = sqrt(x * x + y * y)
    offset: cython.double = end.distance
    departure: cython.double = found.there
    root: cython.int = found.end
    if found.saving == BETWEEN:
        reach += found.there
        offset = max(found.distance - reach, 0.0)
    elif found.saving != REAL_BEND and end.reach > 0.0:
        # On to the last bend of that path, in the direction in which it is seen from the end.
        c: cython.double = cos(found.saving)
        s: cython.double = sin(found.saving)
        further: cython.double = end.reach / reach
        x, y = x + further * (x * c - y * s), y + further * (x * s + y * c)
        reach = sqrt(x * x + y * y)
        offset, root = end.offset, end.root
        # Turned about that bend from the direction to the end.
        ex: cython.double = found.x - x
        ey: cython.double = found.y - y
        departure = end.departure + atan2(ey * x - ex * y, -(ex * x + ey * y))
    walk.distance, walk.offset, walk.reach, walk.label = found.distance, offset, reach, end.label
    walk.departure, walk.root = departure, root
    walk.angle = turn.here + atan2(found.ax * y - found.ay * x, found.ax * x + found.ay * y)
    walk.fan, walk.total = turn.fan_here, q.t.total[turn.fan_here]


def views(
    faces: cython.const[cython.longlong][::1],
    barycentric: cython.const[cython.double][:, ::1],
    F: cython.const[cython.int][:, ::1],
    tables,
    vertex: cython.int[::1],
    walk: Walk[::1],
):
    """How the corners (3 k,) of faces see points in them: their vertices, and their walks to a source of distance 0."""
    t: HalfEdges = HalfEdges(tables)
    i: cython.Py_ssize_t
    c: cython.int
    k: cython.int
    for i in range(faces.shape[0]):
        for c in range(3):
            vertex[3 * i + c] = F[faces[i], c]
            k = t.first[F[faces[i], c]]
            while t.turn[k].corner != 3 * faces[i] + c:
                k += 1
            spoke = cython.address(t.spoke[k])
            turn = cython.address(t.turn[k])
            one = cython.address(walk[3 * i + c])
            ax: cython.double = -spoke.along
            ay: cython.double = -spoke.height
            at_a: cython.double = barycentric[i, (c + 1) % 3]
            at_b: cython.double = barycentric[i, (c + 2) % 3]
            x: cython.double = at_a * ax + at_b * (ax + spoke.base)
            y: cython.double = (at_a + at_b) * ay
            one.distance = one.reach = sqrt(x * x + y * y)
            # A source at v itself leaves v without a direction.
            one.fan = turn.fan_here if one.reach > 1e-12 * spoke.base else NO_FAN
            one.angle = turn.here + atan2(ax * y - ay * x, ax * x + ay * y)
            one.total = t.total[turn.fan_here]
            # At the point, from the side of corners 0 and 1.
            ex: cython.double = spoke.base
            ey: cython.double = 0.0
            if c == 0:
                ex, ey = ax, ay
            elif c == 1:
                ex, ey = -ax - spoke.base, -ay
            one.departure = atan2(ey * x - ex * y, -(ex * x + ey * y))
