"""Neighbourhoods of the points of a cloud: nearest points, tangent planes, and positions with less noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.kernels.cloud.empty_balls import on_one_side, roomiest_normals
from heat_igl.kernels.cloud.local_fits import onto_quadrics, tangent_planes
from heat_igl.mesh.connectivity import connected_components, group_by_label
from heat_igl.runtime import over_rows, warn_caller
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Nearest points, for planes and triangles: errors on scans are a sixth larger with 24, and a tenth smaller with 40.
K = 30
# Points at a time: bounds the memory for their neighbours.
_BLOCK = 1 << 12
# Points in a leaf of the tree that sorts them. With scipy's 10, errors on 223 clouds are the same in the mean, at most
# 8 % smaller and 5 % larger.
_LEAF = 8
# Ratio of the two smaller variances above which neighbours may be on several sheets: errors on 25 surfaces are the same
# with 0.05, and a tenth larger without.
_SEVERAL_SHEETS = 0.1
# Directions in which balls are tried, half and their opposites: every 22 degrees. With 60 a tenth of a neighbour
# stays on the other of two sheets 1.5 spacings apart; with 120 and 160 errors at thin parts are no smaller.
_DIRECTIONS = 100

# Parts of no more points stay as they are. With half as many, errors on 193 random clouds of 62 to 238 points,
# clean and with noise of 1 to 6 %, are 3 % larger in the mean, up to 4.9 times; with twice as many 1 % smaller, and up
# to 42 times as large.
_FEWEST = 4 * K
# Noise in shares of the spacing. Heights that vary by a share e of the spacing lengthen edges by the share e^2, so
# below this one noise costs less than the heat method.
_NOISE = 0.05
# Above this ratio of the two smaller variances, a neighbourhood is no disc: more points are needed to see the surface.
# With 0.15, three meshes with noise of 1 % are a tenth nearer, and a sphere of 20 000 points is 6 % less so.
_THICKNESS = 0.05
# With 60 and noise of 3 %, errors on five meshes are 14 to 27 % larger, on four 4 to 34 % smaller.
_LARGEST_K = 120
# Above this ratio in all neighbourhoods, the flattest of which is not the largest, nothing tells noise from detail: on
# tori of 500 and 1000 points with noise and on a head of 507, distance is 4 to 9 % wrong above it, 2 % below.
_NO_DISC = 0.15
# Above this one the neighbourhood is a ball within the noise. With 0.6, errors on 30 000 points of a square with noise
# of 3 and 6 % are 1.2 and 2.5 times as large; with 0.3, those on six meshes with noise of 3 % are 1.3 to 2.2 times.
_NO_SURFACE = 0.5
# Noise in the neighbours moves quadrics, too: with one pass errors on scans are 2 % larger, with eight no smaller.
_PASSES = 2
# Noise is looked for at this many points: deviations differ by a third from point to point, their median by 3 %. With
# 500, errors on 234 clouds, clean and with noise of 0.05 to 3 %, are the same; with 125 seven are 1.2 to 2.8 times so.
_SAMPLE = 250
# Deviations from a quadric of half as many neighbours, in shares of those from the quadric of all: noise deviates from
# both alike, by 0.85 to 1 in measurements, detail from the smaller one by less, 0.14 to 0.74. Noise of about a spacing
# makes neighbourhoods balls, to which quadrics fit worse the larger they are: 0.64 to 1.
_NOISE_NOT_DETAIL, _THICK_NOISE_NOT_DETAIL = 0.8, 0.63
# Mean of 2 a b / (a^2 + b^2), for the displacements a and b of nearest points: of noise at most 0.12, in balls; of two
# scans of one surface up to 0.46, in flatter neighbourhoods; of five shapes that are detail 0.29 to 0.86.
# Half and twice of both, and of the four standard errors by which a mean has to be larger, change nothing on 82 random
# clouds, clean and with noise of 1 and 3 %, and on 24 with noise that is many spacings.
_ALIKE, _SHEETS_ALIKE, _SURE = 0.12, 0.5, 4
_TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class PointTree:
    """Points in the order of the leaves of a k-d tree: those near to each other are near in memory, too.

    Attributes
    ----------
    P : (n, 3) float64
        The points, leaf by leaf.
    order : (n,) int64
        Which of the given points each is.
    """

    P: FloatArray
    order: IntArray

    @cached_property
    def neighbours(self) -> tuple[AnyArray, FloatArray]:
        """The `K` nearest other points (n, k + 1) int32 of each, after the point itself, and the distance (n,)."""
        index = self.neighbours_of(np.arange(len(self.P)), min(K, len(self.P) - 1))
        return index, np.linalg.norm(self.P[index[:, -1]] - self.P, axis=1)

    @cached_property
    def parts(self) -> IntArray:
        """Which part (n,) each point is in: edges from points to their `neighbours` join a part."""
        return connected_components(self.neighbours[0], len(self.P))

    def neighbours_of(self, points: IntArray, k: int, stride: int = 1) -> AnyArray:
        """The k nearest others (b, k + 1) int32 of some points, after the point itself: among every `stride`-th."""
        others = self._search if stride == 1 else _search(self.P[::stride])

        def nearest(rows: slice) -> tuple[AnyArray]:
            distance, number = others.query(self.P[points[rows]], k + 1)
            index, itself = stride * number.astype(np.int32), points[rows, None]
            # The point may be none of the others, or as near as they are, since squares of distances underflow.
            is_itself = index == itself
            is_itself[:, -1] |= ~is_itself.any(axis=1)
            np.copyto(index, itself, where=is_itself, casting="same_kind")
            distance[is_itself] = -1
            unsorted = (distance[:, 1:] <= distance[:, :-1]).any(axis=1)
            order = np.lexsort((index[unsorted], distance[unsorted]))
            index[unsorted] = np.take_along_axis(index[unsorted], order, axis=1)
            return (index,)

        return by_rows(nearest, len(points))[0]

    @cached_property
    def _search(self) -> Any:
        return _search(self.P)


@dataclass(frozen=True, eq=False)
class Neighbourhoods:
    """The nearest points of each of n points, and the tangent plane.

    Attributes
    ----------
    index : (n, k + 1) int32
        The points themselves and their neighbours, by distance; -1 after the last.
    radius : (n,) float64
        Distance of the farthest of them.
    reach : (n,) float64
        Distance of the farthest of all neighbours, also of those on other sheets.
    axes : (n, 3, 3) float64
        Two tangents and the normal of each point, in rows, orthonormal.
    """

    index: IntArray
    radius: FloatArray
    reach: FloatArray
    axes: FloatArray


def point_tree(P: FloatArray) -> PointTree:
    """The points P (n, 3), sorted as in the leaves of a k-d tree: in the same order, however they were numbered."""
    order = np.argsort(P @ np.sqrt([1.0, 2.0, 3.0]), kind="stable")
    order = order[np.asarray(_search(P[order]).indices, np.int64)]
    return PointTree(P[order], order)


def _search(P: FloatArray) -> Any:
    from scipy.spatial import KDTree  # takes as long to import as the rest of the package

    return KDTree(P, _LEAF)


def neighbourhoods(tree: PointTree, normals: FloatArray | None = None) -> Neighbourhoods:
    """Neighbours and tangent planes of the points of `tree`.

    Planes are found by principal components unless the normals (n, 3) of ``tree.P`` are given. Points weigh
    1 - (d / r)^2, for d the distance and r the radius of the neighbourhood. Where neighbourhoods are far from flat, at
    edges and thin parts, neighbours on other sheets are left out.
    """
    P, (index, reach) = tree.P, tree.neighbours
    if normals is not None:
        return Neighbourhoods(index, reach, reach, _axes_along(normals))
    axes, bend = by_rows(lambda rows: tangent_planes(P, index[rows]), len(P))
    radius, bent = reach, np.flatnonzero(bend > _SEVERAL_SHEETS)
    if len(bent):
        index, radius = index.copy(), reach.copy()
        index[bent], radius[bent], axes[bent] = one_sheet(P, index.take(bent, axis=0), axes.take(bent, axis=0))
    return Neighbourhoods(index, radius, reach, axes)


def one_sheet(P: FloatArray, index: IntArray, principal: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Neighbours on the same sheet of the surface as each of b points, and planes by the side with most room.

    The sheets of a thin part, or on the two sides of a narrow gap, nearly touch: the neighbours of a point are on
    both. The empty balls that touch a point are small between the sheets, and neighbours on the other sheet share no
    ball with it on the same side of both (Amenta and Bern 1999 estimate normals by such balls).

    Each row of `index` (b, k) int32 is one of the points P (n, 3), then its neighbours by distance, and `principal`
    (b, 3, 3) are the principal axes of these neighbourhoods. Returns `index`, `radius` and `axes` as `Neighbourhoods`
    has them. Only neighbours that are among the b points themselves are left out.
    """
    directions = np.ascontiguousarray(_directions(_DIRECTIONS).T, np.float32)
    number = np.full(len(P), -1, np.int32)
    number[index[:, 0]] = np.arange(len(index))
    normals, radii = by_rows(lambda rows: roomiest_normals(P, index[rows], principal[rows], directions), len(index))
    found, radius = by_rows(lambda rows: on_one_side(P, index[rows], number, normals, radii), len(index))
    return found, radius, _axes_along(normals)


def _axes_along(normals: FloatArray) -> FloatArray:
    """Orthonormal axes (n, 3, 3) whose last rows are the unit vectors `normals` (n, 3)."""
    x, y, z = normals.T
    sign = np.copysign(1.0, z)
    # A rotation of the coordinate axes that takes the third, or its opposite, to the normal.
    a = -1 / (sign + z)
    b = a * x * y
    axes = [1 + sign * a * x * x, sign * b, -sign * x, b, sign + a * y * y, -y, x, y, z]
    return np.stack(axes, axis=1).reshape(-1, 3, 3)


@cache
def _directions(m: int) -> FloatArray:
    """About m / 2 unit vectors, which with their opposites are spread evenly: the same whatever axes are turned over.

    In the first octant they are on a spiral, whose turns are the golden angle apart.
    """
    height = 1 - (2 * np.arange(m) + 1) / m
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(m)
    radius = np.sqrt(1 - height**2)
    spiral = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
    octant = spiral[(spiral > 0).all(axis=1)]
    return np.concatenate([octant * [x, y, 1] for x in (-1, 1) for y in (-1, 1)])


def without_noise(tree: PointTree) -> PointTree:
    """The points, moved onto quadrics fitted to their neighbours in the parts that are noisy; else `tree` itself.

    Whether one part is noisy, and how much, does not depend on others.
    """
    if not tree.parts.any():
        return _part_without_noise(tree)
    P, (first, members) = tree.P.copy(), group_by_label(tree.parts, tree.parts.max() + 1)
    for at in np.split(members, first[1:-1]):
        own = point_tree(tree.P[at])
        P[at[own.order]] = _part_without_noise(own).P
    return tree if (P == tree.P).all() else PointTree(P, tree.order)


def _part_without_noise(tree: PointTree) -> PointTree:
    """The points of one part, moved if they are noisy; else `tree` itself.

    They are noisy if at half of them neighbours deviate from the quadric by more than 1 / 20 of the spacing, and not
    as detail does, see `_is_noisy`. All are then moved along their normals, twice with the same neighbours. Where noise
    is many spacings, neighbours are first found among some of the points, and then among more.
    """
    n = len(tree.P)
    if n <= _FEWEST:
        return tree
    # Evenly over the points, the first and the last among them.
    sample = np.arange(min(n, _SAMPLE)) * (n - 1) // (min(n, _SAMPLE) - 1)
    near = tree.neighbours_of(sample, K)
    if not _is_noisy(tree, near):
        return tree
    for k, stride in _spreads(tree, near):
        index = tree.neighbours[0] if (k, stride) == (K, 1) else tree.neighbours_of(np.arange(n), k, stride)
        for _ in range(_PASSES):
            moved = by_rows(lambda rows, P=tree.P, index=index: onto_quadrics(P, index[rows]), n)[0]  # type: ignore[misc]
            tree = PointTree(moved, tree.order)
    return tree


def _is_noisy(tree: PointTree, near: AnyArray) -> bool:
    """Whether points deviate from quadrics at some of them as noise does: from large as from small, and alone.

    Detail deviates less from small quadrics, and where it is smaller than these, points move as the nearest ones do. A
    row of `near` (b, k + 1) holds a point and its `K` neighbours.
    """
    nearest = near[:, : K // 2 + 1].copy()
    way, few = _deviations(tree, nearest)
    if few < _NOISE:
        return False
    share = few / _deviations(tree, near)[1]
    if share < _THICK_NOISE_NOT_DETAIL:
        return False
    if share < _NOISE_NOT_DETAIL and _thickness(tree, nearest) <= _NO_DISC:
        return False
    other = _deviations(tree, tree.neighbours_of(near[:, 1], K // 2))[0]
    alike = 2 * (way * other).sum(axis=1) / np.maximum((way**2 + other**2).sum(axis=1), _TINY)
    least = alike.mean() - _SURE * alike.std() / np.sqrt(len(near))
    is_ball = least > _ALIKE and _thickness(tree, near) > _NO_SURFACE
    return bool(least <= _SHEETS_ALIKE and not is_ball)


def _deviations(tree: PointTree, index: AnyArray) -> tuple[FloatArray, float]:
    """The ways (b, 3) of points to quadrics of neighbours, and the median noise around these, in spacings."""
    moved, noise = onto_quadrics(tree.P, index)
    return moved - tree.P[index[:, 0]], float(np.median(noise)) * np.sqrt((index.shape[1] - 1) / np.pi)


def _spreads(tree: PointTree, near: AnyArray) -> list[tuple[int, int]]:
    """How many neighbours, and among every how many-th of the points, in the order in which they are taken.

    As many as are flattest at some points, which rows of `near` (b, k + 1) hold with their `K` neighbours: more than
    `K` where noise thickens these, and fewer where the surface bends. Where as many as are taken show no surface at
    all, they are taken among fewer points first.
    """
    n = len(tree.P)
    k, stride, most = K, 1, min(_LARGEST_K, n // 4)
    found = {k: _thickness(tree, near[:, : k + 1].copy()) for k in (K // 2, K)}
    if found[K] > _THICKNESS:
        near = tree.neighbours_of(near[:, 0], most)
    while found[k] > _THICKNESS and k < most:
        k = min(2 * k, most)
        found[k] = _thickness(tree, near[:, : k + 1].copy())
    flattest = min(found, key=found.__getitem__)
    if found[flattest] <= _NO_SURFACE:
        if found[flattest] > _NO_DISC and flattest != k:
            warn_caller(
                f"the points are too few to tell noise from detail: none of {', '.join(map(str, found))} neighbours "
                "are flat, and they are smoothed as if they were noisy. Distance may be far off: give the mesh, more "
                "points, or points without noise",
                AccuracyWarning,
            )
        return [(flattest, 1)]
    # Twice as flat as where a surface begins to show: with all of that, or half, two of 24 clouds with noise of many
    # spacings are .57 and 1.04 times as wrong, the others as before. At least four neighbourhoods of points are left:
    # with eight, they and 27 random clouds are as before or .53 to 1.09 times as wrong, with sixteen .62 to 1.36.
    while found[k] > _NO_SURFACE / 2 and n // (4 * stride) >= 4 * k:
        stride *= 4
        found[k] = _thickness(tree, tree.neighbours_of(near[:, 0], k, stride))
    return [(k, stride), (k, 1)]


def _thickness(tree: PointTree, index: AnyArray) -> float:
    """The median ratio of the two smaller variances of neighbourhoods, rows of `index` (b, k + 1)."""
    return float(np.median(tangent_planes(tree.P, index)[1]))


def by_rows(work: Callable[[slice], tuple[AnyArray, ...]], n: int) -> tuple[AnyArray, ...]:
    """The arrays that `work` returns for slices of n rows, one after the other."""
    parts = over_rows(work, n, _BLOCK)
    return parts[0] if len(parts) == 1 else tuple(map(np.concatenate, zip(*parts, strict=True)))
