"""Vertices beside a curve in two halves, so that two threads can measure them independently."""

from __future__ import annotations

import numpy as np

from heat_igl.kernels import incidence
from heat_igl.typing import AnyArray, BoolArray

__all__ = ["first_half"]


def first_half(F: AnyArray, is_known: BoolArray) -> BoolArray:
    """Mask (n,) of about half of the vertices that are not known; no triangle joins one of them to one of the other
    half.

    If the vertices near a closed curve are known, the sides of the curve are separate parts. If there is only one part,
    the mask holds all of it.

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
    # The largest part, and further parts while together they have at most half of the vertices.
    in_first = np.zeros(len(size), bool)
    in_first[order[2 * np.cumsum(size[order]) <= size.sum()]] = True
    in_first[order[0]] = True
    return np.asarray(in_first[apart])
