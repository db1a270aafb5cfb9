"""Gaps between the triangles of a point cloud, and vertices at which more than one fan of triangles meets."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.kernels.cloud.fitting_triangles import fitting_triangles
from heat_igl.kernels.mesh.incidence import components
from heat_igl.mesh.connectivity import ascending_rows, connected_components, facets, unique_rows
from heat_igl.mesh.grouping import group_by_label, next_in_run
from heat_igl.mesh.neighbourhoods import Neighbourhoods
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["pinched_vertices", "with_gaps_closed", "with_one_fan"]

# Largest radius of the circle around a gap, in shares of the radius of the neighbourhood: larger than for triangles of
# stars, since the sides of a gap are known to belong to the surface.
_LARGEST_GAP = 0.9
_MOST_ROUNDS = 20


class _Outer(NamedTuple):
    """The edges (k, 2) of one triangle alone, ascending and in lexicographic order, and the triangle (k,) of each."""

    ends: IntArray
    face: IntArray


def with_gaps_closed(P: FloatArray, F: IntArray, near: Neighbourhoods, is_settled: BoolArray) -> IntArray:
    """The triangles F (m, 3) and others in small gaps between them.

    Around settled vertices (n,) there are no gaps, and F need not have all their triangles. Gaps of more than three
    sides are closed by triangles on two successive sides that overlap no others; gaps of three sides always, even if
    the three points lie on a line in the tangent planes.
    """
    largest = _LARGEST_GAP * near.radius
    for _ in range(_MOST_ROUNDS):
        ears = _ears(P, _outer_edges(F, is_settled), near.axes, largest)
        # Only triangles with a corner in common may overlap.
        is_near = np.zeros(len(P), bool)
        is_near[ears] = True
        around = F[is_near[F].any(axis=1)]
        fits = fitting_triangles(P, near.axes, np.concatenate([around, ears]), len(around))[len(around) :]
        if not fits.any():
            break
        F = np.concatenate([F, ears[fits]])
    return np.concatenate([F, _three_sided(P, _outer_edges(F, is_settled), largest)])


def with_one_fan(F: IntArray, is_pinched: BoolArray) -> IntArray:
    """The triangles without those that touch the others in a vertex alone: around each vertex, the largest fan.

    `is_pinched` (n,) are the vertices at which several fans meet, see `pinched_vertices`. No vertices are cut off:
    where several fans are the only connection between parts, they stay.
    """
    n, given = len(is_pinched), F
    while is_pinched.any():
        around = np.flatnonzero(is_pinched[F].any(axis=1))
        F = np.delete(F, around[_in_smaller_fans(F[around], is_pinched)], axis=0)
        is_pinched = pinched_vertices(F, np.zeros(n, bool))
    return F if F is given else _with_parts_joined(given, F, n)


def _with_parts_joined(given: IntArray, kept: IntArray, n: int) -> IntArray:
    """The triangles `kept`, and of the `given` ones those at parts that would be cut off: all but the largest."""
    before, after = connected_components(given, n), connected_components(kept, n)
    size = np.bincount(after)[after]
    largest = np.zeros(int(before.max()) + 1, np.int64)
    np.maximum.at(largest, before, size)
    # Of equal parts, the first is the one that the others are joined to.
    first = np.full(len(largest), n)
    np.minimum.at(first, before, np.where(size == largest[before], after, n))
    is_cut_off = after != first[before]
    rows = np.concatenate([kept, given[is_cut_off[given].any(axis=1)]])
    return rows[np.sort(unique_rows(ascending_rows(rows), n)[0])]


def pinched_vertices(F: IntArray, is_settled: BoolArray) -> BoolArray:
    """Which vertices (n,) have several fans; not the settled ones, whose triangles may be missing in F."""
    fan = _fans(F, len(is_settled))
    of_fan = np.zeros(int(fan.max(initial=-1)) + 1, np.int64)
    of_fan[fan] = F.ravel()
    return np.asarray((np.bincount(of_fan, minlength=len(is_settled)) > 1) & ~is_settled)


def _outer_edges(F: IntArray, is_settled: BoolArray) -> _Outer:
    found = facets(F, len(is_settled))
    face = np.empty(len(found.vertices), np.int64)
    face[found.of_face] = np.arange(len(F))[:, None]
    is_outer = (found.n_faces == 1) & ~is_settled[found.vertices].any(axis=1)
    return _Outer(found.vertices[is_outer], face[is_outer])


def _corners(P: FloatArray, outer: _Outer, axes: FloatArray) -> IntArray:
    """Paths (k, 3) of two outer edges that follow each other around the vertex in the middle."""
    ends = group_by_label(np.concatenate([outer.ends[:, 0], outer.ends[:, 1]]), len(P))
    other = np.concatenate([outer.ends[:, 1], outer.ends[:, 0]])[ends.members]
    degrees = np.diff(ends.first)
    at = np.repeat(np.arange(len(P)), degrees)
    # Between two edges there are two gaps, one of which has the triangles; where touching gaps meet, angles tell.
    local = np.einsum("rax,rx->ra", axes[at, :2], P[other] - P[at])
    order = np.lexsort((np.arctan2(local[:, 1], local[:, 0]), at))
    following = next_in_run(order, degrees[degrees > 0])
    corners = np.stack([other[order], at[order], other[following]], axis=1)
    is_second = (degrees[at[order]] == 2) & (order > following)
    return np.asarray(corners[~is_second])


def _ears(P: FloatArray, outer: _Outer, axes: FloatArray, largest: FloatArray) -> IntArray:
    """Triangles (k, 3) on two successive outer edges, smallest first, with circles no larger than allowed."""
    ears = _corners(P, outer, axes)
    radius = _circumradius(P[ears])
    small = radius < largest[ears].min(axis=1)
    return np.asarray(ears[small][np.argsort(radius[small], kind="stable")], dtype=np.int32)


def _three_sided(P: FloatArray, outer: _Outer, largest: FloatArray) -> IntArray:
    """Triangles (k, 3) all three sides of which are outer edges, of different triangles."""
    n = len(P)
    if not len(outer.ends):
        return np.asarray(outer.ends[:, [0, 0, 0]], dtype=np.int32)
    code = outer.ends[:, 0] * n + outer.ends[:, 1]
    ends = group_by_label(outer.ends[:, 0], n)
    # Each edge, with the edges from the larger of its ends on.
    above, which = ends.of(outer.ends[:, 1])
    a, c = outer.ends[which, 0], outer.ends[above, 1]
    third = np.minimum(np.searchsorted(code, a * n + c), len(code) - 1)
    sides = np.stack([which, above, third], axis=1)[code[third] == a * n + c]
    taken: set[int] = set()
    found = []
    for row in sides.tolist():
        corners = np.unique(outer.ends[row])
        extent = np.linalg.norm(P[corners] - P[np.roll(corners, 1)], axis=1).max()
        is_gap = len({int(outer.face[side]) for side in row}) > 1
        if is_gap and taken.isdisjoint(row) and extent < 2 * largest[corners].min():
            taken.update(row)
            found.append(corners)
    triangles: IntArray = np.reshape(found, (-1, 3)).astype(np.int32)
    return triangles


def _circumradius(corners: FloatArray) -> FloatArray:
    """Radius (k,) of the circle around each triangle (k, 3, 3); ``inf`` for corners on a line."""
    a, b = corners[:, 0] - corners[:, 1], corners[:, 2] - corners[:, 1]
    double_area = np.linalg.norm(np.cross(a, b), axis=1)
    sides = [np.linalg.norm(side, axis=1) for side in (a, b, a - b)]
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = (sides[0] / double_area) * sides[1] * sides[2] / 2
    return np.asarray(np.where(double_area > 0, radius, np.inf))


def _in_smaller_fans(F: IntArray, is_pinched: BoolArray) -> BoolArray:
    """Which of the triangles F (m, 3) around pinched vertices are not in the largest fan of such a vertex."""
    fan, vertex = _fans(F, len(is_pinched)), F.ravel()
    size = np.bincount(fan)[fan]
    # The largest fan of each vertex comes first, of equal ones that with the lowest number.
    order = np.lexsort((fan, -size, vertex))
    is_first = np.diff(vertex[order], prepend=-1) != 0
    largest = np.empty(len(is_pinched), np.int64)
    largest[vertex[order][is_first]] = fan[order][is_first]
    return np.asarray((is_pinched[vertex] & (fan != largest[vertex])).reshape(-1, 3).any(axis=1))


def _fans(F: IntArray, n: int) -> IntArray:
    """The fan (3 m,) of each corner: corners of a vertex are in one fan if edges join their triangles."""
    found = facets(F, n)
    sides = group_by_label(found.of_face.ravel(), len(found.vertices))
    inner = sides.first[:-1][found.n_faces == 2]
    of_h, of_g = _ends_of_sides(sides.members[inner]), _ends_of_sides(sides.members[inner + 1])
    is_turned = F.ravel()[of_h[0]] != F.ravel()[of_g[0]]
    of_g = np.where(is_turned, of_g[1], of_g[0]), np.where(is_turned, of_g[0], of_g[1])
    pairs = np.stack([np.concatenate(of_h), np.concatenate(of_g)], axis=1)
    fan: IntArray = components(pairs, F.size)
    return fan


def _ends_of_sides(sides: IntArray) -> tuple[IntArray, IntArray]:
    """The corners (k,) at the beginning and at the end of sides 3 f + c, opposite corner c."""
    first = sides - sides % 3
    return first + (sides + 1) % 3, first + (sides + 2) % 3
