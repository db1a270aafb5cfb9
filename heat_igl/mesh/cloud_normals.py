"""Normals of a cloud that are missing or point to the wrong side: turned over, or reported and left out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.kernels.mesh.incidence import components
from heat_igl.mesh.cloud_orientation import turned_groups
from heat_igl.runtime import warn_caller
from heat_igl.typing import AnyArray, BoolArray, FloatArray

if TYPE_CHECKING:
    from heat_igl.mesh.neighbourhoods import PointTree

# Neighbours that are compared. With a tenth of the normals turned over, on the vertices of 17 meshes, 1.4, 1.0, 1.0 and
# 0.4 % end wrong with 5, 7, 10 and 15, and 4, 6, 7 and 12 clouds lose all; with four tenths 1.9, 0.4, 0 and 0 %.
_K = 10
# Largest share of contradicting neighbours of oriented normals. On the vertices of scans and models it is below 0.01,
# where parts cross up to 0.07; with normals at random 0.5.
_MOST_CONTRADICTING = 0.015
# Two groups of points lie on different sheets if this share of their neighbours is on one side of each other. With a
# tenth of the normals turned over, on 14 meshes, 1.5, 1.1, 0.9 and 0.8 % end wrong with 0.6, 0.7, 0.8 and 0.9.
_NEARLY_ALL = 0.8
# Heights that are taken for 0, in shares of the distance.
_ROUNDING = 1e-10


def oriented_normals(tree: PointTree, normals: FloatArray | None) -> tuple[FloatArray | None, BoolArray]:
    """The normals (n, 3) of the points of `tree`, turned to the same side, and where (n,) they tell sheets apart.

    They do not tell sheets apart at a point with neighbours of opposite normals both in front and behind, as there are
    where the normals of a surface with one side change over. If no choice of sides is consistent, the normals are None,
    with an AccuracyWarning.

    Two neighbours with opposite normals lie on two sheets, or one of the normals points to the wrong side. Of two
    sheets, one is in front of the other: then nearly all such neighbours are in front of each other, or nearly all
    behind. Points connected through neighbours with like normals form a group: a sheet, a patch with turned normals, or
    a single point. Groups that contradict others are turned as a whole, so that most points keep their normals.
    """
    n = len(tree.P)
    if normals is None or n <= _K:
        return normals, np.full(n, normals is not None)
    pairs = np.stack([np.repeat(np.arange(n), _K), tree.neighbours[0][:, 1 : _K + 1].ravel()], axis=1)
    is_opposite = np.einsum("kx,kx->k", normals[pairs[:, 0]], normals[pairs[:, 1]]) < 0
    group, (a, b) = components(pairs[~is_opposite], n), pairs[is_opposite].T
    # Heights of the neighbour over the plane of the point, and of the point over that of the neighbour: the bend of a
    # single sheet cancels in the sum.
    way = tree.P[b] - tree.P[a]
    height = np.einsum("kx,kx->k", way, normals[a] - normals[b])
    side = np.sign(height) * (np.abs(height) > _ROUNDING * np.linalg.norm(way, axis=1))
    ends = np.sort(group[np.stack([a, b], axis=1)], axis=1)
    _, begin, which = np.unique(ends[:, 0] * n + ends[:, 1], return_index=True, return_inverse=True)
    count, total = np.bincount(which), np.abs(np.bincount(which, side))
    contradicts = (total < _NEARLY_ALL * count) & (ends[begin, 0] != ends[begin, 1])
    joins = ends[begin[contradicts]]
    one = np.ones(int(group.max()) + 1, np.int64)
    is_turned = turned_groups(joins, -count[contradicts].astype(float), one)[group]
    part = components(joins, len(one))[group]
    is_turned ^= (np.bincount(part, is_turned) > np.bincount(part) / 2)[part]
    # The opposite neighbours of a single point must lie on one side of it, too. Pairs of which one was turned are no
    # longer opposite.
    stays = ~contradicts[which] | (is_turned[a] == is_turned[b])
    count, total = (np.bincount(a[stays], weight, n) for weight in (None, side[stays]))
    total = np.abs(total)
    share = (count - total).sum() / len(pairs)
    if share <= _MOST_CONTRADICTING:
        return np.where(is_turned[:, None], -normals, normals), total >= _NEARLY_ALL * count
    warn_caller(
        f"normals point to both sides of the surface at random ({100 * share:.0f} % of neighbours contradict each "
        "other), as if they were no normals of it: they are not used; orient them, or pass normals=None",
        AccuracyWarning,
    )
    return None, np.zeros(n, bool)


def usable_normals(normals: AnyArray, where: str = "") -> AnyArray | None:
    """The normals (n, 3) of a file or of another library; None if they are all 0, or if some are missing.

    `where` is the beginning of the warning that some, but not all, are 0 or not finite.
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
