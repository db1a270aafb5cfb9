"""Derivatives by the edge lengths of a triangulation, carried back to the faces that it was made from, and forth.

A flip replaces the edge ab of the triangles pab and qba by pq. The line pq crosses ab at a fixed place as far as the
first derivative goes, so in each of the two triangles the derivative of its piece, between places whose barycentric
coordinates differ by delta, by a side l_ik is - delta_i delta_k l_ik over the length of the piece.
"""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic.history import Flipped, Turned
from heat_igl.intrinsic.layout import apex
from heat_igl.intrinsic.place_derivatives import PlaceSlopes, carry_place, carry_place_back
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.typing import FloatArray


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
        m triangles, whose faces were turned and edges flipped, with no vertex added and no face doubled.
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

    """
    visited = [] if places is None else places.visited(triangulation)
    slopes = None if places is None else places.slopes.copy()
    for i in range(len(triangulation.history) - 1, -1, -1):
        change = triangulation.history[i]
        if i >= n_before:
            if isinstance(change, Flipped):
                _unflip(change, by_side)
            elif isinstance(change, Turned):
                by_side[change.turned] = by_side[change.turned, ::-1]
        if slopes is not None:
            carry_place_back(change, *visited[i], slopes, by_side)
    return by_side, slopes


def carry_lengths(
    triangulation: IntrinsicTriangulation, by_side: FloatArray, n_before: int = 0, places: PlaceSlopes | None = None
) -> tuple[FloatArray, FloatArray | None]:
    """How the sides of a triangulation change when those of earlier faces change: `carry_lengths_back`, forth.

    Takes the changes (m', 3) of the sides of the earlier faces, and points with the changes of their coordinates in the
    given faces; returns the changes (m, 3) of the sides, and those (p, 3) of the coordinates in the triangulation.
    """
    by_side = by_side.copy()
    visited = [] if places is None else places.visited(triangulation)
    slopes = None if places is None else places.slopes.copy()
    for i, change in enumerate(triangulation.history):
        if slopes is not None:
            carry_place(change, *visited[i], slopes, by_side)
        if i < n_before:
            continue
        if isinstance(change, Flipped):
            _flip(change, by_side)
        elif isinstance(change, Turned):
            by_side[change.turned] = by_side[change.turned, ::-1]
    return by_side, slopes


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
