"""Neighbourhoods of the points of a cloud: nearest points, tangent planes, and positions with less noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from heat_igl.kernels.local_planes import onto_quadrics, principal_axes, tangent_planes
from heat_igl.kernels.point_tree import arrange, nearest
from heat_igl.mesh.sheets import axes_along, one_sheet
from heat_igl.runtime import in_order, n_threads
from heat_igl.typing import FloatArray, IntArray

__all__ = ["Neighbourhoods", "PointTree", "neighbourhoods", "point_tree", "without_noise"]

# Nearest points from which the plane of a point and its triangles are found.
_K = 30
# Points at a time: bounds the memory for their neighbours.
_BLOCK = 1 << 12
# Points in a leaf of the tree, about.
_LEAF = 16
# Ratio of the two smaller variances above which neighbours may be on several sheets.
_SEVERAL_SHEETS = 0.04

# Noise in shares of the spacing. Heights that vary by a share e of the spacing lengthen edges by the share e^2, so
# below this one noise costs less than the heat method.
_NOISE = 0.05
# Above this ratio of the two smaller variances, a neighbourhood is no disc: more points are needed to see the surface.
_THICKNESS = 0.05
_LARGEST_K = 120
_MOST_PASSES = 8
# Noise is looked for at this many points.
_SAMPLE = 1000
# Deviations from a quadric of half as many neighbours, in shares of those from the quadric of all: noise deviates from
# both alike, 0.68 to 1 in measurements, detail from the smaller one by less, 0.14 to 0.58.
_NOISE_NOT_DETAIL = 0.63


@dataclass(frozen=True, eq=False)
class PointTree:
    """Points sorted into a k-d tree, so that those near to each other are near in memory, too.

    Attributes
    ----------
    P : (n, 3) float64
        The points, leaf by leaf.
    order : (n,) int64
        Which of the given points each is.
    box : (2 b - 1, 6) float64
        Least and greatest coordinates in each node of the tree, whose b leaves are last.
    """

    P: FloatArray
    order: IntArray
    box: FloatArray

    def nearest(self, chosen: IntArray, k: int) -> tuple[IntArray, FloatArray]:
        """The k nearest points (b, k) int32 of some of `P`, themselves first, and the squared distances (b, k)."""
        index, square = nearest(self.P, self.box, np.asarray(chosen, np.int32), k)
        return index, square

    def moved(self, P: FloatArray) -> PointTree:
        """The tree of other positions (n, 3) of the same points, in the order of this tree."""
        tree = point_tree(P)
        return replace(tree, order=self.order[tree.order])


@dataclass(frozen=True, eq=False)
class Neighbourhoods:
    """The nearest points of each of n points, and the tangent plane.

    Attributes
    ----------
    index : (n, k + 1) int32
        The points themselves and their neighbours, by distance; -1 after the last.
    radius : (n,) float64
        Distance of the farthest of them.
    axes : (n, 3, 3) float64
        Two tangents and the normal of each point, in rows, orthonormal.
    """

    index: IntArray
    radius: FloatArray
    axes: FloatArray

    @property
    def has_shrunk(self) -> bool:
        """Whether some neighbourhoods were made smaller."""
        return bool((self.index[:, -1] < 0).any())


def point_tree(P: FloatArray) -> PointTree:
    """The k-d tree of the points P (n, 3)."""
    levels = max(int(len(P) / _LEAF).bit_length(), 1)
    order, positions, box = arrange(P, levels)
    return PointTree(positions, order.astype(np.int64), box)


def neighbourhoods(tree: PointTree, normals: FloatArray | None = None, shrinks: bool = True) -> Neighbourhoods:
    """Neighbours and tangent planes of the points of `tree`.

    Planes are found by principal components unless the normals (n, 3) of ``tree.P`` are given. Points weigh
    1 - (d / r)^2, for d the distance and r the radius of the neighbourhood. Where neighbourhoods are far from flat, at
    edges and thin parts, neighbours on other sheets are left out, and neighbourhoods are made smaller if that makes
    them flatter, unless `shrinks` is False.
    """
    P = tree.P
    k = min(_K, len(P) - 1)
    found = Neighbourhoods(np.empty((len(P), k + 1), np.int32), np.empty(len(P)), np.empty((len(P), 3, 3)))
    bend = np.zeros(len(P))

    def fill(rows: slice) -> None:
        index, square = tree.nearest(np.arange(rows.start, min(rows.stop, len(P))), k + 1)
        found.radius[rows] = np.sqrt(square[:, -1])
        if normals is not None:
            found.axes[rows] = axes_along(normals[rows])
        elif shrinks:
            found.axes[rows], found.radius[rows], bend[rows] = tangent_planes(P, index, square)
        else:
            found.axes[rows], variances = principal_axes(P, index, square)
            bend[rows] = variances[:, 0] / np.maximum(variances[:, 1], np.finfo(float).tiny)
        found.index[rows] = index

    _in_blocks(fill, len(P))
    bent = np.flatnonzero(bend > _SEVERAL_SHEETS)
    if len(bent):
        index, square = tree.nearest(bent, k + 1)
        found.index[bent], found.radius[bent], found.axes[bent] = one_sheet(P, index, square, shrinks)
    return found


def without_noise(tree: PointTree) -> PointTree:
    """The points, moved onto quadrics fitted to their neighbours if they are noisy; else `tree` itself.

    Points are noisy if neighbours deviate from the quadric by more than 1 / 20 of their spacing at half of the points,
    and this is not detail, from which a quadric of half as many neighbours would deviate by less. Then all points are
    moved along their normals, until the deviation is smaller.
    """
    k, n = _K, len(tree.P)
    if n <= 4 * k:
        return tree
    most = min(_LARGEST_K, n // 4)
    sample = np.unique(np.linspace(0, n - 1, _SAMPLE).astype(np.int64))
    few = float(np.median(_onto_quadrics(tree, sample, k // 2)[1]))
    if few < _NOISE or few < _NOISE_NOT_DETAIL * float(np.median(_onto_quadrics(tree, sample, k)[1])):
        return tree
    for _ in range(_MOST_PASSES):
        _, noise, thickness = _onto_quadrics(tree, sample, k)
        while np.median(thickness) > _THICKNESS and k < most:
            k = min(2 * k, most)
            _, noise, thickness = _onto_quadrics(tree, sample, k)
        if np.median(noise) <= _NOISE:
            break
        tree = tree.moved(_onto_quadrics(tree, np.arange(n), k)[0])
    return tree


def _onto_quadrics(tree: PointTree, chosen: IntArray, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Some points (b, 3) of the tree, moved onto quadrics that are fitted to k neighbours.

    Also returns the noise (b,) in shares of the spacing, and the ratio (b,) of the two smaller variances.
    """
    moved, noise, thickness = np.empty((len(chosen), 3)), np.empty(len(chosen)), np.empty(len(chosen))

    def fill(rows: slice) -> None:
        index, square = tree.nearest(chosen[rows], k + 1)
        axes, variances = principal_axes(tree.P, index, square)
        moved[rows], noise[rows] = onto_quadrics(tree.P, index, square, axes)
        thickness[rows] = variances[:, 0] / np.maximum(variances[:, 1], np.finfo(float).tiny)

    _in_blocks(fill, len(chosen))
    return moved, noise * np.sqrt(k / np.pi), thickness


def _in_blocks(fill: Callable[[slice], None], n: int) -> None:
    """Call `fill` for slices that make up n rows, on all processors."""
    for _ in in_order(fill, [slice(begin, begin + _BLOCK) for begin in range(0, n, _BLOCK)], n_threads()):
        pass
