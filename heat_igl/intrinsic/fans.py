"""Half-edge tables for walks over a triangulation: what lies across an edge, and where edges leave a vertex.

The faces are oriented alike. Half-edge ``3 f + c`` is the side of face ``f`` opposite its corner ``c``, and a *corner*
carries the same number. A *fan* is a set of corners around a vertex that are glued to one another; directions at a
vertex are angles in its fan, counted counter-clockwise from the first spoke.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np

from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

__all__ = ["Tables", "breadth_first", "inline", "jit", "tables"]

Function = TypeVar("Function", bound=Callable[..., Any])


def jit(function: Function) -> Function:
    """Compile on the first call, to run without the interpreter's lock."""
    # error_model="numpy": a division need not look for a zero first.
    return cast(Function, numba.njit(nogil=True, cache=True, error_model="numpy")(function))


def inline(function: Function) -> Function:
    """Compile into the caller: what runs once per step or visit, where a call would cost as much as the work."""
    return cast(Function, numba.njit(nogil=True, inline="always", error_model="numpy")(function))


# Columns of `Tables.spoke`, and of its view as integers.
LENGTH, ALONG, HEIGHT, BASE, BEYOND_ALONG, BEYOND_DEPTH = 0, 1, 2, 3, 4, 5
NEIGHBOUR, NEXT_NEIGHBOUR, BEYOND, NEXT_SPOKE = 12, 13, 14, 15
# Columns of `Tables.turn`, and of its view as integers.
ANGLE_HERE, ANGLE_THERE = 0, 1
FAN_HERE, FAN_THERE, CORNER, MANY = 4, 5, 6, 7
# Columns of `Tables.step`, and of its view as integers.
FAR_X, FAR_Y, FAR_ANGLE = 0, 1, 2
FAR, TO_RIGHT, TO_LEFT, FAR_FAN = 6, 7, 8, 9


class Tables(NamedTuple):
    """What a walk reads, one row for each visit of a spoke and one for each step, so that it reads little memory.

    Attributes
    ----------
    first : (n + 1,) int64
        Spokes of vertex v are ``first[v]`` to ``first[v + 1]``, counter-clockwise, fan after fan.
    spoke : (s, 8) float64
        Length. Of the triangle to the left of the spoke: v's place over the opposite side, along it from the spoke's
        end and in height; the length of that side; and the place of the vertex beyond it, along it and in depth. Past
        the end of an open fan, where there is no triangle, 0, nan, 0, so that whatever is computed from them compares
        false. Rows begin where lines of the processor's cache do.
    spoke_id : (s, 16) int32
        The same memory. The neighbour; the one at the next spoke; the vertex beyond the side between them, -1 if none;
        the next spoke, on the other side of that triangle (or the spoke itself).
    turn : (s, 4) float64
        Direction of the spoke at v; direction of the same edge at the neighbour (angles in their fans).
    turn_id : (s, 8) int32
        The same memory. v's fan; the neighbour's; the half-edge opposite v in the triangle to the left, -1 if none;
        whether more than two faces meet at that half-edge.
    step : (3 m, 5) float64
        For a half-edge that is crossed, where the far vertex lies, in units of the half-edge on the other side; the
        direction of the edge from the far vertex to the right end (seen in the walk: to b) in the far vertex's fan.
    step_id : (3 m, 10) int32
        The same memory. The far vertex (-1 on the boundary); the half-edge to leave by when passing right of it, and
        when passing left of it; its fan.
    total : (k,) float64
        Sum of the angles of each fan, negative for a fan that is open.
    is_flat : (n,) bool
        Whether a vertex, or its first fan, has no curvature; true on the boundary.
    """

    first: IntArray
    spoke: FloatArray
    spoke_id: AnyArray
    turn: FloatArray
    turn_id: AnyArray
    step: FloatArray
    step_id: AnyArray
    total: FloatArray
    is_flat: BoolArray


@inline
def _next(h: int) -> int:
    """The half-edge after `h` in its face."""
    return h + 1 if h % 3 < 2 else h - 2


@inline
def _previous(h: int) -> int:
    return h - 1 if h % 3 else h + 2


@jit
def _shapes(l: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: E741
    """Apex over each half-edge in units of the half-edge, and the angle at each corner."""
    m = len(l)
    apex = np.empty((3 * m, 2))
    corner_angle = np.empty(3 * m)
    for f in range(m):
        for c in range(3):
            base, right, left = l[f, c], l[f, (c + 2) % 3], l[f, (c + 1) % 3]
            x = 0.5 * ((right - left) * (right + left) / (base * base) + 1.0)
            # Heron's formula as a product of differences: a height from right^2 - x^2 loses the digits of slivers.
            half = 0.5 * (base + right + left)
            product = max(half * (half - base) * (half - right) * (half - left), 0.0)
            apex[3 * f + c, 0] = x
            apex[3 * f + c, 1] = 2.0 * math.sqrt(product) / (base * base)
            corner_angle[3 * f + c] = 2.0 * math.atan2(
                math.sqrt(max((half - right) * (half - left), 0.0)), math.sqrt(max(half * (half - base), 0.0))
            )
    return apex, corner_angle


@jit
def _fans(twin: IntArray, corner_angle: FloatArray) -> tuple[FloatArray, AnyArray, FloatArray, IntArray]:
    """Direction of the first spoke of each corner, fan of each corner, total angles, and the corners in fan order."""
    count = len(twin)
    angle = np.empty(count)
    fan = np.full(count, -1, np.int32)
    total = np.empty(count)
    in_order = np.empty(count, np.int64)
    n_fans = n_seen = 0
    for h in range(count):
        if fan[h] >= 0:
            continue
        start, is_open = h, False
        while True:  # clockwise, to the boundary or once around
            t = twin[_previous(start)]
            if t < 0:
                is_open = True
                break
            start = _previous(t)
            if start == h:
                break
        k, sum_of_angles = start, 0.0
        while True:  # counter-clockwise
            fan[k], angle[k], in_order[n_seen] = n_fans, sum_of_angles, k
            n_seen += 1
            sum_of_angles += corner_angle[k]
            t = twin[_next(k)]
            if t < 0:
                break
            k = _next(t)
            if k == start:
                break
        total[n_fans] = -sum_of_angles if is_open else sum_of_angles
        n_fans += 1
    return angle, fan, total[:n_fans].copy(), in_order


@jit
def _count_spokes(F: IntArray, twin: IntArray, n: int) -> IntArray:
    """First spoke of each vertex: one per corner, and one more at the end of an open fan."""
    vertex = F.ravel()
    first = np.zeros(n + 1, np.int64)
    for h in range(len(twin)):
        first[vertex[h] + 1] += 2 if twin[_next(h)] < 0 else 1
    for v in range(n):
        first[v + 1] += first[v]
    return first


@jit
def _fill_spokes(
    F: IntArray,
    twin: IntArray,
    length: FloatArray,
    apex: FloatArray,
    corner_angle: FloatArray,
    angle: FloatArray,
    fan: AnyArray,
    in_order: IntArray,
    first: IntArray,
    spoke: FloatArray,
    spoke_id: AnyArray,
    turn: FloatArray,
    turn_id: AnyArray,
) -> None:
    """The spokes of each vertex, from its corners in fan order."""
    vertex = F.ravel()
    fill = first.copy()
    fan_start = 0
    for i in range(len(in_order)):
        h = in_order[i]
        right, left = _next(h), _previous(h)  # as corners: at the neighbours right and left of the corner h
        v = vertex[h]
        k = fill[v]
        if i == 0 or fan[h] != fan[in_order[i - 1]]:
            fan_start = k
        spoke[k, LENGTH], spoke[k, BASE] = length[left], length[h]
        spoke[k, ALONG], spoke[k, HEIGHT] = apex[h, 0] * length[h], apex[h, 1] * length[h]
        spoke_id[k, NEIGHBOUR], spoke_id[k, NEXT_NEIGHBOUR] = vertex[right], vertex[left]
        spoke_id[k, BEYOND], spoke_id[k, NEXT_SPOKE] = -1, k + 1
        t = twin[h]
        if t >= 0:
            # Seen from beyond, the side runs the other way.
            spoke[k, BEYOND_ALONG], spoke[k, BEYOND_DEPTH] = (1.0 - apex[t, 0]) * length[h], apex[t, 1] * length[h]
            spoke_id[k, BEYOND] = vertex[t]
        turn[k, ANGLE_HERE], turn[k, ANGLE_THERE] = angle[h], angle[right] + corner_angle[right]
        turn_id[k, FAN_HERE], turn_id[k, FAN_THERE], turn_id[k, CORNER] = fan[h], fan[right], h
        turn_id[k, MANY] = twin[h] < -1
        fill[v] += 1
        if twin[_next(h)] < 0:
            k += 1
            spoke[k, LENGTH], spoke[k, HEIGHT] = length[right], np.nan
            spoke_id[k, NEIGHBOUR], spoke_id[k, NEXT_NEIGHBOUR] = vertex[left], vertex[left]
            spoke_id[k, BEYOND], spoke_id[k, NEXT_SPOKE] = -1, k
            turn[k, ANGLE_HERE], turn[k, ANGLE_THERE] = angle[h] + corner_angle[h], angle[left]
            turn_id[k, FAN_HERE], turn_id[k, FAN_THERE], turn_id[k, CORNER] = fan[h], fan[left], -1
            fill[v] += 1
        elif i + 1 == len(in_order) or fan[in_order[i + 1]] != fan[h]:
            spoke_id[k, NEXT_SPOKE] = fan_start


@jit
def _fill_steps(
    F: IntArray,
    twin: IntArray,
    apex: FloatArray,
    angle: FloatArray,
    fan: AnyArray,
    step: FloatArray,
    step_id: AnyArray,
) -> None:
    vertex = F.ravel()
    for h in range(len(twin)):
        t = twin[h]
        row, ids = step[h], step_id[h]
        if t < 0:
            ids[FAR] = -1
            continue
        row[FAR_X], row[FAR_Y], row[FAR_ANGLE] = apex[t, 0], apex[t, 1], angle[t]
        ids[FAR], ids[TO_RIGHT], ids[TO_LEFT], ids[FAR_FAN] = vertex[t], _next(t), _previous(t), fan[t]


@jit
def breadth_first(
    F: IntArray,
    l: FloatArray,  # noqa: E741
    twin: IntArray,
    n: int,
) -> tuple[IntArray, IntArray, IntArray, FloatArray, IntArray]:
    """Vertices and faces numbered in the order in which a front over glued faces meets them.

    Returns the new number of each vertex (n,) and of each face (m,), and F, l and twin by the new numbers. Neighbours
    on the surface become neighbours in memory: nothing on most meshes, a fifth of the time where vertices come in an
    arbitrary order.
    """
    m = len(F)
    number = np.full(n, -1, np.int64)
    faces = np.empty(m, np.int64)
    is_met = np.zeros(m, np.bool_)
    n_met = n_numbered = n_done = 0
    for start in range(m):
        if not is_met[start]:
            is_met[start] = True
            faces[n_met] = start
            n_met += 1
        while n_done < n_met:
            f = faces[n_done]
            n_done += 1
            for c in range(3):
                if number[F[f, c]] < 0:
                    number[F[f, c]] = n_numbered
                    n_numbered += 1
                t = twin[3 * f + c]
                if t >= 0 and not is_met[t // 3]:
                    is_met[t // 3] = True
                    faces[n_met] = t // 3
                    n_met += 1
    for v in range(n):
        if number[v] < 0:
            number[v] = n_numbered
            n_numbered += 1
    face = np.empty(m, np.int64)
    for i in range(m):
        face[faces[i]] = i
    new_F, new_l, new_twin = np.empty((m, 3), np.int64), np.empty((m, 3)), np.empty(3 * m, np.int64)
    for i in range(m):
        f = faces[i]
        for c in range(3):
            t = twin[3 * f + c]
            new_F[i, c], new_l[i, c] = number[F[f, c]], l[f, c]
            new_twin[3 * i + c] = 3 * face[t // 3] + t % 3 if t >= 0 else t
    return number, face, new_F, new_l, new_twin


def _aligned(n_rows: int, n_columns: int) -> FloatArray:
    """Zeros whose first address is a multiple of a cache line, 64 bytes."""
    room = np.zeros(n_rows * n_columns + 8)
    start = -room.ctypes.data % 64 // 8
    return room[start : start + n_rows * n_columns].reshape(n_rows, n_columns)


def tables(F: IntArray, l: FloatArray, twin: IntArray, n: int) -> Tables:  # noqa: E741
    """The tables of m oriented triangles on n vertices; `twin` is -1 on the boundary, -2 where more than two meet."""
    length = l.ravel()
    apex, corner_angle = _shapes(l)
    angle, fan, total, in_order = _fans(twin, corner_angle)
    first = _count_spokes(F, twin, n)
    spoke, turn, step = _aligned(first[-1], 8), np.zeros((first[-1], 4)), np.zeros((F.size, 5))
    spoke_id, turn_id, step_id = spoke.view(np.int32), turn.view(np.int32), step.view(np.int32)
    _fill_spokes(F, twin, length, apex, corner_angle, angle, fan, in_order, first, spoke, spoke_id, turn, turn_id)
    _fill_steps(F, twin, apex, angle, fan, step, step_id)
    is_flat = np.ones(n, bool)
    used = np.flatnonzero(np.diff(first))
    around = total[turn_id[first[used], FAN_HERE]]
    is_flat[used] = (around < 0) | (np.abs(around - 2 * np.pi) < 1e-9)
    return Tables(first, spoke, spoke_id, turn, turn_id, step, step_id, total, is_flat)
