"""Derivatives of the weights and areas of triangles by the lengths of their sides."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from heat_igl.kernels.heat import heat_tangent as kernels
from heat_igl.operators.matrices import Operators
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["ElementChange", "Elements"]


class ElementChange(NamedTuple):
    """How weights (m, 3), areas (m,) and the masses (n,) of vertices change."""

    weight: FloatArray
    area: FloatArray
    mass: FloatArray


class Elements:
    """Half the cotangents and areas of the triangles of a domain, as L and M count them.

    A cover of a surface counts each triangle one half.

    Parameters
    ----------
    domain : Operators
        With a surface of m triangles.

    Attributes
    ----------
    l : (m, 3) float64
        Lengths of the sides.
    i, j : (m, 3) int64
        Vertices at the ends of the sides.
    weight : (m, 3) float64
        Half the cotangent opposite each side: the entry of L at the ends of an edge is the sum over its sides.
    area : (m,) float64
        Area of each triangle.
    share : float
        One half on a cover, 1 otherwise.
    """

    def __init__(self, domain: Operators) -> None:
        if domain.surface is None:
            raise ValueError("derivatives need a surface of triangles")
        triangulation = domain.surface.triangulation
        self._triangulation, self._n = triangulation, domain.n
        self.l, F = triangulation.l, triangulation.F
        self.i, self.j = F[:, [1, 2, 0]], F[:, [2, 0, 1]]
        self.share = 0.5 if triangulation.is_cover else 1.0
        self.area = self.share * triangulation.areas
        square = self.l**2
        inner = square.sum(axis=1)[:, None] - 2 * square
        self.weight = self.share**2 * inner / (8 * self.area)[:, None]

    @cached_property
    def edges(self) -> IntArray:
        """One side (k,) of each edge."""
        return self._triangulation.edges

    @cached_property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """For each side (3 m,) the number of the pair of vertices at its ends; the shortest side of each pair."""
        i, j = self.i.ravel(), self.j.ravel()
        key = np.minimum(i, j) * self._n + np.maximum(i, j)
        order = np.lexsort((self.l.ravel(), key))
        is_first: BoolArray = np.ones(len(key), bool)
        is_first[1:] = key[order][1:] != key[order][:-1]
        pair = np.empty(len(key), np.int64)
        pair[order] = np.cumsum(is_first) - 1
        return pair, order[is_first]

    def push_forward(self, by_side: FloatArray) -> ElementChange:
        """What sides that change by `by_side` (m, 3) change."""
        weight, area, mass = np.empty_like(self.l), np.empty_like(self.area), np.zeros(self._n)
        F = self._triangulation.F
        kernels.elements(F, self.l, by_side, self.weight, self.area, self.share, weight, area, mass)
        return ElementChange(weight, area, mass)
