"""Kernel of the sweep: distance by unfolding one triangle at a time, in a given order."""

from __future__ import annotations

import math

import numpy as np

from heat_igl.fans import ALONG, BASE, HEIGHT, LENGTH, NEIGHBOUR, NEXT_SPOKE, PER_BASE, Tables, inline, jit
from heat_igl.memory_access import prefetch, uncounted
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["sweep"]

# Changes by less than this are not passed on: on a curved surface the sweep is wrong by ten times as much anyway.
_NEGLIGIBLE = 3e-4
# In a flat domain it is exact, provided that all changes are passed on.
_ROUNDING = 1e-12
# Visits per vertex up to which the sweep goes back at once, and after which it gives up. Heat's order takes 1.1 in all,
# a random one 3 to 5.
_GO_BACK, _GIVE_UP = 10, 50
# Numbers in a table that a processor keeps in its own cache.
_CACHED = 1 << 17


@inline
def _across(da: float, db: float, along: float, height: float, base: float, per_base: float) -> float:
    """Squared distance from v of the source that is at distances da and db from the ends of the side opposite v.

    ``inf`` unless the straight line between them crosses that side. Without branches, which at random cost more than
    the arithmetic.
    """
    x = 0.5 * ((da - db) * (da + db) * per_base + base)
    y_squared = da * da - x * x
    y = math.sqrt(max(y_squared, 0.0))
    crossing = x * height + along * y  # times y + height
    squared = (along - x) ** 2 + (height + y) ** 2
    return squared if (y_squared >= 0) & (crossing >= 0) & (crossing <= (y + height) * base) else np.inf


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


@jit
def _mark_dependents(
    v: int, t: Tables, d: FloatArray, begin: float, rank: AnyArray, is_stale: AnyArray, kept: AnyArray
) -> int:
    """Mark the neighbours that a smaller d[v] can improve; return the lowest rank among them, or n.

    They are the farther ones, and a nearer one whose path may cross the edge between v and a vertex that is nearer
    still. That takes an angle there whose cosine is below L / (2 d), L the length of the spoke and d counted from
    `begin`, where the source begins. What is still to come is stale anyway.
    """
    lowest = len(rank)
    for k in range(t.first[v], t.first[v + 1]):
        k_left = t.spoke_id[k, NEXT_SPOKE]
        a, b = t.spoke_id[k, NEIGHBOUR], t.spoke_id[k_left, NEIGHBOUR]
        if is_stale[a] and is_stale[b]:
            continue
        dv, da, db = d[v] - begin, d[a] - begin, d[b] - begin
        base, along, height = t.spoke[k, BASE], t.spoke[k, ALONG], t.spoke[k, HEIGHT]
        right, left = t.spoke[k, LENGTH], t.spoke[k_left, LENGTH]
        if not is_stale[a] and (
            dv < da
            or (
                db < da
                and 2.0 * da * along < right * right
                and _beyond_side(base, along, height, left, db, dv) < da * da * kept[a]
            )
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
        for k in range(t.first[v], t.first[v + 1]):
            prefetch(t.spoke, k)
    if i < len(order):
        v = order[i]
        for k in range(t.first[v], t.first[v + 1]):
            prefetch(d, t.spoke_id[k, NEIGHBOUR])


@jit
def sweep(order: IntArray, t: Tables, d: FloatArray, label: IntArray | None, offset: FloatArray) -> float:
    """Lower `d` (n,) to the best planar unfolding over the triangles of each vertex, in the given order.

    Where a vertex turns out to be nearer than one that came before it, the sweep goes back to that one at once, before
    what is wrong there spreads. Returns the number of visits per vertex. Where given, `label` (n,) is handed on with
    the distance, and ``offset[label]`` is the distance at which the source of that label begins.
    """
    n = len(order)
    rank = np.empty(n, np.int32)
    for i in range(n):
        rank[order[i]] = i
    is_stale = np.ones(n, np.bool_)
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
        along_edge = beyond = v  # where the best of either kind comes from
        for k in range(t.first[v], t.first[v + 1]):
            a, b = t.spoke_id[k, NEIGHBOUR], t.spoke_id[t.spoke_id[k, NEXT_SPOKE], NEIGHBOUR]
            da, db = d[a], d[b]
            if da + t.spoke[k, LENGTH] < best:
                best, along_edge = da + t.spoke[k, LENGTH], a
            if not min(da, db) < best:
                continue
            begin = 0.0
            if label is not None:
                if not max(da, db) < np.inf or offset[label[a]] != offset[label[b]]:
                    continue
                begin = offset[label[a]]
            along, height, base, per_base = (
                t.spoke[k, ALONG],
                t.spoke[k, HEIGHT],
                t.spoke[k, BASE],
                t.spoke[k, PER_BASE],
            )
            squared = _across(da - begin, db - begin, along, height, base, per_base)
            if label is None:
                across = min(across, squared)
            elif begin + math.sqrt(squared) < across:
                across, beyond = begin + math.sqrt(squared), a if da < db else b
        if label is None:
            across = math.sqrt(across)
        giver = beyond if across < best else along_edge
        best = min(best, across)
        if best < old:
            d[v] = best
            begin = 0.0
            if label is not None:
                label[v] = label[giver]
                begin = offset[label[v]]
            if best < old * kept[v]:
                back = _mark_dependents(v, t, d, begin, rank, is_stale, kept)
                if back < i:
                    if n_visits < _GO_BACK * n:
                        i = back
                    else:
                        again = min(again, back)
    return n_visits / n
