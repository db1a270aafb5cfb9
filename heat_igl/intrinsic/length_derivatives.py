"""Derivatives by the edge lengths of a triangulation, carried back to the faces that it was made from, and forth.

A flip replaces the edge ab of the triangles pab and qba by pq. The line pq crosses ab at a fixed place as far as the
first derivative goes, so in each of the two triangles the derivative of its piece, between places whose barycentric
coordinates differ by delta, by a side l_ik is - delta_i delta_k l_ik over the length of the piece.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.history import BACK_CORNERS, Covered, Flipped, Merged, Refined, Turned
from heat_igl.intrinsic.layout import apex
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.typing import FloatArray, IntArray

__all__ = ["carry_lengths", "PlaceSlopes", "carry_lengths_back", "check_carried"]


class PlaceSlopes(NamedTuple):
    """Points in faces that were given before any change, and the derivative of a number by their places.

    Attributes
    ----------
    faces, barycentric : (p,) int64, (p, 3) float64
        The points.
    slopes : (p, 3) float64
        By their coordinates, up to a constant in each row.
    """

    faces: IntArray
    barycentric: FloatArray
    slopes: FloatArray


def carry_lengths_back(
    triangulation: IntrinsicTriangulation,
    by_side: FloatArray,
    n_before: int = 0,
    places: PlaceSlopes | None = None,
) -> tuple[FloatArray, FloatArray | None]:
    """The derivative by the sides of earlier faces, from that by the sides of a triangulation.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        m triangles.
    by_side : (m, 3) float64
        Derivative by the length opposite each corner; an edge of two faces changes both of its sides. Overwritten.
    n_before : int
        How many changes of the history the earlier faces have behind them.
    places : PlaceSlopes, optional
        Points that count as fixed in the given faces, with the derivative by their coordinates in the triangulation:
        after a flip these depend on the lengths too.

    Returns
    -------
    by_side : (m', 3) float64
        The same for the earlier faces.
    by_place : (p, 3) float64 or None
        The derivative by the points' coordinates in the given faces.

    Raises
    ------
    ValueError
        If vertices were added.
    """
    check_carried(triangulation)
    visited = [] if places is None else _visited(triangulation, places)
    slopes = None if places is None else places.slopes.copy()
    for i in range(len(triangulation.history) - 1, -1, -1):
        change = triangulation.history[i]
        if i >= n_before:
            if isinstance(change, Flipped):
                _unflip(change, by_side)
            elif isinstance(change, Turned):
                by_side[change.turned] = by_side[change.turned, ::-1]
            elif isinstance(change, Covered):
                m = change.n_faces
                by_side = by_side[:m] + by_side[m:, BACK_CORNERS]
        if slopes is not None:
            _carry_place_back(change, *visited[i], slopes, by_side)
    return by_side, slopes


def _visited(triangulation: IntrinsicTriangulation, places: PlaceSlopes) -> list[tuple[IntArray, FloatArray]]:
    """Faces and coordinates of points before each change."""
    visited = [(places.faces, places.barycentric)]
    for change in triangulation.history:
        visited.append(change.carry(*visited[-1]))
    return visited


def _carry_place_back(
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
        _unflip_places(change, faces, barycentric, slopes, by_side)


def _unflip_places(
    change: Flipped, faces: IntArray, barycentric: FloatArray, slopes: FloatArray, by_side: FloatArray
) -> None:
    """The same over flips: a point keeps its place P in the quadrilateral of a, b, p and q laid out in the plane.

    After the flip P = beta_p p + beta_q q + beta_o o with o = a or b. The derivative by P is called `pull`.
    """
    moved, edge, in_second = change.moved(faces)
    if not len(moved):
        return
    ab, pa, bp, aq, qb = change.lengths[:, edge]
    (px, py), (qx, qy) = apex(ab, pa, bp), apex(ab, aq, qb)
    after_faces, after = change.carry(faces, barycentric)
    in_q = after_faces[moved] == change.mate[edge] // 3
    corner = (np.where(in_q, change.mate[edge], change.half_edge[edge])[:, None] + np.arange(3)) % 3
    first, at_o, last = np.take_along_axis(after[moved], corner, axis=1).T
    of_first, of_o, of_last = np.take_along_axis(slopes[moved], corner, axis=1).T
    at_p, at_q = np.where(in_q, last, first), np.where(in_q, first, last)
    of_p, of_q = np.where(in_q, of_last, of_first) - of_o, np.where(in_q, of_first, of_last) - of_o
    ox = np.where(in_q, ab, 0.0)
    determinant = (px - ox) * -qy - (qx - ox) * py
    pull_x = (-qy * of_p - py * of_q) / determinant
    pull_y = ((px - ox) * of_q - (qx - ox) * of_p) / determinant
    corner = (np.where(in_second, change.mate[edge], change.half_edge[edge])[:, None] + np.arange(3)) % 3
    at_apex, at_tail, at_head = np.take_along_axis(barycentric[moved], corner, axis=1).T
    at_b = np.where(in_second, at_tail, at_head)
    by_p = np.where(in_second, 0.0, at_apex) - at_p
    by_q = np.where(in_second, at_apex, 0.0) - at_q
    of_ab = (at_b - np.where(in_q, at_o, 0.0)) * pull_x
    of_ab_p, of_pa, of_bp = _apex_slopes((ab, pa, bp), (px, py), by_p * pull_x, by_p * pull_y)
    of_ab_q, of_aq, of_qb = _apex_slopes((ab, aq, qb), (qx, qy), by_q * pull_x, -by_q * pull_y)
    by_half_edge = by_side.reshape(-1)
    half_edge, mate = change.half_edge[edge], change.mate[edge]
    following, preceding = 1 - 3 * (half_edge % 3 == 2), -1 + 3 * (half_edge % 3 == 0)
    np.add.at(by_half_edge, half_edge, of_ab + of_ab_p + of_ab_q)
    np.add.at(by_half_edge, half_edge + following, of_bp)
    np.add.at(by_half_edge, half_edge + preceding, of_pa)
    following, preceding = 1 - 3 * (mate % 3 == 2), -1 + 3 * (mate % 3 == 0)
    np.add.at(by_half_edge, mate + following, of_aq)
    np.add.at(by_half_edge, mate + preceding, of_qb)
    apex_x, apex_y = np.where(in_second, qx, px), np.where(in_second, -qy, py)
    of_b, of_a = pull_x * ab, np.zeros(len(moved))
    before = np.stack(
        [pull_x * apex_x + pull_y * apex_y, np.where(in_second, of_b, of_a), np.where(in_second, of_a, of_b)], axis=1
    )
    slopes[moved[:, None], corner] = before


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


def carry_lengths(triangulation: IntrinsicTriangulation, by_side: FloatArray, n_before: int = 0) -> FloatArray:
    """How the sides (m, 3) of a triangulation change when those of earlier faces change by `by_side` (m', 3)."""
    by_side = by_side.copy()
    for change in triangulation.history[n_before:]:
        if isinstance(change, Flipped):
            _flip(change, by_side)
        elif isinstance(change, Turned):
            by_side[change.turned] = by_side[change.turned, ::-1]
        elif isinstance(change, Covered):
            by_side = np.concatenate([by_side, by_side[:, BACK_CORNERS]])
    return by_side


def check_carried(triangulation: IntrinsicTriangulation) -> None:
    """Raise a ValueError if vertices were added, whose places change with the lengths."""
    if any(isinstance(change, Refined) for change in triangulation.history):
        raise ValueError(
            "the triangulation that is solved on has more vertices than the mesh, and no derivative is carried through "
            "them: take laplacian='intrinsic-delaunay', or refine='unfold'"
        )


def _slopes(lengths: FloatArray) -> FloatArray:
    """Derivative (5, k) of the new edges pq by the lengths (5, k) of ab, pa, bp, aq and qb."""
    ab, pa, bp, aq, qb = lengths
    (px, py), (qx, qy) = apex(ab, pa, bp), apex(ab, aq, qb)
    length = np.hypot(px - qx, py + qy)
    # The line crosses ab at this share of it from a; p is over ab in this share of the line.
    above = py / (py + qy)
    share = (px + (qx - px) * above) / ab
    p_piece, q_piece = above * length, (1 - above) * length
    with np.errstate(divide="ignore", invalid="ignore"):
        of_p = np.stack([-share * (1 - share) * ab, (1 - share) * pa, share * bp]) / p_piece
        of_q = np.stack([-share * (1 - share) * ab, (1 - share) * aq, share * qb]) / q_piece
    # A corner on ab: no piece lies on that side, and no side of it counts.
    of_p[:, p_piece == 0] = 0.0
    of_q[:, q_piece == 0] = 0.0
    return np.stack([of_p[0] + of_q[0], of_p[1], of_p[2], of_q[1], of_q[2]])


def _unflip(change: Flipped, by_side: FloatArray) -> None:
    """Carry derivatives back over flips, in place."""
    f, c = np.divmod(change.half_edge, 3)
    g, e = np.divmod(change.mate, 3)
    c1, c2, e1, e2 = (c + 1) % 3, (c + 2) % 3, (e + 1) % 3, (e + 2) % 3
    ab, pa, bp, aq, qb = _slopes(change.lengths) * (by_side[f, c1] + by_side[g, e1])
    of_aq, of_bp = by_side[f, c], by_side[g, e]
    by_side[f, c1], by_side[g, e1] = of_bp + bp, of_aq + aq
    by_side[f, c2] += pa
    by_side[g, e2] += qb
    by_side[f, c], by_side[g, e] = ab, 0.0


def _flip(change: Flipped, by_side: FloatArray) -> None:
    """Carry changes of lengths over flips, in place."""
    f, c = np.divmod(change.half_edge, 3)
    g, e = np.divmod(change.mate, 3)
    c1, c2, e1, e2 = (c + 1) % 3, (c + 2) % 3, (e + 1) % 3, (e + 2) % 3
    sides = np.stack([by_side[f, c], by_side[f, c2], by_side[f, c1], by_side[g, e1], by_side[g, e2]])
    pq = (_slopes(change.lengths) * sides).sum(axis=0)
    by_side[f, c], by_side[g, e] = sides[3], sides[2]
    by_side[f, c1] = by_side[g, e1] = pq
