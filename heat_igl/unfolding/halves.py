"""Two halves of the vertices beyond a curve, each of which one thread can measure without the other."""

from __future__ import annotations

import numpy as np

from heat_igl.kernels import incidence
from heat_igl.typing import AnyArray, BoolArray

__all__ = ["first_half"]


def first_half(F: AnyArray, is_known: BoolArray) -> BoolArray:
    """About half (n,) of the vertices that are not known, in parts that no triangle joins to one of the other half.

    The two sides of a closed curve are such parts if the vertices near it are known. Where there is one part only, the
    half is all of it.

    Parameters
    ----------
    F : (m, 3) int32
        Triangles.
    is_known : (n,) bool
        Which vertices separate the parts; they may be in either half.
    """
    apart = incidence.components_without(F, is_known.view(np.uint8))
    size = np.bincount(apart, ~is_known)
    order = np.argsort(-size, kind="stable")
    # The largest part, and further ones as long as these are at most half of all.
    in_first = np.zeros(len(size), bool)
    in_first[order[2 * np.cumsum(size[order]) <= size.sum()]] = True
    in_first[order[0]] = True
    return np.asarray(in_first[apart])
