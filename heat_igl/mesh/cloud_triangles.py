"""The triangles of a point cloud: Delaunay triangles of tangent planes, as far as they fit together to a surface.

In the union of the local triangulations (Sharp and Crane 2020, section 6), nearly all triangles are in the stars of all
three corners. These never overlap, since each star is planar. If stars differ, on four points near a circle or on
noisy points, triangles of more stars come first, and of these the smaller ones; others that do not fit are left out.
Once neighbours are oriented alike, fans that meet in a point are joined, loops of outer edges are filled in space, and
points of parts that are too small for a surface are inserted into the nearest triangle.
"""

from __future__ import annotations

from functools import reduce

import igl
import numpy as np

from heat_igl.kernels.cloud.fitting_triangles import fitting_triangles
from heat_igl.kernels.cloud.local_delaunay import delaunay_stars
from heat_igl.kernels.cloud.loop_filling import filling_triangles, torn_points
from heat_igl.kernels.mesh.gluing import glue
from heat_igl.kernels.mesh.incidence import corners_by_vertex
from heat_igl.mesh.connectivity import Groups, connected_components, fans, mask_of, unique_rows
from heat_igl.mesh.neighbourhoods import K, Neighbourhoods, PointTree, by_rows
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Largest radius of a circumscribed circle, in shares of the radius of the neighbourhood. Below one half, all points
# inside the circle are known; a little more bridges the gaps of random points. With 0.5 and 0.9 errors on 25 surfaces
# are 1 % larger in the mean, with 0.4 a sixth.
_LARGEST_RADIUS = 0.6
# The same for gaps, in shares of the distance of the farthest neighbour: larger, since the sides of a gap are known to
# belong to the surface. With 0.7 and 1.2 errors are 1 % larger in the mean, with 2 they are 4 %.
_LARGEST_GAP = 0.9
# Product of two normals below which neighbours belong to different sheets; at right angles they may share an edge. With
# -0.6, -0.4 and -0.1, errors on twelve clouds with normals are 14 and 5 % larger, and 4 % smaller.
_OTHER_SHEET = -0.25
# The same above which a triangle is put into a gap only if it closes it, a right angle whatever the rounding, as of a
# notch that belongs to stairs; and above which it never is, since both lie on each other, as within a flat border. On
# 82 random clouds without noise and with two amounts, errors are the same to .2 % in the mean with -0.2 and 0, and with
# 0.9 and 0.999; single ones are .67 to 1.24 times as large.
_RIGHT_ANGLE, _MOST_FOLDED = -0.1, 0.99
# Triangles of a part for each one that fills its gaps: with fewer, it is the border of the part that was filled, as
# of a cap of 70, which 18 fill. With 4 errors are the same, and with 30 gaps of small parts stay.
_PER_FILLED = 10
# A gap is torn where one of so many nearest points is more than so many edges away. With 24 points or 3 edges one more
# of 25 surfaces warns, with 6 edges two fewer, of which one is nearly as wrong as by potpourri3d.
_NEAREST, _EDGES_AWAY = 12, 4
# Triangles that bridge gaps are longer than so many times those around them. With 1.5, 22 of 178 random clouds that are
# wrong by more than 5 % are silent, and 47 of 310 that are right within 2 % are said; with 1.75 28 and 32.
_LARGE = 1.75
# Corners of triangles that join sheets are farther apart on the others, in edges and roots of the number of points: 1
# to 1.3 in 12 of 200 random clouds, wrong by 4 to 40 %, and up to .26 in those that are right without a warning. On 82
# others, with and without noise, a quarter says 24 times more that sheets are joined, and 1 once less.
_OTHER_TURN = 0.5


def cloud_triangles(P: FloatArray, near: Neighbourhoods, has_side: BoolArray) -> IntArray:
    """Triangles (m, 3) int32 on points P (n, 3); an edge has at most two, several fans may meet at a point.

    Neighbours with opposite normals are left out where the normals tell sheets apart, which `has_side` (n,) says.
    """
    settled, agreed, others = _triangles_of_stars(P, near, np.where(has_side, _OTHER_SHEET, -2.0))
    # The angle of a corner is the same number in every star that has the triangle.
    both = np.concatenate([agreed, others])
    return np.concatenate([settled, both.compress(fitting_triangles(P, near.axes, both, len(agreed)), axis=0)])


def with_gaps_closed(
    tree: PointTree, F: IntArray, near: Neighbourhoods
) -> tuple[IntArray, IntArray, IntArray, int, bool]:
    """The triangles F (m, 3) int32, oriented alike, with their fans joined, their gaps filled and small parts inserted.

    Gaps come after fans: where several fans meet, no single loop of outer edges passes the point.

    Also returns doubtful points (d,), which may belong to another sheet: they are at a gap from which one of the
    nearest points is many edges away, or at triangles that bridge a gap; points (a,) that neither the stars nor the
    gaps join to the largest part; the number of points on both sides of the longest gap that is bridged, and whether
    one is between sheets, see `_bridged`.
    """
    P = tree.P
    F, is_gap = with_gaps_filled(P, F, _to_full(near) * near.reach)
    part = connected_components(F, len(P))
    size = np.bincount(part)
    is_apart, is_part = part != np.argmax(size), (size > K)[part]
    is_doubtful = np.zeros(len(P), bool)
    at_gap = np.flatnonzero(is_gap & is_part & (near.index[:, -1] < 0))
    is_doubtful[torn_points(F, tree.neighbours[0][at_gap, : _NEAREST + 1], is_part, _EDGES_AWAY)] = True
    bridged, along_one, is_far = _bridged(tree, F)
    is_doubtful[bridged] = True
    F = _with_small_parts(tree, F, part, size)
    return F, np.flatnonzero(is_doubtful), np.flatnonzero(is_apart), along_one, is_far


def _bridged(tree: PointTree, F: IntArray) -> tuple[IntArray, int, bool]:
    """Corners (k,) of large triangles that are many edges apart on the others, and how many in one row of triangles.

    Between random points there are single gaps as large, which other triangles surround; a slot is longer. Also whether
    corners are as far apart as only sheets are that lie on each other, as of a roll: one triangle joins these.
    """
    n = len(tree.P)
    longest = reduce(np.maximum, igl.edge_lengths(tree.P, F).T)
    around = np.bincount(F.ravel(), np.repeat(longest, 3), n) / np.maximum(np.bincount(F.ravel(), minlength=n), 1)
    # Where the density falls, those at a point are all larger than those around its neighbours.
    least = np.full(n, np.inf)
    np.minimum.at(least, F.ravel(), np.repeat(longest, 3))
    most = np.maximum(least, around[tree.neighbours[0]].mean(axis=1))
    is_large = longest > _LARGE * reduce(np.maximum, most[F.T])
    rows = np.concatenate([np.roll(F[is_large], turn, axis=1) for turn in range(3)])
    points = np.unique(torn_points(F[~is_large], rows, np.ones(n, bool), _EDGES_AWAY))
    between, away = rows[np.isin(rows[:, 0], points)], max(int(_OTHER_TURN * np.sqrt(n)), _EDGES_AWAY)
    is_far = len(torn_points(F[~is_large], between, np.ones(n, bool), away)) > 0
    return points, int(np.bincount(connected_components(rows, n)[points], minlength=1).max()), is_far


def tilt(P: FloatArray, F: IntArray, near: Neighbourhoods) -> float:
    """Degrees between triangles and the tangent planes of their corners: the mean is of cosines, of a sample."""
    F = F[:: len(F) // 1000 + 1]
    normal = igl.per_face_normals(P, F, np.zeros(3))
    cosine = np.abs(np.einsum("fx,fcx->fc", normal, near.axes[F, 2])).mean()
    return float(np.degrees(np.arccos(min(cosine, 1.0))))


def _to_full(near: Neighbourhoods) -> float:
    """From radii of neighbourhoods in a cloud of few points to those of `K` points as dense."""
    return float(np.sqrt(K / (near.index.shape[1] - 1)))


def _triangles_of_stars(
    P: FloatArray, near: Neighbourhoods, least_cosine: FloatArray
) -> tuple[IntArray, IntArray, IntArray]:
    """The triangles (m, 3) int32 in three Delaunay stars, and those in two or one, in the order that they are taken.

    Of a settled point, around which all triangles are in three stars, nothing is left to do: first come the triangles
    that have settled corners alone, then others in three stars. Those in fewer stars have no settled corner.
    """
    largest = _LARGEST_RADIUS * _to_full(near) * near.radius
    corners, is_settled = by_rows(
        lambda rows: delaunay_stars(P, near.axes, near.index, largest, least_cosine, rows.start, rows.stop), len(P)
    )
    ascending = np.sort(corners, axis=1)
    first, which, n_stars = unique_rows(ascending, len(P))
    # Each triangle in the star of its lowest point that has it.
    count = np.zeros(len(corners), np.int64)
    count[first] = n_stars
    is_settled[corners[n_stars[which] < 3, 0]] = False
    agreed = corners.compress(count == 3, axis=0)
    is_done = at_all_corners(is_settled, agreed)
    others = []
    # Those in more stars first, then those with smaller circles.
    for fewer in (2, 1):
        rows = np.flatnonzero(count == fewer)
        rows = rows[at_all_corners(~is_settled, corners.take(rows, axis=0))]
        radius = _circumradius(P, ascending.take(rows, axis=0))
        others.append(corners.take(rows[np.argsort(radius, kind="stable")], axis=0))
    return agreed.compress(is_done, axis=0), agreed.compress(~is_done, axis=0), np.concatenate(others)


def _circumradius(P: FloatArray, F: IntArray) -> FloatArray:
    """Radii (m,) of the circles through the corners of F (m, 3): in whatever order a star has them, if F ascends."""
    a, b, c = (P[corner] for corner in F.T)
    sides = reduce(np.multiply, (np.linalg.norm(side, axis=1) for side in (b - a, c - b, c - a)))
    across = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # The circle through collinear points is larger than any other.
    return np.asarray(np.divide(0.5 * sides, across, out=np.full(len(F), np.inf), where=across > 0))


def _with_small_parts(tree: PointTree, F: IntArray, part: IntArray, size: IntArray) -> IntArray:
    """The triangles, split at the points of small parts: each point is inserted into the nearest triangle.

    `part` (n,) is the part of each point and `size` (p,) the number of points of each part. A part is small if it has
    no more points than a neighbourhood, as single points that noise lifts above the surface. It belongs to another
    part if the gap between them is no wider than the gaps that are filled there.
    """
    P, (index, reach) = tree.P, tree.neighbours
    part, reach = part.copy(), reach.copy()
    is_small = size <= K
    is_small[np.argmax(size)] = False
    is_other, is_inserted = is_small[part], np.zeros(len(size), bool)
    if not is_other.any():
        return F
    is_inside = at_all_corners(~mask_of(index[is_other], len(P)), F)
    inside, F = F.compress(is_inside, axis=0), F.compress(~is_inside, axis=0)
    while is_other.any():
        points = np.flatnonzero(is_other)
        is_kept = ~is_other[index[points]]
        beside = index[points, np.argmax(is_kept, axis=1)]
        has_one = is_kept.any(axis=1)
        points, beside = points[has_one], beside[has_one]
        distance = np.linalg.norm(P[beside] - P[points], axis=1)
        # Of the triangles at the nearest point, that with the nearest middle.
        corners, row = Groups(*corners_by_vertex(F, len(P))).of(beside)
        faces = corners // 3
        away = np.linalg.norm(P[F[faces]].mean(axis=1) - P[points[row]], axis=1)
        first = np.lexsort((away, row))[np.searchsorted(row, np.arange(len(points)))]
        is_inserted[part[points[np.minimum(distance, away[first]) <= 2 * _LARGEST_GAP * reach[beside]]]] = True
        chosen = np.flatnonzero(is_inserted[part[points]])
        if not len(chosen):
            break
        # One point in each triangle and round.
        face, row = np.unique(faces[first[chosen]], return_index=True)
        point, beside = points[chosen[row]], beside[chosen[row]]
        a, b, c = F[face].T
        added = np.stack([b, c, point, c, a, point], axis=1).reshape(-1, 3).astype(F.dtype)
        F[face, 2] = point
        F = np.concatenate([F[~is_inserted[part[F[:, 0]]]], added])
        is_other[point], part[point] = False, part[beside]
        # Other points are as near to it as to the surface: its own neighbours may be far away.
        reach[point] = np.minimum(reach[point], reach[beside])
    return np.concatenate([inside, F])


def at_all_corners(is_chosen: BoolArray, F: IntArray) -> BoolArray:
    """Which of the triangles F (m, 3) have chosen corners alone; by columns, in a fifth of the time of rows."""
    a, b, c = F.T
    return np.asarray(is_chosen.take(a) & is_chosen.take(b) & is_chosen.take(c))


def glued_sides(F: IntArray, n: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Sides 3 f + c (k,), opposite corner c of triangle f, the sides of neighbours on them, and whether both run alike.

    On n points; an edge has at most two of the triangles F (m, 3).
    """
    _, twin, _, is_aligned, _ = glue(F.astype(np.int64), np.zeros((n, 3)), 1.0)
    first = np.flatnonzero(twin > np.arange(len(twin)))
    return first, twin[first].astype(np.int64), is_aligned[first] == 0


def corner(sides: IntArray, turn: int | IntArray) -> IntArray:
    """The corner 3 f + c at the beginning, for 1, or the end, for 2, of sides, which are opposite to corner c."""
    return sides - sides % 3 + (sides + turn) % 3


def with_gaps_filled(P: FloatArray, F: IntArray, reach: FloatArray) -> tuple[IntArray, BoolArray]:
    """The triangles F (m, 3) int32 on points P (n, 3), and others between fans of a point and in loops of outer edges.

    Triangles are a surface, oriented alike if it has two sides; `reach` (n,) is that of `Neighbourhoods`. Also returns
    the points (n,) on outer edges of the given triangles.

    Two parts of a surface that meet in one vertex alone are connected for distance, but not for vectors, which need a
    tangent plane along the way. Loops of outer edges go from fan to fan there, to the nearest end of another one. Where
    no triangle fits between two fans, the largest stays, unless parts or points would be cut off.
    """
    n = len(P)
    vertex, twin, *_ = glue(F.astype(np.int64), np.zeros((n, 3)), 1.0)
    sides, is_gap = np.flatnonzero(twin < 0), np.zeros(n, bool)
    is_gap[vertex[corner(sides, 1)]] = is_gap[vertex[corner(sides, 2)]] = True
    filled, is_whole = filling_triangles(P, F, twin, is_gap, _LARGEST_GAP * reach, _RIGHT_ANGLE, _MOST_FOLDED)
    part = connected_components(F, n)
    sizes, gains = (np.bincount(part[of[:, 0]], minlength=n) for of in (F, filled[is_whole]))
    filled = filled[~is_whole | (sizes >= _PER_FILLED * gains)[part[filled[:, 0]]]]
    return _with_largest_fans(np.concatenate([F, filled]), is_gap), is_gap


def _with_largest_fans(F: IntArray, is_gap: BoolArray) -> IntArray:
    """The triangles F (m, 3), those around gaps last, but in the smaller ones of several fans at points (n,) of gaps.

    A triangle stays if parts or points would be cut off.
    """
    n, inside = len(is_gap), F[:0]
    while True:
        is_inside = at_all_corners(~is_gap, F)
        inside, around = np.concatenate([inside, F.compress(is_inside, axis=0)]), F.compress(~is_inside, axis=0)
        fan, vertex = fans(around, n)
        size, most, largest = np.bincount(fan), np.zeros(n, np.int64), np.empty(n, np.int64)
        np.maximum.at(most, vertex, size)
        # Of several values written to one place, the last stays.
        order = np.flatnonzero(size == most[vertex])[::-1]
        largest[vertex[order]] = order
        stays = ((fan == largest[around.ravel()]) | ~is_gap[around.ravel()]).reshape(-1, 3).all(axis=1)
        if not stays.all():
            part = connected_components(np.concatenate([inside, around[stays]]), n)[around]
            stays |= (part != part[:, :1]).any(axis=1)
        if stays.all():
            return np.concatenate([inside, around])
        # What is left of a fan may be several.
        F, is_gap = around[stays], mask_of(around[~stays], n)
