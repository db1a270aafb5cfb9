"""How a triangulation changes with the faces that it was made from: derivatives carried through the history.

To first order, a change maps the lengths of sides, and the barycentric coordinates of points that keep their place on
the surface, linearly. A flip replaces the edge ab of the triangles pab and qba by pq. Laid out in the plane with a in
the origin and b on the first axis, p lies above the axis and q below it.

The line pq crosses ab at a fixed place as far as the first derivative goes, so in each of the two triangles the
derivative of its piece, between places whose barycentric coordinates differ by delta, by a side l_ik is
- delta_i delta_k l_ik over the length of the piece.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.triangulation import Flipped, IntrinsicTriangulation, Merged, Turned, apex, sides_from
from heat_igl.typing import BoolArray, FloatArray, IntArray


class PlaceSlopes(NamedTuple):
    """Points in faces (p,) that were given before any change, and the derivative of a number by their places.

    `slopes` (p, 3) are by their coordinates, up to a constant in each row; or they are changes of these coordinates.
    """

    faces: IntArray
    barycentric: FloatArray
    slopes: FloatArray


def carry_lengths_back(
    triangulation: IntrinsicTriangulation, by_side: FloatArray, places: PlaceSlopes | None = None
) -> tuple[FloatArray, FloatArray | None]:
    """The derivative by the sides of earlier faces, from that by the sides of a triangulation.

    Faces of the triangulation were turned and edges flipped, with no vertex added and no face doubled. Earlier faces
    are those before, but after copies of faces were removed. `by_side` (m, 3) is the derivative by the length opposite
    each corner; an edge of two faces changes both of its sides. `places` are points that count as fixed in the given
    faces, with the derivative by their coordinates in the triangulation: after a flip these depend on the lengths too.

    Returns the derivative (m, 3) by the sides of the earlier faces, and that (p, 3) by the points' coordinates in the
    given faces, None without points.
    """
    vector = _joined(by_side, places)
    for change in reversed(_linear_changes(triangulation, places)):
        change.carry_back(vector)
    return _parted(vector, by_side, places)


def carry_lengths(
    triangulation: IntrinsicTriangulation, by_side: FloatArray, places: PlaceSlopes | None = None
) -> tuple[FloatArray, FloatArray | None]:
    """How the sides of a triangulation change when those of earlier faces change: `carry_lengths_back`, forth.

    Takes the changes (m, 3) of the sides of the earlier faces, and points with the changes of their coordinates in the
    given faces; returns the changes (m, 3) of the sides, and those (p, 3) of the coordinates in the triangulation.
    """
    vector = _joined(by_side, places)
    for change in _linear_changes(triangulation, places):
        change.carry(vector)
    return _parted(vector, by_side, places)


def _joined(by_side: FloatArray, places: PlaceSlopes | None) -> FloatArray:
    return np.concatenate([by_side.ravel(), np.empty(0) if places is None else places.slopes.ravel()])


def _parted(
    vector: FloatArray, by_side: FloatArray, places: PlaceSlopes | None
) -> tuple[FloatArray, FloatArray | None]:
    sides, slopes = np.split(vector, [by_side.size])
    return sides.reshape(-1, 3), None if places is None else slopes.reshape(-1, 3)


class _Linear(NamedTuple):
    """A linear map of vectors that replaces a few entries.

    Entry ``changed[i]`` becomes the sum of `value` times the old entry `column` over all terms with ``row == i``.
    """

    changed: IntArray
    row: IntArray
    column: IntArray
    value: FloatArray

    def carry(self, vector: FloatArray) -> None:
        """Apply the map in place."""
        vector[self.changed] = np.bincount(self.row, self.value * vector[self.column], len(self.changed))

    def carry_back(self, vector: FloatArray) -> None:
        """Apply the transposed map in place."""
        by_new = vector[self.changed]
        vector[self.changed] = 0.0
        np.add.at(vector, self.column, self.value * by_new[self.row])


def _linear_changes(triangulation: IntrinsicTriangulation, places: PlaceSlopes | None) -> list[_Linear]:
    """The changes of the history on the 3 m sides, with the 3 p coordinates of points behind them."""
    size, corners = triangulation.F.size, np.arange(3)
    faces, barycentric = (np.empty(0, np.int64), np.empty((0, 3))) if places is None else places[:2]
    of_point = size + 3 * np.arange(len(faces))[:, None]
    found = []
    for change in triangulation.history:
        if isinstance(change, Merged):
            found.append(_permutation(of_point + change.corner[faces], of_point + corners))
        elif isinstance(change, Turned):
            turned = 3 * np.flatnonzero(change.turned)[:, None], of_point[change.turned[faces]]
            entries = np.concatenate(turned) + corners
            found.append(_permutation(entries, entries[:, ::-1]))
        elif isinstance(change, Flipped):
            sides, points = _flipped_sides(change), _flipped_places(change, faces, barycentric, of_point)
            row = np.concatenate([sides.row, len(sides.changed) + points.row])
            joined = (np.concatenate(pair) for pair in zip(sides, points, strict=True))
            found.append(_Linear(*joined)._replace(row=row))
        faces, barycentric = change.carry(faces, barycentric)
    return found


def _permutation(to: IntArray, of: IntArray) -> _Linear:
    """Entries `to` become the old entries `of`."""
    return _Linear(to.ravel(), np.arange(to.size), of.ravel(), np.ones(to.size))


def _flipped_sides(change: Flipped) -> _Linear:
    """The sides after flips: aq and bp move, and pq is new on both sides; names as in `Flipped`."""
    (ab, bp, pa), (ba, aq, qb) = sides_from(change.half_edge), sides_from(change.mate)
    row = np.arange(4 * len(ab)).reshape(4, -1)
    old = np.stack([ab, pa, bp, aq, qb])
    slopes, ones = _diagonal_slopes(change.lengths), np.ones(len(ab))
    return _Linear(
        np.concatenate([ab, ba, bp, aq]),
        np.concatenate([row[0], row[1], np.tile(row[2], 5), np.tile(row[3], 5)]),
        np.concatenate([aq, bp, old.ravel(), old.ravel()]),
        np.concatenate([ones, ones, slopes.ravel(), slopes.ravel()]),
    )


def _diagonal_slopes(lengths: FloatArray) -> FloatArray:
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


def _flipped_places(change: Flipped, faces: IntArray, barycentric: FloatArray, of_point: IntArray) -> _Linear:
    """The coordinates of the points (p,) that flips move: entries `of_point` (p, 1) and the two that follow.

    A point is P = beta_p p + beta_b b (or with q for p) before the flip, and P = beta_p p + beta_q q + beta_o o with
    o = a or b after it. Both depend on the five sides.
    """
    moved, edge, in_second = change.moved(faces)
    if not len(moved):
        return _permutation(np.empty(0, np.int64), np.empty(0, np.int64))
    half_edge, mate = change.half_edge[edge], change.mate[edge]
    ab, pa, bp, aq, qb = change.lengths[:, edge]
    (px, py), (qx, qy) = apex(ab, pa, bp), apex(ab, aq, qb)
    after_faces, after_places = change.carry(faces, barycentric)
    in_q = after_faces[moved] == mate // 3  # in the triangle of b

    def corners(of_mate: BoolArray) -> IntArray:
        # From the corner opposite the flipped edge on, or at its place.
        return np.asarray((np.where(of_mate, mate, half_edge)[:, None] + np.arange(3)) % 3)

    before, after = corners(in_second), corners(in_q)
    at_apex, at_tail, at_head = np.take_along_axis(barycentric[moved], before, axis=1).T
    first, at_o, last = np.take_along_axis(after_places[moved], after, axis=1).T
    # How much further P is along p, q and b before than after.
    by_p = np.where(in_second, 0.0, at_apex) - np.where(in_q, last, first)
    by_q = np.where(in_second, at_apex, 0.0) - np.where(in_q, first, last)
    by_b = np.where(in_second, at_tail, at_head) - np.where(in_q, at_o, 0.0)
    # How P moves against a point that keeps the coordinates after the flip, by the coordinates before and the sides.
    (of_px, of_py), (of_qx, of_qy) = _apex_slopes(ab, pa, bp, px, py), _apex_slopes(ab, aq, qb, qx, qy)
    zero = np.zeros(len(moved))
    x = np.stack(
        [
            np.where(in_second, qx, px),
            np.where(in_second, ab, 0.0),
            np.where(in_second, 0.0, ab),
            by_p * of_px[0] + by_q * of_qx[0] + by_b,
            *(by_p * of_px[1:]),
            *(by_q * of_qx[1:]),
        ]
    )
    of_ab = by_p * of_py[0] - by_q * of_qy[0]
    y = np.stack([np.where(in_second, -qy, py), zero, zero, of_ab, *(by_p * of_py[1:]), *(-by_q * of_qy[1:])])
    ox = np.where(in_q, ab, 0.0)
    determinant = (px - ox) * -qy - (qx - ox) * py
    to_p, to_q = (-qy * x - (qx - ox) * y) / determinant, ((px - ox) * y - py * x) / determinant
    value = np.stack([np.where(in_q, to_q, to_p), -(to_p + to_q), np.where(in_q, to_p, to_q)])  # (3, 8, k)
    (side_ab, side_bp, side_pa), (_, side_aq, side_qb) = sides_from(half_edge), sides_from(mate)
    column = np.stack([*(of_point[moved] + before).T, side_ab, side_pa, side_bp, side_aq, side_qb])
    row = np.arange(3 * len(moved)).reshape(3, 1, -1)
    changed = (of_point[moved] + after).T
    return _Linear(
        changed.ravel(),
        np.broadcast_to(row, value.shape).ravel(),
        np.broadcast_to(column, value.shape).ravel(),
        value.ravel(),
    )


def _apex_slopes(
    base: FloatArray, left: FloatArray, right: FloatArray, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The derivatives (3, k) of the place (x, y) of the `apex` of triangles by base, left and right side."""
    of_x = np.stack([1 - x / base, left / base, -right / base])
    return of_x, (np.stack([np.zeros_like(left), left, np.zeros_like(left)]) - x * of_x) / y
