"""Copies of points in a cloud: which points are distinct."""

from __future__ import annotations

import numpy as np

from heat_igl.typing import FloatArray, IntArray


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
