"""Derivatives of what the heat method takes of a triangle, by the lengths of the sides: weights, area and masses."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.operators.matrices import Operators
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["ElementSlopes", "Elements"]


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
        self._inner = square.sum(axis=1)[:, None] - 2 * square
        self.weight = self.share**2 * self._inner / (8 * self.area)[:, None]
        #: Corners (m, 3) with an obtuse angle.
        self._is_obtuse = self._inner < 0
        self._has_obtuse = self._is_obtuse.any(axis=1)

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

    def mass(self) -> FloatArray:
        """Area (m, 3) of the Voronoi cell of each corner; of an obtuse triangle one half and twice a quarter."""
        parts = self.weight * self.l**2 / 4
        cells = parts.sum(axis=1)[:, None] - parts
        obtuse = self._has_obtuse
        cells[obtuse] = self.area[obtuse, None] * np.where(self._is_obtuse[obtuse], 0.5, 0.25)
        return np.asarray(cells)


class ElementSlopes:
    """Sums the derivative of a number by the weights, areas, masses and sides of triangles, all zero at first.

    Attributes
    ----------
    by_weight, by_mass, by_side : (m, 3) float64
        By `Elements.weight`, `Elements.mass` and the lengths themselves.
    by_area : (m,) float64
        By `Elements.area`.
    """

    def __init__(self, elements: Elements) -> None:
        self._elements = elements
        self.by_weight, self.by_mass, self.by_side = (np.zeros_like(elements.l) for _ in range(3))
        self.by_area = np.zeros(len(elements.l))

    def total(self) -> FloatArray:
        """The derivative (m, 3) by the lengths of the sides."""
        e = self._elements
        by_area, obtuse = self.by_area.copy(), e._has_obtuse
        by_area[obtuse] += (self.by_mass[obtuse] * np.where(e._is_obtuse[obtuse], 0.5, 0.25)).sum(axis=1)
        # The cell of a corner has a part for both sides there: for all but the opposite one.
        by_part = _sum(self.by_mass)[:, None] - self.by_mass
        by_part[obtuse] = 0
        by_weight = self.by_weight + by_part * e.l**2 / 4
        by_side = self.by_side + by_part * e.weight * e.l / 2
        # The weight is inner / (8 area), and the area changes by l times the weight.
        by_area -= np.einsum("fc,fc->f", by_weight, e.weight) / e.area
        by_inner = e.share**2 * by_weight / (8 * e.area)[:, None]
        by_side += 2 * e.l * (_sum(by_inner)[:, None] - 2 * by_inner)
        by_side += by_area[:, None] * e.l * e.weight
        return np.asarray(by_side)


def _sum(rows: FloatArray) -> FloatArray:
    """Sums of rows of three; by columns, which takes a third of the time."""
    return np.asarray(rows[:, 0] + rows[:, 1] + rows[:, 2])
