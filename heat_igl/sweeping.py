"""Kernel of the sweep: distance by unfolding one triangle at a time, in a given order."""

from __future__ import annotations

import math

import numpy as np

from heat_igl.fans import APEX_X, APEX_Y, BASE, CORNER, FAN_HERE, LENGTH, NEIGHBOUR, NEXT_SPOKE, Tables, jit
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["sweep"]

# Changes by less than this are not passed on: on a curved surface the sweep is wrong by a hundred times as much anyway.
_NEGLIGIBLE = 3e-5
# In a flat domain it is exact, provided that all changes are passed on.
_ROUNDING = 1e-12


@jit
def _is_flat(v: int, t: Tables) -> bool:
    """Whether v, or its first fan, has no curvature; true on the boundary."""
    total = t.total[t.spoke_id[t.first[v], FAN_HERE]]
    return bool(total < 0.0 or abs(total - 2.0 * math.pi) < 1e-9)


@jit
def _mark_dependents(v: int, t: Tables, d: FloatArray, begin: float, rank: IntArray, is_stale: AnyArray) -> bool:
    """Mark the neighbours that a smaller d[v] can improve: the farther ones, and a nearer one whose path can cross an
    edge that ends in v.

    That takes an angle there whose cosine is below L / (2 d), L the length of the spoke and d counted from `begin`,
    where the source begins: around 90 degrees, less near the source. On the first turn everybody who is still to come
    is stale anyway.
    """
    found = False
    for k in range(t.first[v], t.first[v + 1]):
        a, h = t.spoke_id[k, NEIGHBOUR], t.spoke_id[k, CORNER]
        depends = d[v] < d[a]
        if h >= 0:
            k_left = t.spoke_id[k, NEXT_SPOKE]
            b = t.spoke_id[k_left, NEIGHBOUR]
            along = t.spoke[k, APEX_X] * t.spoke[k, BASE]
            depends = depends or 2.0 * (d[a] - begin) * along < t.spoke[k, LENGTH] ** 2
            if (
                2.0 * (d[b] - begin) * (t.spoke[k, BASE] - along) < t.spoke[k_left, LENGTH] ** 2
                and not is_stale[rank[b]]
            ):
                is_stale[rank[b]] = found = True
        if depends and not is_stale[rank[a]]:
            is_stale[rank[a]] = found = True
    return found


@jit
def sweep(
    order: IntArray, t: Tables, d: FloatArray, max_passes: int, label: IntArray | None, offset: FloatArray
) -> int:
    """Lower `d` (n,) to the best planar unfolding over the triangles of each vertex, in the given order.

    One pass over all vertices, then passes over those that come before a neighbour which turned out to be nearer, until
    there are none (or `max_passes` are made). Returns the number of passes. Where given, `label` (n,) is handed on with
    the distance, and ``offset[label]`` is the distance at which the source of that label begins.
    """
    n = len(d)
    rank = np.empty(n, np.int64)
    for i in range(n):
        rank[order[i]] = i
    # By rank, so that a pass which finds little to do reads memory from front to back.
    is_stale = np.ones(n, np.bool_)
    for turn in range(max_passes):
        found_stale = False
        for i in range(n):
            if not is_stale[i]:
                continue
            is_stale[i] = False
            v = order[i]
            old = best = d[v]
            giver = v
            for k in range(t.first[v], t.first[v + 1]):
                a = t.spoke_id[k, NEIGHBOUR]
                da = d[a]
                if da + t.spoke[k, LENGTH] < best:
                    best = da + t.spoke[k, LENGTH]
                    giver = a
                h = t.spoke_id[k, CORNER]
                if h < 0:
                    continue
                b = t.spoke_id[t.spoke_id[k, NEXT_SPOKE], NEIGHBOUR]
                db = d[b]
                if (da >= best and db >= best) or da == np.inf or db == np.inf:
                    continue
                begin = 0.0
                if label is not None:
                    begin = offset[label[a]]
                    if begin != offset[label[b]]:
                        continue
                    da -= begin
                    db -= begin
                # The source in units of the edge ab: x along it, y behind it.
                base = t.spoke[k, BASE]
                scale = 1.0 / (base * base)
                x = 0.5 * ((da - db) * (da + db) * scale + 1.0)
                y_squared = da * da * scale - x * x
                if y_squared < 0:
                    continue
                y = math.sqrt(y_squared)
                px, py = t.spoke[k, APEX_X], t.spoke[k, APEX_Y]
                crossing = x * py + px * y  # times y + py
                if 0 <= crossing <= y + py:
                    squared = (px - x) ** 2 + (py + y) ** 2
                    if squared < (best - begin) * (best - begin) * scale:
                        best = begin + base * math.sqrt(squared)
                        giver = a if da < db else b
            if best < old:
                d[v] = best
                begin = 0.0
                if label is not None:
                    label[v] = label[giver]
                    begin = offset[label[v]]
                if best < old * (1 - (_ROUNDING if _is_flat(v, t) else _NEGLIGIBLE)):
                    found_stale = _mark_dependents(v, t, d, begin, rank, is_stale) or found_stale
        if not found_stale:
            return turn + 1
    return max_passes
