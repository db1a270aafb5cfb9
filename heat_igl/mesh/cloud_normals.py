"""Normals of a cloud that are missing or were not oriented: found, reported and left out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.runtime import over_rows, warn_caller
from heat_igl.typing import AnyArray, FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.mesh.neighbourhoods import PointTree

__all__ = ["oriented_normals", "usable_normals"]

_K = 10
# Points at which neighbours are looked at.
_SAMPLE = 2000
# Largest share of contradicting neighbours of oriented normals, after single ones were turned over. On the vertices of
# scans and models it is below 0.01, where parts cross up to 0.07; with random signs of the normals of a sphere 0.5.
_MOST_CONTRADICTING = 0.015
# A single normal is turned over if this share of the neighbours is opposite, on both sides.
_NEARLY_ALL = 0.8
# Heights that are taken for 0, in shares of the distance.
_ROUNDING = 1e-10
# How often single normals are looked for.
_PASSES = 3
# Points at a time: bounds the memory for their neighbours.
_BLOCK = 1 << 12


def oriented_normals(tree: PointTree, normals: FloatArray | None) -> FloatArray | None:
    """The normals (n, 3) of the points of `tree`, single ones turned over that contradict their neighbours.

    Neighbours of opposite normals lie on two sheets. Then one sheet is in front of the other, so all of these
    neighbours are in front of a point, or all behind it. If normals were estimated and not oriented, they are on both
    sides, and None is returned.

    Warns
    -----
    AccuracyWarning
        If there are normals, and they are left out.
    """
    n = len(tree.P)
    if normals is None or n <= _K:
        return normals
    opposite, one_side = _opposite(tree, normals, np.unique(np.linspace(0, n - 1, _SAMPLE).astype(np.int64)))
    if (opposite == one_side).all():
        return normals
    found = normals
    for _ in range(_PASSES):
        opposite, one_side = _of_all(tree, found)
        turned = (opposite >= _NEARLY_ALL * _K) & (one_side < opposite)
        if not turned.any():
            break
        found = np.where(turned[:, None], -found, found)
    contradicting = float((opposite - one_side).mean() / _K)
    if contradicting <= _MOST_CONTRADICTING:
        return found
    warn_caller(
        f"normals point to both sides of the surface at random ({100 * contradicting:.0f} % of neighbours contradict "
        "each other), as if they were estimated and not oriented: they are not used; orient them, or pass normals=None",
        AccuracyWarning,
    )
    return None


def _of_all(tree: PointTree, normals: FloatArray) -> tuple[AnyArray, AnyArray]:
    """`_opposite` of all points."""
    blocks = over_rows(lambda rows: _opposite(tree, normals, np.arange(rows.start, rows.stop)), len(tree.P), _BLOCK)
    opposite, one_side = np.concatenate(blocks, axis=1)
    return opposite, one_side


def _opposite(tree: PointTree, normals: FloatArray, points: IntArray) -> tuple[IntArray, FloatArray]:
    """How many neighbours of some points (b,) have opposite normals, and by how many more they are on one side."""
    near = tree.nearest(points, _K + 1)[0][:, 1:]
    is_opposite = np.einsum("sx,skx->sk", normals[points], normals[near]) < 0
    # Heights of the neighbour over the plane of the point, and of the point over that of the neighbour: the bend of a
    # single sheet cancels in the sum.
    to_neighbour = tree.P[near] - tree.P[points][:, None]
    height = np.einsum("skx,skx->sk", to_neighbour, normals[points][:, None] - normals[near])
    is_apart = np.abs(height) > _ROUNDING * np.linalg.norm(to_neighbour, axis=2)
    side = np.sign(height) * (is_opposite & is_apart)
    return is_opposite.sum(axis=1), np.abs(side.sum(axis=1))


def usable_normals(normals: AnyArray, where: str = "") -> AnyArray | None:
    """The normals (n, 3) of a file or of another library; None if they are all 0, or if some are missing.

    `where` is the beginning of the warning.

    Warns
    -----
    AccuracyWarning
        If some normals, but not all, are 0 or not finite.
    """
    if normals.dtype.kind not in "iuf" or normals.ndim != 2:
        return normals  # which is an error of the cloud
    missing = ~(np.isfinite(normals).all(axis=1) & normals.any(axis=1))
    if not missing.any():
        return normals
    if normals.any():
        warn_caller(
            f"{where}{int(missing.sum())} of {len(normals)} normals are 0 or not finite, the first that of point "
            f"{int(np.argmax(missing))}: no normals are taken, and planes are fitted to the points",
            AccuracyWarning,
        )
    return None
