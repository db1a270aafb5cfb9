"""Orientation of the triangles of a cloud: neighbours alike, and like the normals; without those that contradict."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.kernels.cloud.agreeing import orient
from heat_igl.mesh.cloud_fans import with_fans_joined
from heat_igl.mesh.cloud_gaps import pinched_vertices, with_one_fan
from heat_igl.mesh.connectivity import facets
from heat_igl.mesh.grouping import group_by_label
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["neighbours_across_edges", "oriented"]

# Share of the triangles that may be left out for the others to be oriented alike. Clouds of scans had up to 0.0012; at
# 0.002 and 0.004, on thin and narrow parts of two coarse meshes, distance became up to four times as wrong.
_MOST_LEFT_OUT = 1.5e-3
# Cosine of the angle at an edge, -1 where the two triangles are flat, below which nothing tells a wrong join.
_FLAT = -0.9
# Weights of edges on folds, which join sheets wrongly more often than flat ones: powers of half of 1 - cosine, at least
# the second number. On the vertices of cow, cheburashka and camelhead, 99.0, 99.9 and 99.3 % of the triangles are
# oriented as on the mesh; with the first and the second power down to 95.7 and 87 %.
_POWER, _LEAST_WEIGHT = 4, 1e-3


class _Contradictions(NamedTuple):
    """What remains if the triangles of a surface that may have no orientation are oriented as well as possible.

    Attributes
    ----------
    F : (m, 3) int32
        The triangles, in the given order; some are turned.
    pairs : (k, 2) int64
        Neighbours that are oriented differently.
    folds : (k,) float64
        Cosine of the angle between them around their edge: -1 where they are flat, 1 where they fold back.
    """

    F: IntArray
    pairs: IntArray
    folds: FloatArray


def oriented(P: FloatArray, F: IntArray, normals: FloatArray | None) -> IntArray:
    """The triangles F (m, 3) int32, neighbours oriented alike and each part like most of the normals (n, 3).

    Where triangles join sheets wrongly, no orientation may suit all neighbours. Then of each pair that contradicts it,
    see `_contradictions`, one triangle is left out. All stay where that would tear the surface: where these are many,
    or most of them flat, as on a surface with one side. Then as many neighbours as possible are oriented alike.
    """
    F = F.copy()
    part, is_oriented = orient(F, len(P))
    if not is_oriented:
        found = _contradictions(P, F)
        left_out = _in_pairs(found.pairs, len(F))
        if len(left_out) <= _MOST_LEFT_OUT * len(F) and np.median(found.folds) > _FLAT:
            kept = np.delete(F, left_out, axis=0)
            none = np.zeros(len(P), bool)
            F = with_fans_joined(P, with_one_fan(kept, pinched_vertices(kept, none)), none)
            part, _ = orient(F, len(P))
        else:
            F = found.F
    if normals is not None:
        area = np.cross(P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]])
        along = np.bincount(part, np.einsum("fx,fx->f", area, normals[F].sum(axis=1)))
        turned = along[part] < 0
        F[turned] = F[turned, ::-1]
    return F


def _contradictions(P: FloatArray, F: IntArray) -> _Contradictions:
    """The triangles F (m, 3), oriented so that few neighbours contradict, and these at folds rather than where flat.

    Groups of triangles are joined, two at a time, in the relative orientation that more of the edges between them
    want, weighted by flatness. The strongest joins for the sizes of the groups come first: a narrow bridge between
    two sheets is among the last, and does not turn a part of a sheet around, as it may in a spanning tree of the
    flattest edges (Hoppe et al. 1992).
    """
    first, second = neighbours_across_edges(F, len(P))
    faces = np.stack([first // 3, second // 3], axis=1)
    runs_alike = F.ravel()[_next(first)] == F.ravel()[_next(second)]
    folds = _folds(P, F, first, second)
    weight = np.maximum((1 - folds) / 2, 0) ** _POWER + _LEAST_WEIGHT
    is_turned = _turned(faces, np.where(runs_alike, -weight, weight), len(F))
    contradicts = (is_turned[faces[:, 0]] != is_turned[faces[:, 1]]) != runs_alike
    F = F.copy()
    F[is_turned] = F[is_turned, ::-1]
    return _Contradictions(F, faces[contradicts], folds[contradicts])


def _in_pairs(pairs: IntArray, m: int) -> IntArray:
    """One of each pair (k, 2) of m triangles: that which is in more of the pairs."""
    count = np.bincount(pairs.ravel(), minlength=m)
    a, b = pairs.T
    return np.unique(np.where(count[a] > count[b], a, b))


def _turned(pairs: IntArray, weight: FloatArray, m: int) -> BoolArray:
    """Which of m triangles to turn, for pairs (k, 2) with weights that are negative if just one of them should be."""
    is_turned, group, size = np.zeros(m, bool), np.arange(m), np.ones(m, np.int64)
    a, b = pairs.T
    while len(a):
        n_groups = len(size)
        code = np.minimum(a, b) * n_groups + np.maximum(a, b)
        order = np.argsort(code, kind="stable")
        begin = np.flatnonzero(np.diff(code[order], prepend=-1))
        weight = np.add.reduceat(weight[order], begin)
        a, b = code[order[begin]] // n_groups, code[order[begin]] % n_groups
        # Of equal shares, an arbitrary order: with that of the numbers, groups would be joined one after the other.
        share = np.abs(weight) / (size[a] + size[b]) * (1 + 1e-6 * (np.arange(len(a)) * 7919 % 1009))
        rank, most = np.empty(len(a), np.int64), np.full(n_groups, -1)
        rank[np.argsort(share, kind="stable")] = np.arange(len(a))
        np.maximum.at(most, a, rank)
        np.maximum.at(most, b, rank)
        joins = (rank == most[a]) & (rank == most[b]) & (share > 0)
        if not joins.any():
            break
        is_joined, turns, to = np.zeros(n_groups, bool), np.zeros(n_groups, bool), np.arange(n_groups)
        is_joined[b[joins]], turns[b[joins]], to[b[joins]] = True, weight[joins] < 0, a[joins]
        to = (np.cumsum(~is_joined) - 1)[to]
        is_turned ^= turns[group]
        group, size = to[group], np.bincount(to, size).astype(np.int64)
        weight = np.where(turns[a] != turns[b], -weight, weight)
        a, b = to[a], to[b]
        a, b, weight = a[a != b], b[a != b], weight[a != b]
    return is_turned


def neighbours_across_edges(F: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Half-edges 3 f + c (k,), opposite corner c of triangle f, and those of the neighbours across the edges."""
    found = facets(F, n)
    sides = group_by_label(found.of_face.ravel(), len(found.vertices))
    inner = sides.first[:-1][found.n_faces == 2]
    return sides.members[inner], sides.members[inner + 1]


def _next(half_edges: IntArray) -> IntArray:
    """The corner at which half-edges begin."""
    return half_edges - half_edges % 3 + (half_edges + 1) % 3


def _folds(P: FloatArray, F: IntArray, first: IntArray, second: IntArray) -> FloatArray:
    """Cosine (k,) of the angle between neighbours around their edge: -1 where they are flat, 1 where they fold back."""
    begin, end = F.ravel()[_next(first)], F.ravel()[_next(_next(first))]
    along = P[end] - P[begin]
    along /= np.maximum(np.linalg.norm(along, axis=1), np.finfo(float).tiny)[:, None]

    def across(half_edges: IntArray) -> FloatArray:
        to_corner = P[F.ravel()[half_edges]] - P[begin]
        to_corner -= along * np.einsum("kx,kx->k", along, to_corner)[:, None]
        length = np.linalg.norm(to_corner, axis=1)
        return np.asarray(to_corner / np.maximum(length, np.finfo(float).tiny)[:, None])

    return np.asarray(np.einsum("kx,kx->k", across(first), across(second)))
