"""Copies of points in a cloud: which points are distinct, and triangles that reach the copies."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh.grouping import group_by_label
from heat_igl.typing import FloatArray, IntArray

__all__ = ["distinct_points", "nearest_copies", "with_copies"]

# Copies are put beside the point, at up to this share of the way to the middle of a triangle: paths across triangles
# of area 0 are not always found.
_BESIDE = 1e-7


def distinct_points(P: FloatArray) -> tuple[IntArray, IntArray]:
    """The points (k,) that are no copy of an earlier one, and which of them each of the n points equals."""
    # Copies have the same sum, whatever the factors.
    total = np.sort(P[:, 0] + np.sqrt(2) * P[:, 1] + np.sqrt(3) * P[:, 2])
    if (total[1:] > total[:-1]).all():
        return np.arange(len(P)), np.arange(len(P))
    order = np.lexsort(P.T)
    is_new = np.ones(len(P), bool)
    is_new[1:] = (P[order[1:]] != P[order[:-1]]).any(axis=1)
    if is_new.all():
        return np.arange(len(P)), np.arange(len(P))
    # The sort is stable: the first of equal points has the smallest index.
    distinct = np.sort(order[is_new])
    original = np.empty(len(P), np.int64)
    original[order] = np.searchsorted(distinct, order[is_new])[np.cumsum(is_new) - 1]
    return distinct, original


def nearest_copies(distance: FloatArray, originals: IntArray) -> IntArray:
    """For each of n points that one (n,) of its copies at which `distance` (n,) is least: 0 at a source.

    ``originals`` (n,) is the first point equal to each, see `PointCloud.originals`. Between triangles of nearly no
    area, unfolding may miss a copy, but it reaches one of them.
    """
    order = np.lexsort((distance, originals))
    is_first = np.diff(originals[order], prepend=-1) != 0
    nearest = np.empty(len(originals), np.int64)
    nearest[order] = order[is_first][np.cumsum(is_first) - 1]
    return nearest


def with_copies(V: FloatArray, F: IntArray, distinct: IntArray, original: IntArray) -> IntArray:
    """The triangles F (m, 3) with the copies of points put into them; the copies in V are moved.

    Each of the n points is a copy of ``distinct[original]``. The copies of a point make a row inside one triangle of
    the point, the largest that is left: from the point towards the middle, at most a ten-millionth of the way.
    """
    copies = np.delete(np.arange(len(V)), distinct)
    of = distinct[original[copies]]
    # A point in no triangle is an outlier, and so are its copies.
    is_used = np.zeros(len(V), bool)
    is_used[F] = True
    copies, of = copies[is_used[of]], of[is_used[of]]
    points, rows = np.unique(of), group_by_label(of, len(V))
    while len(points):
        face, which = _largest_faces(V, F, points)
        row, of_face = rows.of(points[which])
        F = _with_rows(V, F, face, points[which], copies[row], of_face)
        points = np.delete(points, which)
    return F


def _largest_faces(V: FloatArray, F: IntArray, points: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles (r,), and which of the points each belongs to: the largest around as many as have one of their own."""
    corner, which = group_by_label(F.ravel(), len(V)).of(points)
    face = corner // 3
    a, b, c = V[F[face]].transpose(1, 0, 2)
    order = np.lexsort((-np.linalg.norm(np.cross(b - a, c - a), axis=1), which))
    is_first = np.diff(which[order], prepend=-1) != 0
    found, chosen = np.unique(face[order[is_first]], return_index=True)
    return found, chosen


def _with_rows(
    V: FloatArray, F: IntArray, face: IntArray, points: IntArray, copies: IntArray, of_face: IntArray
) -> IntArray:
    """The triangles, some of them split by rows of copies that begin at their corner in `points`.

    Row i are the copies where ``of_face`` is i, one after the other, and each row has one at least.
    """
    sizes = np.bincount(of_face, minlength=len(face))
    at = np.argmax(F[face] == points[:, None], axis=1)
    a, b = (F[face, (at + turn) % 3] for turn in (1, 2))
    first = np.cumsum(sizes) - sizes
    place = np.arange(len(copies)) - first[of_face] + 1
    middle = (V[a] + V[b] - 2 * V[points]) / 3
    V[copies] += (_BESIDE * place / sizes[of_face])[:, None] * middle[of_face]
    before = np.roll(copies, 1)
    before[first] = points
    F = F.copy()
    # The rest of the triangle keeps its number and the order of its corners.
    F[face, at] = copies[first + sizes - 1]
    sides = np.stack([before, a[of_face], copies], axis=1), np.stack([before, copies, b[of_face]], axis=1)
    return np.concatenate([F, *(side.astype(F.dtype) for side in sides)])
