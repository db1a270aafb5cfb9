"""Triangles known by their edge lengths, laid out in the plane: positions of the corners, and the angles there."""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.typing import FloatArray


def apex(base: FloatArray, left: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corner (x, y), y >= 0, opposite the bases of triangles that run from the origin along the positive first axis.

    `base`, `left` and `right` (k,) are the lengths of the bases, and of the sides at the origin and at the other end.
    The height y comes from the area by Kahan's form of Heron's formula: ``sqrt(left^2 - x^2)`` loses the digits of
    slivers.
    """
    x = (base + (left - right) * ((left + right) / base)) / 2
    height = igl.doublearea(np.stack([base, left, right], axis=1), 0.0) / base
    return x, np.asarray(height)


def lay_out(l: FloatArray) -> FloatArray:
    """Corners (k, 3, 2) of triangles with edge lengths `l` (k, 3): corner 0 at the origin, corner 1 at (l[:, 2], 0)."""
    x, y = apex(l[:, 2], l[:, 1], l[:, 0])
    corners = np.zeros((len(l), 3, 2))
    corners[:, 1, 0], corners[:, 2, 0], corners[:, 2, 1] = l[:, 2], x, y
    return corners


def corner_angles(l: FloatArray) -> FloatArray:
    """Angle (k, 3) at each corner of triangles with edge lengths `l` (k, 3), opposite the corners.

    From half the angle, ``tan^2 = (s - b)(s - c) / (s (s - a))`` with s half the perimeter. The error is that of a
    change of the lengths by some 1e-16 of the longest; the arccosine of the cosine rule loses half the digits of a
    small angle.
    """
    beside = np.roll(l, -1, axis=1), np.roll(l, 1, axis=1)
    half = l.sum(axis=1, keepdims=True) / 2
    opposite = np.maximum((half - beside[0]) * (half - beside[1]), 0.0)
    return np.asarray(2 * np.arctan2(np.sqrt(opposite), np.sqrt(np.maximum(half * (half - l), 0.0))))
