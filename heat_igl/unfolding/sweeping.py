"""Kernel of the sweep: distance by unfolding two triangles at a time, in a given order.

Seen from a vertex v, a source lies behind the side ab of one of its triangles, where circles about a and b meet. The
triangle beyond ab has the third corner w, which is nearer to the source and so knows better where it is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from heat_igl.intrinsic.fans import (
    ALONG,
    BASE,
    BEYOND,
    BEYOND_ALONG,
    BEYOND_DEPTH,
    HEIGHT,
    LENGTH,
    NEIGHBOUR,
    NEXT_NEIGHBOUR,
    NEXT_SPOKE,
    Tables,
    inline,
    jit,
)
from heat_igl.runtime.prefetch import prefetch, uncounted
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["sweep"]

# Changes by less than this are not passed on: on a curved surface the sweep is wrong by more anyway.
_NEGLIGIBLE = 3e-4
# In a flat domain it is exact, provided that all changes are passed on.
_ROUNDING = 1e-12
# Visits per vertex up to which the sweep goes back at once, and after which it gives up. Heat's order takes 1.1 in all,
# a random one 20 to 40.
_GO_BACK, _GIVE_UP = 10, 50
# Part of an edge by which a source has to lie beyond it: circles about its ends, nearly touching, lose digits.
_CLOSE = 1e-3
# Numbers in a table that a processor keeps in its own cache.
_CACHED = 1 << 17


@inline
def _spokes(t: Tables, v: int) -> Any:
    """The spokes of v. Unsigned: numbers that may count from the end cost two instructions more at each use."""
    return range(np.uint64(t.first[v]), np.uint64(t.first[v + 1]))


@inline
def _across(da: float, db: float, along: float, height: float, base: float) -> float:
    """Squared distance from v of the source that is at distances da and db from the ends of the side opposite v.

    ``inf`` unless the straight line between them crosses that side. Without branches, which at random cost more than
    the arithmetic.
    """
    x = 0.5 * ((da - db) * (da + db) / base + base)
    y_squared = da * da - x * x
    y = math.sqrt(max(y_squared, 0.0))
    crossing = x * height + along * y  # times y + height
    squared = (along - x) ** 2 + (height + y) ** 2
    return squared if (y_squared >= 0) & (crossing >= 0) & (crossing <= (y + height) * base) else np.inf


@inline
def _across_straight(da: float, db: float, along: float, height: float, base: float) -> float:
    """Distance at v of a straight front that is at distances da and db at the ends of the side opposite v.

    ``inf`` unless the straight line in which it comes to v crosses that side.
    """
    slope = (db - da) / base
    rise_squared = 1.0 - slope * slope
    rise = math.sqrt(max(rise_squared, 0.0))
    foot = along * rise - height * slope  # times rise
    return da + slope * along + rise * height if (foot >= 0) & (foot <= rise * base) else np.inf


@inline
def _comes_nearer_to_a(da: float, db: float, along: float, height: float, base: float) -> bool:
    """Whether a straight front comes to v across the side ab nearer to a than to b."""
    slope = (db - da) / base
    rise = math.sqrt(max(1.0 - slope * slope, 0.0))
    return along * rise - height * slope < 0.5 * rise * base


@inline
def _across_two(
    da: float, db: float, dw: float, along: float, height: float, base: float, wx: float, wy: float
) -> float:
    """Squared distance from v of the source behind ab, as the corner w beyond ab and one of a and b know it.

    w lies at (wx, -wy). The line to the source as a and b know it leaves the farther triangle between w and p, one of
    them; it is drawn anew to where circles about p and w meet. If that is on the other side of w, the path bends at w.
    ``inf`` if a and b know better: the source lies in the farther triangle, or hidden by p.
    """
    x = 0.5 * ((da - db) * (da + db) / base + base)
    y = math.sqrt(max(da * da - x * x, 0.0))
    ux, uy = along - wx, height + wy
    is_right = ux * (y + height) < uy * (along - x)
    sign, px, dp = (1.0, 0.0, da) if is_right else (-1.0, base, db)
    ex = wx - px
    square = ex * ex + wy * wy
    if not sign * (y * ex - (x - px) * wy) > _CLOSE * square:
        return np.inf
    s = 0.5 * ((dp - dw) * (dp + dw) / square + 1.0)
    h = sign * math.sqrt(max(dp * dp / square - s * s, 0.0))
    sx, sy = along - px - s * ex + h * wy, height + s * wy + h * ex
    if sign * (ux * sy - uy * sx) > 0:
        bent = math.sqrt(ux * ux + uy * uy) + dw
        return bent * bent
    return sx * sx + sy * sy if sign * ((along - px) * sy - height * sx) >= 0 else np.inf


@inline
def _beyond_side(base: float, along: float, height: float, side: float, db: float, dv: float) -> float:
    """Squared distance of a by a straight line over the side vb, of length `side`; ``inf`` if there is none.

    a lies at the origin, b on the first axis, v at (along, height).
    """
    per_side = 1.0 / (side * side)
    x = 0.5 * ((dv - db) * (dv + db) * per_side + 1.0)
    y_squared = dv * dv * per_side - x * x
    if not y_squared >= 0:
        return np.inf
    y = math.sqrt(y_squared)
    sx, sy = along + x * (base - along) + y * height, height - x * height + y * (base - along)
    return sx * sx + sy * sy if sy >= 0 and along * sy <= height * sx else np.inf


@inline
def _mark_farther(v: int, t: Tables, d: FloatArray, rank: AnyArray, is_stale: AnyArray) -> int:
    """Mark the farther neighbours, which a smaller d[v] can improve; return the lowest rank among them, or n.

    Those still to come are stale anyway.
    """
    lowest = len(rank)
    for k in _spokes(t, v):
        a = np.uint32(t.spoke_id[k, NEIGHBOUR])
        if (d[v] < d[a]) & (is_stale[a] ^ True):
            is_stale[a] = True
            lowest = min(lowest, rank[a])
    return lowest


@jit
def _mark_nearer(
    v: int, t: Tables, d: FloatArray, begin: float, rank: AnyArray, is_stale: AnyArray, kept: AnyArray
) -> int:
    """Mark the nearer neighbours that a smaller d[v] can improve; return the lowest rank among them, or n.

    The path of such a one crosses the edge between v and a vertex that is nearer still. That takes an angle there whose
    cosine is below L / (2 d), L the length of the spoke and d counted from `begin`, where the source begins.
    """
    lowest = len(rank)
    for k in _spokes(t, v):
        a, b = np.uint32(t.spoke_id[k, NEIGHBOUR]), np.uint32(t.spoke_id[k, NEXT_NEIGHBOUR])
        dv, da, db = d[v] - begin, d[a] - begin, d[b] - begin
        base, along, height = t.spoke[k, BASE], t.spoke[k, ALONG], t.spoke[k, HEIGHT]
        right, left = t.spoke[k, LENGTH], t.spoke[t.spoke_id[k, NEXT_SPOKE], LENGTH]
        if (
            not is_stale[a]
            and db < da
            and 2.0 * da * along < right * right
            and _beyond_side(base, along, height, left, db, dv) < da * da * kept[a]
        ):
            is_stale[a] = True
            lowest = min(lowest, rank[a])
        if (
            not is_stale[b]
            and da < db
            and 2.0 * db * (base - along) < left * left
            and _beyond_side(base, base - along, height, right, da, dv) < db * db * kept[b]
        ):
            is_stale[b] = True
            lowest = min(lowest, rank[b])
    return lowest


@inline
def _read_ahead(order: IntArray, i: int, t: Tables, d: FloatArray) -> None:
    """Have what the next visits read fetched: on large meshes that takes longer than the visits."""
    if i + 3 < len(order):
        prefetch(t.first, order[i + 3])
    if i + 1 < len(order):
        v = order[i + 1]
        for k in _spokes(t, v):
            prefetch(t.spoke, k)
    if i < len(order):
        v = order[i]
        for k in _spokes(t, v):
            prefetch(d, t.spoke_id[k, NEIGHBOUR])


@inline
def _seen_from_beyond(
    k: Any, t: Tables, d: FloatArray, label: IntArray | None, offset: FloatArray, across: float
) -> tuple[float, int]:
    """Distance across the triangle left of spoke k, `across` by its own corners, and by the one beyond; and from where.

    Where the corners are not measured from the same source the distance stays. The source is -1 without labels.
    """
    a, b = np.uint32(t.spoke_id[k, NEIGHBOUR]), np.uint32(t.spoke_id[k, NEXT_NEIGHBOUR])
    w = t.spoke_id[k, BEYOND]
    along, height, base = t.spoke[k, ALONG], t.spoke[k, HEIGHT], t.spoke[k, BASE]
    source, begin, is_of_one = -1, 0.0, True
    if label is not None:
        source, is_of_one = label[a], label[a] == label[b]
        begin = offset[source]
        if not is_of_one and not _comes_nearer_to_a(d[a], d[b], along, height, base):
            source = label[b]
    if is_of_one and w >= 0 and d[w] < across and (label is None or label[w] == source):
        wx, wy = t.spoke[k, BEYOND_ALONG], t.spoke[k, BEYOND_DEPTH]
        squared = _across_two(d[a] - begin, d[b] - begin, d[w] - begin, along, height, base, wx, wy)
        if squared < np.inf:
            across = begin + math.sqrt(squared)
    return across, source


@jit
def sweep(
    order: IntArray, t: Tables, d: FloatArray, label: IntArray | None, offset: FloatArray, is_stale: AnyArray
) -> float:
    """Lower `d` (n,) to the best planar unfolding over the triangles of each vertex, in the given order.

    Where a vertex turns out to be nearer than one that came before it, the sweep goes back to that one at once, before
    what is wrong there spreads. Returns the number of visits per vertex. Vertices that are not in `is_stale` (n,) bool
    are visited only if what they depend on changes.

    `label` (n,), needed where there is more than one source, is handed on with the distance: the source that it is
    measured from, -1 where none is reached; ``offset[label]`` is the distance at which that source begins. Circles
    about the ends of a side meet in a source if both ends are measured from it. Between ends of different sources a
    straight front comes in, from the source of the end that it passes nearer to.
    """
    n = len(order)
    rank = np.empty(n, np.int32)
    for i in range(n):
        rank[order[i]] = i
    kept = np.where(t.is_flat, 1 - _ROUNDING, 1 - _NEGLIGIBLE)
    n_visits, i, again = 0, 0, n
    order, t, d = uncounted((order, t, d))
    while n_visits < _GIVE_UP * n:
        if i == n:
            if again == n:
                break
            i, again = again, n
        v = order[i]
        i += 1
        if t.spoke.size > _CACHED:
            _read_ahead(order, i, t, d)
        if not is_stale[v]:
            continue
        is_stale[v] = False
        n_visits += 1
        old = best = d[v]
        across = np.inf
        spoke, along_edge = np.uint64(0), np.uint32(v)  # where the best of either kind comes from
        for k in _spokes(t, v):
            a, b = np.uint32(t.spoke_id[k, NEIGHBOUR]), np.uint32(t.spoke_id[k, NEXT_NEIGHBOUR])
            da, db = d[a], d[b]
            if da + t.spoke[k, LENGTH] < best:
                best, along_edge = da + t.spoke[k, LENGTH], a
            if not min(da, db) < best:
                continue
            along, height, base = t.spoke[k, ALONG], t.spoke[k, HEIGHT], t.spoke[k, BASE]
            if label is None:
                squared = _across(da, db, along, height, base)
            elif label[a] == label[b]:
                begin = offset[label[a]]
                squared = (begin + math.sqrt(_across(da - begin, db - begin, along, height, base))) ** 2
            else:
                squared = _across_straight(da, db, along, height, base) ** 2
            spoke = k if squared < across else spoke
            across = min(across, squared)
        across = math.sqrt(across)
        nearest = -1 if label is None else label[along_edge]
        if across < best:
            across, source = _seen_from_beyond(spoke, t, d, label, offset, across)
            if across < best:
                best, nearest = across, source
        if best < old:
            d[v] = best
            begin = 0.0
            if label is not None:
                label[v] = nearest
                begin = offset[nearest]
            if best < old * kept[v]:
                back = _mark_farther(v, t, d, rank, is_stale)
                # With curvature around, what this finds is less than the sweep's error.
                if t.is_flat[v]:
                    back = min(back, _mark_nearer(v, t, d, begin, rank, is_stale, kept))
                if back < i:
                    if n_visits < _GO_BACK * n:
                        i = back
                    else:
                        again = min(again, back)
    return n_visits / n
