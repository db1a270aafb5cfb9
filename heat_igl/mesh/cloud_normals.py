"""Normals of a cloud that are missing or were not oriented: found, reported and left out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.runtime import warn_caller
from heat_igl.typing import AnyArray, FloatArray

if TYPE_CHECKING:
    from heat_igl.mesh.neighbourhoods import PointTree

__all__ = ["oriented_normals", "usable_normals"]

_K = 10
# Points at which neighbours are looked at.
_SAMPLE = 2000
# Largest share of contradicting neighbours of oriented normals. Normals at the vertices of scans and models have up to
# 0.018, those of crossing parts up to 0.07; normals of a sphere with random signs 0.21, one of ten of them turned 0.06.
_MOST_CONTRADICTING = 0.05


def oriented_normals(tree: PointTree, normals: FloatArray | None) -> FloatArray | None:
    """The normals (n, 3) of the points of `tree`, or None if they point to both sides of the surface at random.

    Neighbours of opposite normals lie on two sheets. Then one sheet is in front of the other, so all of these
    neighbours are in front of a point, or all behind it. If normals were estimated and not oriented, they are on both
    sides.

    Warns
    -----
    AccuracyWarning
        If there are normals, and they are left out.
    """
    k = min(_K, len(tree.P) - 1)
    if normals is None or k < _K:
        return normals
    sample = np.unique(np.linspace(0, len(tree.P) - 1, _SAMPLE).astype(np.int64))
    near = tree.nearest(sample, k + 1)[0][:, 1:]
    is_opposite = np.einsum("sx,skx->sk", normals[sample], normals[near]) < 0
    # Heights of the neighbour over the plane of the point, and of the point over that of the neighbour: the bend of a
    # single sheet cancels in the sum.
    to_neighbour = tree.P[near] - tree.P[sample][:, None]
    side = np.sign(np.einsum("skx,skx->sk", to_neighbour, normals[sample][:, None] - normals[near])) * is_opposite
    contradicting = float((is_opposite.sum(axis=1) - np.abs(side.sum(axis=1))).sum() / near.size)
    if contradicting <= _MOST_CONTRADICTING:
        return normals
    warn_caller(
        f"normals point to both sides of the surface at random ({100 * contradicting:.0f} % of neighbours contradict "
        "each other), as if they were estimated and not oriented: they are not used; orient them, or pass normals=None",
        AccuracyWarning,
    )
    return None


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
