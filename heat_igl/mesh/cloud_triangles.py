"""The triangles of a point cloud: Delaunay triangles of tangent planes, as far as they fit together to a surface.

In the union of the local triangulations (Sharp and Crane 2020, section 6), nearly all triangles are in the stars of all
three corners. These never overlap, since each star is planar. If stars differ, on four points near a circle or on
noisy points, triangles of more stars come first, and of these the smaller ones; others that do not fit are left out.
Then loops of outer edges are filled in space, and points of parts that are too small for a surface are inserted into
the nearest triangle.
"""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.cloud.agreeing import agreement
from heat_igl.kernels.cloud.fitting_triangles import fitting_triangles
from heat_igl.kernels.cloud.joining_fans import joining_triangles
from heat_igl.kernels.cloud.local_delaunay import delaunay_stars
from heat_igl.kernels.cloud.loop_filling import filling_triangles
from heat_igl.kernels.mesh.gluing import glue
from heat_igl.kernels.mesh.incidence import components
from heat_igl.mesh.connectivity import ascending_rows, connected_components, facets
from heat_igl.mesh.neighbourhoods import Neighbourhoods, PointTree
from heat_igl.runtime import over_rows
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

# Largest radius of a circumscribed circle, in shares of the radius of the neighbourhood. Below one half, all points
# inside the circle are known; a little more bridges the gaps of random points.
_LARGEST_RADIUS = 0.6
# The same for gaps, in shares of the distance of the farthest neighbour: larger, since the sides of a gap are known to
# belong to the surface.
_LARGEST_GAP = 0.9
# Points whose stars are found at a time.
_BLOCK = 1 << 14
# Sides, those of neighbours on them, and whether both run alike.
GluedSides = tuple[IntArray, IntArray, BoolArray]
# Product of two normals below which neighbours belong to different sheets; at right angles they may share an edge.
_OTHER_SHEET = -0.25
# Cosine of the angle to the next triangle above which the two fold back and may join sheets wrongly: 60 degrees; and
# above which they lie on each other.
FOLDED_BACK, _MOST_FOLDED = 0.5, 0.99
# Triangles of a part for each one that fills its gaps: with fewer, it is the border of the part that was filled.
_PER_FILLED = 10


def cloud_triangles(P: FloatArray, near: Neighbourhoods, has_side: BoolArray) -> IntArray:
    """Triangles (m, 3) int32 on points; an edge has at most two, and they may make several fans around a point.

    Parameters
    ----------
    P : (n, 3) float64
        The points.
    near : Neighbourhoods
        Their neighbours and tangent planes.
    has_side : (n,) bool
        Where the normals tell sheets apart: neighbours with opposite normals are left out.
    """
    agreed, others, is_settled = _triangles_of_stars(P, near, np.where(has_side, _OTHER_SHEET, -2.0))
    # Around a settled point nothing is left to do.
    is_open = ~at_all_corners(is_settled, agreed)
    F, candidates = agreed[is_open], others[~at_some_corner(is_settled, others)]
    # The angle of a corner is the same number in every star that has the triangle.
    both = np.concatenate([F, candidates])
    F = both[fitting_triangles(P, near.axes, both, len(F))]
    F = np.concatenate([agreed[~is_open], F])
    return _with_small_parts(P, with_loops_filled(P, F, near.reach, is_settled), near)


def _triangles_of_stars(
    P: FloatArray, near: Neighbourhoods, least_cosine: FloatArray
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


def _with_small_parts(P: FloatArray, F: IntArray, near: Neighbourhoods) -> IntArray:
    """The triangles, of which those are split that are nearest to points of small parts.

    A part of fewer points than a neighbourhood, as single points that noise has put above others, is no surface of its
    own if it is near another.
    """
    part = connected_components(F, len(P))
    size = np.bincount(part)
    is_small = (size < near.index.shape[1])[part]
    kept, points = F[~is_small[F[:, 0]]], np.flatnonzero(is_small)
    if not len(points) or not len(kept):
        return F
    nearest, distance = _middles(P, kept).nearest(P[points], 1)
    # Outliers are farther away than a neighbour would be.
    is_far = distance > near.radius[kept[nearest[:, 0], 0]]
    stays = np.bincount(part[points[is_far]], minlength=len(size)) > 0
    points = points[~stays[part[points]]].astype(np.int32)
    F = F[~is_small[F[:, 0]] | stays[part[F[:, 0]]]]
    while len(points):
        # One point in each triangle and round.
        face, chosen = np.unique(_middles(P, F).nearest(P[points], 1)[0][:, 0], return_index=True)
        point = points[chosen]
        a, b, c = F[face].T
        F = np.concatenate([F, np.stack([b, c, point], axis=1), np.stack([c, a, point], axis=1)])
        F[face, 2] = point
        points = np.delete(points, chosen)
    return F


def _middles(P: FloatArray, F: IntArray) -> PointTree:
    """The middles of triangles."""
    return PointTree(P[F].mean(axis=1), np.arange(len(F)))


def at_all_corners(is_chosen: BoolArray, F: IntArray) -> BoolArray:
    """Which of the triangles F (m, 3) have chosen corners alone; by columns, in a fifth of the time of rows."""
    a, b, c = F.T
    return np.asarray(is_chosen[a] & is_chosen[b] & is_chosen[c])


def at_some_corner(is_chosen: BoolArray, F: IntArray) -> BoolArray:
    """Which of the triangles F (m, 3) have a chosen corner."""
    return ~at_all_corners(~is_chosen, F)


def pinched_vertices(F: IntArray, n: int, glued: GluedSides) -> IntArray:
    """The vertices (k,), of n, at which several fans of the triangles F (m, 3) meet, for their `glued_sides`."""
    fan = _fans(F, glued)
    of_fan = np.zeros(int(fan.max(initial=-1)) + 1, np.int64)
    of_fan[fan] = F.ravel()
    return np.flatnonzero(np.bincount(of_fan, minlength=n) > 1)


def _fans(F: IntArray, glued: GluedSides) -> IntArray:
    """The fan (3 m,) of each corner: corners of a vertex are in one fan if edges join their triangles."""
    first, second, runs_alike = glued
    ends = [np.stack([corner(first, e), corner(second, np.where(runs_alike, e, 3 - e))], axis=1) for e in (1, 2)]
    fan: IntArray = components(np.concatenate(ends), F.size)
    return fan


def glued_sides(F: IntArray, n: int) -> GluedSides:
    """Sides 3 f + c (k,), opposite corner c of triangle f, the sides of neighbours on them, and whether both run alike.

    On n points; an edge has at most two of the triangles F (m, 3).
    """
    _, twin, _, is_aligned, _ = glue(F.astype(np.int64), np.zeros((n, 3)), 1.0)
    first = np.flatnonzero(twin > np.arange(len(twin)))
    return first, twin[first].astype(np.int64), is_aligned[first] == 0


def corner(sides: IntArray, turn: int | IntArray) -> IntArray:
    """The corner 3 f + c at the beginning, for 1, or the end, for 2, of sides, which are opposite to corner c."""
    return sides - sides % 3 + (sides + turn) % 3


def with_fans_joined(P: FloatArray, F: IntArray, pinched: IntArray) -> IntArray:
    """The triangles F (m, 3), and others between the fans of `pinched` vertices (k,) that have several with an end.

    Two parts of a surface that meet in one vertex alone are connected for distance, but not for vectors, which need a
    tangent plane along the way. Between two fans goes the triangle with the shortest third side that runs along its
    sides against the neighbours. Where there is none, the largest fan stays, unless parts or points would be cut off.
    """
    if not len(pinched):
        return F
    is_near = np.zeros(len(P), bool)
    is_near[pinched] = True
    is_near[F[at_some_corner(is_near, F)]] = True
    added = joining_triangles(P, F[at_some_corner(is_near, F)].astype(np.int32), pinched)
    return _with_largest_fans(np.concatenate([F, added.astype(F.dtype)]), len(P))


def _with_largest_fans(F: IntArray, n: int) -> IntArray:
    """The triangles F (m, 3) in the largest fan of each corner, and others that are between parts of these."""
    fan, vertex = _fans(F, glued_sides(F, n)), F.ravel()
    order = np.lexsort((-fan, np.bincount(fan)[fan], vertex))
    largest = np.empty(n, np.int64)
    # Of several values written to one place, the last stays.
    largest[vertex[order]] = fan[order]
    stays = (fan == largest[vertex]).reshape(-1, 3).all(axis=1)
    part = connected_components(F[stays], n)[F]
    stays |= (part != part[:, :1]).any(axis=1)
    found: IntArray = F[stays]
    return found


def with_loops_filled(P: FloatArray, F: IntArray, reach: FloatArray, is_settled: BoolArray) -> IntArray:
    """The triangles F (m, 3) int32, and others in gaps all around which points have two outer edges.

    Parameters
    ----------
    P : (n, 3) float64
        The points.
    F : (m, 3) int32
        Triangles that are a surface.
    reach : (n,) float64
        See `Neighbourhoods`.
    is_settled : (n,) bool
        Points without gaps around them.
    """
    n = len(P)
    near_gaps = F[~at_all_corners(is_settled, F)]
    found = facets(near_gaps, n)
    is_outer = (found.n_faces == 1) & ~is_settled[found.vertices].any(axis=1)
    if not is_outer.any():
        return F
    number = np.cumsum(is_outer) - 1
    ends = found.vertices[is_outer].astype(np.int32)
    opposite = np.empty(len(ends), np.int32)
    is_side = is_outer[found.of_face]
    opposite[number[found.of_face[is_side]]] = near_gaps[is_side]
    filled, is_closed = filling_triangles(
        P,
        ends,
        opposite,
        _two_edges_at(ends, n),
        _LARGEST_GAP * reach,
        found.vertices[:, 0] * n + found.vertices[:, 1],
        FOLDED_BACK,
        _MOST_FOLDED,
    )
    if not len(filled):
        return F
    part = connected_components(F, n)
    sizes, gains = (np.bincount(part[of[:, 0]], minlength=n) for of in (F, filled[is_closed]))
    return np.concatenate([F, filled[~is_closed | (sizes >= _PER_FILLED * gains)[part[filled[:, 0]]]]])


def _two_edges_at(ends: AnyArray, n: int) -> AnyArray:
    """The edges (n, 2) int32 at points that have two of the edges (k, 2), and -1 at others."""
    order = np.argsort(ends.ravel(), kind="stable")
    point = ends.ravel()[order]
    has_two = np.bincount(point, minlength=n) == 2
    at = np.full((n, 2), -1, np.int32)
    at[has_two] = order[has_two[point]].reshape(-1, 2) // 2
    return at
