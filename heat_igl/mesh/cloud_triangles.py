"""The triangles of a point cloud: Delaunay triangles of tangent planes, as far as they fit together to a surface.

In the union of the local triangulations (Sharp and Crane 2020, section 6), nearly all triangles are in the stars of all
three corners. These never overlap, since each star is planar. If stars differ, on four points near a circle or on
noisy points, triangles of more stars come first, and of these the smaller ones; others that do not fit are left out.
Then small gaps are closed, and points in no triangle are inserted into the nearest one.
"""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.local_delaunay import delaunay_stars, fitting_triangles
from heat_igl.mesh.connectivity import ascending_rows, facets, unique_rows
from heat_igl.mesh.grouping import group_by_label
from heat_igl.mesh.neighbourhoods import Neighbourhoods
from heat_igl.runtime import in_order, n_threads
from heat_igl.typing import FloatArray, IntArray

__all__ = ["cloud_triangles", "with_points"]

# Largest radius of a circumscribed circle, in shares of the radius of the neighbourhood. Below one half, all points
# inside the circle are known; a little more bridges the gaps of random points.
_LARGEST_RADIUS = 0.6
# The same for gaps, whose sides are known to belong to the surface.
_LARGEST_GAP = 0.9
_MOST_ROUNDS = 20
# Points whose stars are found at a time.
_BLOCK = 1 << 14
# Product of two normals below which neighbours belong to different sheets; at right angles they may share an edge.
_OTHER_SHEET = -0.25


def cloud_triangles(P: FloatArray, near: Neighbourhoods, oriented: bool) -> IntArray:
    """Triangles (m, 3) on points; an edge has at most two.

    Parameters
    ----------
    P : (n, 3) float64
        The points.
    near : Neighbourhoods
        Their neighbours and tangent planes.
    oriented : bool
        Whether the normals tell the sides of a surface apart: neighbours with opposite normals are left out.
    """
    corners, radii = _stars(P, near, _OTHER_SHEET if oriented else -2.0)
    rows = ascending_rows(corners).astype(np.int64)
    first, inverse, counts = unique_rows(rows, len(P))
    radius = np.zeros(len(first))
    np.maximum.at(radius, inverse, radii)
    order = np.lexsort((radius, -counts))
    candidates = rows[first[order]].astype(np.int32)
    # The angle of a corner is the same number in every star that has the triangle.
    fits = fitting_triangles(P, near.axes, candidates, int((counts == 3).sum()))
    F = candidates[fits]
    for _ in range(_MOST_ROUNDS):
        ears = _ears(P, F, _LARGEST_GAP * near.radius)
        both = np.concatenate([F, ears])
        fits = fitting_triangles(P, near.axes, both, len(F))
        if fits.sum() == len(F):
            break
        F = both[fits]
    return _with_isolated_points(P, F.astype(np.int64), near)


def _stars(P: FloatArray, near: Neighbourhoods, least_cosine: float) -> tuple[IntArray, FloatArray]:
    """The triangles (s, 3) of the Delaunay stars of all points, and the radii (s,) of their circles."""
    largest = _LARGEST_RADIUS * near.radius

    def of_block(begin: int) -> tuple[IntArray, FloatArray]:
        end = min(begin + _BLOCK, len(P))
        corners, radii = delaunay_stars(P, near.axes, near.index, largest, least_cosine, begin, end)
        return corners, radii

    corners, radii = zip(*in_order(of_block, range(0, len(P), _BLOCK), n_threads()), strict=True)
    return np.concatenate(corners), np.concatenate(radii)


def _ears(P: FloatArray, F: IntArray, largest: FloatArray) -> IntArray:
    """Triangles (k, 3) on two successive edges of the boundary, smallest first, with circles no larger than allowed."""
    found = facets(F.astype(np.int64), len(P))
    outer = found.vertices[found.n_faces == 1]
    ends = group_by_label(np.concatenate([outer[:, 0], outer[:, 1]]), len(P))
    other = np.concatenate([outer[:, 1], outer[:, 0]])
    # More than two boundary edges meet at touching gaps; an ear may be cut there in a later round.
    at = np.flatnonzero(np.diff(ends.first) == 2)
    before, after = other[ends.members[ends.first[at]]], other[ends.members[ends.first[at] + 1]]
    ears = np.stack([before, at, after], axis=1)
    radius = _circumradius(P[ears])
    small = radius < largest[ears].min(axis=1)
    return np.asarray(ears[small][np.argsort(radius[small], kind="stable")], dtype=np.int32)


def _circumradius(corners: FloatArray) -> FloatArray:
    """Radius (k,) of the circle around each triangle (k, 3, 3); ``inf`` for corners on a line."""
    a, b = corners[:, 0] - corners[:, 1], corners[:, 2] - corners[:, 1]
    double_area = np.linalg.norm(np.cross(a, b), axis=1)
    sides = [np.linalg.norm(side, axis=1) for side in (a, b, a - b)]
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = (sides[0] / double_area) * sides[1] * sides[2] / 2
    return np.asarray(np.where(double_area > 0, radius, np.inf))


def _with_isolated_points(P: FloatArray, F: IntArray, near: Neighbourhoods) -> IntArray:
    """The triangles, and in them the points that noise has put above or behind others; outliers stay isolated."""
    used = np.zeros(len(P), bool)
    used[F] = True
    isolated = np.flatnonzero(~used)
    if not len(isolated) or not len(F):
        return F
    of_used = np.flatnonzero(used)
    from scipy.spatial import KDTree  # takes as long to import as the rest of the package

    distance, position = KDTree(P[of_used]).query(P[isolated])
    vertex = of_used[position]
    # Outliers are farther away than a neighbour would be.
    close = distance <= near.radius[vertex]
    return with_points(P, F, near.axes, isolated[close], vertex[close])


def with_points(P: FloatArray, F: IntArray, axes: FloatArray, points: IntArray, vertices: IntArray) -> IntArray:
    """The triangles, with `points` (k,) put into them: of those around a vertex of `vertices` (k,), one is split."""
    F = F.copy()
    while len(points):
        face = _facing(P, F, axes, points, vertices)
        # One point in each triangle and round.
        face, chosen = np.unique(face, return_index=True)
        point = points[chosen]
        a, b, c = F[face].T
        F[face, 2] = point
        F = np.concatenate([F, np.stack([b, c, point], axis=1), np.stack([c, a, point], axis=1)])
        points, vertices = np.delete(points, chosen), np.delete(vertices, chosen)
    return F


def _facing(P: FloatArray, F: IntArray, axes: FloatArray, points: IntArray, vertices: IntArray) -> IntArray:
    """For each point the triangle (k,) around the vertex whose middle lies most in the direction of the point."""
    corner, which = group_by_label(F.ravel(), len(P)).of(vertices)
    face = corner // 3

    def direction(positions: FloatArray) -> FloatArray:
        local = np.einsum("rax,rx->ra", axes[vertices[which], :2], positions - P[vertices[which]])
        return np.asarray(local / np.maximum(np.linalg.norm(local, axis=1), np.finfo(float).tiny)[:, None])

    alike = np.einsum("ra,ra->r", direction(P[F[face]].mean(axis=1)), direction(P[points[which]]))
    best = np.full(len(points), -2.0)
    np.maximum.at(best, which, alike)
    of_best = np.flatnonzero(alike == best[which])
    found = np.empty(len(points), np.int64)
    # Of several values written to one place, the last stays.
    found[which[of_best]] = face[of_best]
    return found
