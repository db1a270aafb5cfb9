"""Quadrilaterals that were given as tetrahedra: both are arrays (m, 4)."""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.typing import FloatArray, IntArray

# Elements whose neighbours are looked at.
_SAMPLE = 32
# Volume over that of a regular tetrahedron with the same longest edge. A square that is folded along its diagonal, by
# any angle, has at most 0.354, the corner of a cube 0.5.
_THIN = 0.4
# The same for elements that are planar but for rounding.
_FLAT = 1e-10


def first_quadrilateral(V: FloatArray, F: IntArray) -> int | None:
    """The first of the elements (m, 4) that look like quadrilaterals with their corners in order; None if they do not.

    Neighbours in a mesh of tetrahedra have three vertices in common. Quadrilaterals have two in common, which follow
    one another in both, and are thin as tetrahedra. Elements without neighbours are quadrilaterals if all are planar.
    Linear time: the neighbours of some elements are looked up, evenly spaced.
    """
    chosen = np.unique(np.linspace(0, len(F) - 1, _SAMPLE).astype(np.int64))
    thickness = _thickness(V, F[chosen])
    if (thickness <= _FLAT).all() and (_thickness(V, F) <= _FLAT).all():
        return 0
    if np.median(thickness) >= _THIN:
        return None
    is_near = np.zeros(len(V), bool)
    is_near[F[chosen]] = True
    near = np.flatnonzero(is_near[F].any(axis=1))
    n_beside = n_stacked = 0
    first = None
    for e in chosen.tolist():
        shared = np.isin(F[near], F[e])
        count = shared.sum(axis=1)
        count[near == e] = 0
        n_stacked += bool((count >= 3).any())
        beside = near[count == 2]
        if len(beside) and _follow_one_another(F, e, beside):
            n_beside += 1
            first = e if first is None else first
        elif len(beside):
            return None
    # A few quadrilaterals may share two sides, or lie there twice.
    return first if n_beside > 4 * n_stacked else None


def _thickness(V: FloatArray, F: IntArray) -> FloatArray:
    longest = igl.edge_lengths(V, F).max(axis=1)
    regular = longest**3 / np.sqrt(72)
    return np.asarray(np.abs(igl.volume(V, F)) / np.where(regular > 0, regular, 1))


def _follow_one_another(F: IntArray, e: int, others: IntArray) -> bool:
    """Whether the two vertices that element `e` shares with each of the others follow one another in both."""
    for g in others.tolist():
        here, there = np.flatnonzero(np.isin(F[e], F[g])), np.flatnonzero(np.isin(F[g], F[e]))
        if np.diff(here)[0] == 2 or np.diff(there)[0] == 2:
            return False
    return True
