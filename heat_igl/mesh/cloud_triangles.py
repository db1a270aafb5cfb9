"""The triangles of a point cloud: Delaunay triangles of tangent planes, as far as they fit together to a surface.

In the union of the local triangulations (Sharp and Crane 2020, section 6), nearly all triangles are in the stars of all
three corners. These never overlap, since each star is planar. If stars differ, on four points near a circle or on
noisy points, triangles of more stars come first, and of these the smaller ones; others that do not fit are left out.
Then small gaps are closed, and points in no triangle are inserted into the nearest one.
"""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.cloud.agreeing import agreement
from heat_igl.kernels.cloud.fitting_triangles import fitting_triangles
from heat_igl.kernels.cloud.local_delaunay import delaunay_stars
from heat_igl.mesh.cloud_fans import with_fans_joined
from heat_igl.mesh.cloud_gaps import pinched_vertices, with_gaps_closed, with_one_fan
from heat_igl.mesh.cloud_loops import with_loops_filled
from heat_igl.mesh.connectivity import ascending_rows
from heat_igl.mesh.grouping import group_by_label
from heat_igl.mesh.neighbourhoods import Neighbourhoods
from heat_igl.runtime import over_rows
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["cloud_triangles", "with_points"]

# Largest radius of a circumscribed circle, in shares of the radius of the neighbourhood. Below one half, all points
# inside the circle are known; a little more bridges the gaps of random points.
_LARGEST_RADIUS = 0.6
# Points whose stars are found at a time.
_BLOCK = 1 << 14
# Product of two normals below which neighbours belong to different sheets; at right angles they may share an edge.
_OTHER_SHEET = -0.25


def cloud_triangles(P: FloatArray, near: Neighbourhoods, oriented: bool) -> IntArray:
    """Triangles (m, 3) int32 on points; an edge has at most two.

    Around each point they make one fan, unless one that goes all the way around is the only connection to another part.

    Parameters
    ----------
    P : (n, 3) float64
        The points.
    near : Neighbourhoods
        Their neighbours and tangent planes.
    oriented : bool
        Whether the normals tell the sides of a surface apart: neighbours with opposite normals are left out.
    """
    agreed, others, is_settled = _triangles_of_stars(P, near, _OTHER_SHEET if oriented else -2.0)
    # Around a settled point nothing is left to do.
    is_open = ~is_settled[agreed].all(axis=1)
    F, candidates = agreed[is_open], others[~is_settled[others].any(axis=1)]
    # The angle of a corner is the same number in every star that has the triangle.
    both = np.concatenate([F, candidates])
    F = both[fitting_triangles(P, near.axes, both, len(F))]
    F = with_gaps_closed(P, F, near, is_settled)
    is_pinched = pinched_vertices(F, is_settled)
    F = with_one_fan(np.concatenate([agreed[~is_open], F]), is_pinched)
    if is_pinched.any():
        F = with_fans_joined(P, F, is_settled)
    F = with_loops_filled(P, F, near.reach, is_settled)
    return _with_isolated_points(P, F, near)


def _triangles_of_stars(
    P: FloatArray, near: Neighbourhoods, least_cosine: float
) -> tuple[IntArray, IntArray, BoolArray]:
    """The triangles (m, 3) int32 in three Delaunay stars, and those in two or one, in the order that they are taken.

    Also returns which points (n,) are settled: all around them there are triangles in three stars.
    """
    largest = _LARGEST_RADIUS * near.radius

    def stars_of(rows: slice) -> tuple[IntArray, FloatArray, IntArray, IntArray]:
        corners, radii, sizes, is_closed = delaunay_stars(
            P, near.axes, near.index, largest, least_cosine, rows.start, rows.stop
        )
        return corners, radii, sizes, is_closed

    corners, radii, sizes, is_closed = map(np.concatenate, zip(*over_rows(stars_of, len(P), _BLOCK), strict=True))
    first = np.zeros(len(P) + 1, np.int64)
    np.cumsum(sizes, out=first[1:])

    def agreement_of(rows: slice) -> tuple[IntArray, FloatArray, IntArray]:
        count, radius, is_settled = agreement(first, corners, radii, is_closed, rows.start, rows.stop)
        return count, radius, is_settled

    count, radius, is_settled = map(np.concatenate, zip(*over_rows(agreement_of, len(P), _BLOCK), strict=True))
    others = np.flatnonzero((count == 1) | (count == 2))
    rows = ascending_rows(corners[others])
    # Those in more stars first, then the smaller ones.
    order = np.lexsort((*rows.T[::-1], radius[others], -count[others].astype(int)))
    return corners[count == 3], rows[order], is_settled.astype(bool)


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
    return with_points(P, F, near.axes, isolated[close].astype(np.int32), vertex[close])


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
