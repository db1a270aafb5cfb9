"""Derivatives by the places of points in faces, carried over flips: a place keeps its position on the surface.

A flip replaces the edge ab of the triangles pab and qba by pq. Laid out in the plane with a in the origin and b on the
first axis, p lies above the axis and q below it. A point is P = beta_p p + beta_b b (or with q for p) before the flip,
and P = beta_p p + beta_q q + beta_o o with o = a or b after it. Both depend on the five sides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.history import Covered, Flipped, Merged, Refined, Turned
from heat_igl.intrinsic.layout import apex
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, sides_from
from heat_igl.typing import BoolArray, FloatArray, IntArray


class PlaceSlopes(NamedTuple):
    """Points in faces that were given before any change, and the derivative of a number by their places.

    Attributes
    ----------
    faces, barycentric : (p,) int64, (p, 3) float64
        The points.
    slopes : (p, 3) float64
        By their coordinates, up to a constant in each row; or changes of these coordinates.
    """

    faces: IntArray
    barycentric: FloatArray
    slopes: FloatArray

    def visited(self, triangulation: IntrinsicTriangulation) -> list[tuple[IntArray, FloatArray]]:
        """Faces and coordinates of the points before each change of the triangulation's history."""
        visited = [(self.faces, self.barycentric)]
        for change in triangulation.history:
            visited.append(change.carry(*visited[-1]))
        return visited


def carry_place_back(
    change: Merged | Turned | Covered | Flipped | Refined,
    faces: IntArray,
    barycentric: FloatArray,
    slopes: FloatArray,
    by_side: FloatArray,
) -> None:
    """Carry derivatives by the places of points, which lie in `faces` before a change, back over it, in place."""
    if isinstance(change, Merged):
        slopes[:] = np.take_along_axis(slopes, change.corner[faces], axis=1)
    elif isinstance(change, Turned):
        slopes[:] = np.where(change.turned[faces, None], slopes[:, ::-1], slopes)
    elif isinstance(change, Flipped):
        layout = _Layout(change, faces, barycentric)
        if len(layout.moved):
            layout.carry_back(slopes, by_side.reshape(-1))


def carry_place(
    change: Merged | Turned | Covered | Flipped | Refined,
    faces: IntArray,
    barycentric: FloatArray,
    places: FloatArray,
    by_side: FloatArray,
) -> None:
    """Carry changes (p, 3) of the places of points, which lie in `faces` before a change, over it, in place."""
    if isinstance(change, Merged):
        before = places.copy()
        np.put_along_axis(places, change.corner[faces], before, axis=1)
    elif isinstance(change, Turned):
        places[:] = np.where(change.turned[faces, None], places[:, ::-1], places)
    elif isinstance(change, Flipped):
        layout = _Layout(change, faces, barycentric)
        if len(layout.moved):
            layout.carry(places, by_side.reshape(-1))


class _Layout:
    """The quadrilaterals of the points (k,) that flips move, laid out in the plane.

    Names are those of the module; `in_second` says that a point lies in the triangle of q before the flip, `in_q` that
    it lies in that of b after it.
    """

    def __init__(self, change: Flipped, faces: IntArray, barycentric: FloatArray) -> None:
        self.moved, edge, self.in_second = change.moved(faces)
        if not len(self.moved):
            return
        self.half_edge, self.mate = change.half_edge[edge], change.mate[edge]
        self.ab, self.pa, self.bp, self.aq, self.qb = change.lengths[:, edge]
        self.px, self.py = apex(self.ab, self.pa, self.bp)
        self.qx, self.qy = apex(self.ab, self.aq, self.qb)
        after_faces, after = change.carry(faces, barycentric)
        self.in_q: BoolArray = after_faces[self.moved] == self.mate // 3
        self.before = self._corners(self.in_second)
        self.after = self._corners(self.in_q)
        at_apex, at_tail, at_head = np.take_along_axis(barycentric[self.moved], self.before, axis=1).T
        first, at_o, last = np.take_along_axis(after[self.moved], self.after, axis=1).T
        # How much further P is along p, q and b before than after.
        self.by_p = np.where(self.in_second, 0.0, at_apex) - np.where(self.in_q, last, first)
        self.by_q = np.where(self.in_second, at_apex, 0.0) - np.where(self.in_q, first, last)
        self.by_b = np.where(self.in_second, at_tail, at_head) - np.where(self.in_q, at_o, 0.0)
        self.apex_x = np.where(self.in_second, self.qx, self.px)
        self.apex_y = np.where(self.in_second, -self.qy, self.py)
        self.ox = np.where(self.in_q, self.ab, 0.0)
        self.determinant = (self.px - self.ox) * -self.qy - (self.qx - self.ox) * self.py

    def _corners(self, of_mate: BoolArray) -> IntArray:
        """The corners (k, 3) of a point's triangle, from that opposite the flipped edge on, or at its place."""
        return np.asarray((np.where(of_mate, self.mate, self.half_edge)[:, None] + np.arange(3)) % 3)

    def carry_back(self, slopes: FloatArray, by_half_edge: FloatArray) -> None:
        """Carry derivatives back; those by the sides before the flip are added to `by_half_edge`."""
        of_first, of_o, of_last = np.take_along_axis(slopes[self.moved], self.after, axis=1).T
        of_p, of_q = np.where(self.in_q, of_last, of_first) - of_o, np.where(self.in_q, of_first, of_last) - of_o
        # The derivative by P.
        x = (-self.qy * of_p - self.py * of_q) / self.determinant
        y = ((self.px - self.ox) * of_q - (self.qx - self.ox) * of_p) / self.determinant
        at_p, at_q = (self.px, self.py), (self.qx, self.qy)
        of_ab_p, of_pa, of_bp = _apex_slopes((self.ab, self.pa, self.bp), at_p, self.by_p * x, self.by_p * y)
        of_ab_q, of_aq, of_qb = _apex_slopes((self.ab, self.aq, self.qb), at_q, self.by_q * x, -self.by_q * y)
        of_ab = self.by_b * x + of_ab_p + of_ab_q
        for side, slope in zip(sides_from(self.half_edge), (of_ab, of_bp, of_pa), strict=True):
            np.add.at(by_half_edge, side, slope)
        for side, slope in zip(sides_from(self.mate)[1:], (of_aq, of_qb), strict=True):
            np.add.at(by_half_edge, side, slope)
        of_b, of_a = x * self.ab, np.zeros(len(self.moved))
        ends = np.where(self.in_second, of_b, of_a), np.where(self.in_second, of_a, of_b)
        slopes[self.moved[:, None], self.before] = np.stack([x * self.apex_x + y * self.apex_y, *ends], axis=1)

    def carry(self, places: FloatArray, by_half_edge: FloatArray) -> None:
        """Carry changes of places over the flip, with the changes of the sides before it."""
        of_ab, of_bp, of_pa = (by_half_edge[side] for side in sides_from(self.half_edge))
        _, of_aq, of_qb = (by_half_edge[side] for side in sides_from(self.mate))
        of_px, of_py = _apex_change((self.ab, self.pa, self.bp), (self.px, self.py), (of_ab, of_pa, of_bp))
        of_qx, of_qy = _apex_change((self.ab, self.aq, self.qb), (self.qx, self.qy), (of_ab, of_aq, of_qb))
        of_apex, of_tail, of_head = np.take_along_axis(places[self.moved], self.before, axis=1).T
        of_b = np.where(self.in_second, of_tail, of_head)
        # How P moves against a point that keeps the coordinates after the flip.
        x = of_apex * self.apex_x + of_b * self.ab
        x += self.by_p * of_px + self.by_q * of_qx + self.by_b * of_ab
        y = of_apex * self.apex_y + self.by_p * of_py - self.by_q * of_qy
        at_p = (-self.qy * x - (self.qx - self.ox) * y) / self.determinant
        at_q = ((self.px - self.ox) * y - self.py * x) / self.determinant
        ends = np.where(self.in_q, at_q, at_p), -(at_p + at_q), np.where(self.in_q, at_p, at_q)
        places[self.moved[:, None], self.after] = np.stack(ends, axis=1)


def _apex_slopes(
    sides: tuple[FloatArray, FloatArray, FloatArray],
    place: tuple[FloatArray, FloatArray],
    by_x: FloatArray,
    by_y: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The derivative by base, left and right side of a triangle, from that by the place (x, y) of its `apex`."""
    (base, left, right), (x, y) = sides, place
    by_foot = by_x - by_y * x / y
    return by_foot * (1 - x / base), by_foot * left / base + by_y * left / y, -by_foot * right / base


def _apex_change(
    sides: tuple[FloatArray, FloatArray, FloatArray],
    place: tuple[FloatArray, FloatArray],
    change: tuple[FloatArray, FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """How the place (x, y) of the `apex` of a triangle moves when base, left and right side change."""
    (base, left, right), (x, y), (of_base, of_left, of_right) = sides, place, change
    of_x = (1 - x / base) * of_base + left / base * of_left - right / base * of_right
    return of_x, (left * of_left - x * of_x) / y
