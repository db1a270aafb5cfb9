"""The view direction, and the parallel projection to pixels."""

from __future__ import annotations

import numpy as np

from heat_igl.drawing.raster import rasterize, visible
from heat_igl.typing import FloatArray, IntArray


def rotation(azimuth: float, elevation: float) -> FloatArray:
    """Rotation to viewer coordinates, (3, 3): the rows point right, up and towards the viewer.

    The viewer looks at the origin, and the y axis points upwards. In degrees, azimuth 0 is the z axis, azimuth 90 the x
    axis; elevation 90 is above.
    """
    a, e = np.radians([azimuth, elevation])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    viewer = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
    return np.stack([right, np.cross(viewer, right), viewer])


def default_rotation(V: FloatArray, F: IntArray, used: IntArray, marked: IntArray | None) -> FloatArray:
    """The rotation (3, 3) for a picture without a given view.

    A flat mesh is viewed along the normal. Otherwise the best of eight directions is chosen, by the covered area and
    the share of the vertices `marked` that are visible.
    """
    _, size, axes = np.linalg.svd(V[used] - V[used].mean(axis=0), full_matrices=False)
    if size[2] <= 1e-6 * size[0]:
        normal = axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))])
        above = next(axis for axis in np.eye(3)[[1, 2, 0]] if abs(axis @ normal) < 0.8)
        above = above - (above @ normal) * normal
        above /= np.linalg.norm(above)
        return np.stack([np.cross(above, normal), above, normal])
    # A sample of the triangles suffices to estimate the covered area.
    sample = F[:: 1 + len(F) // 50_000]
    best, best_score = rotation(45.0, 20.0), -1.0
    for azimuth in np.arange(-45.0, 315.0, 45.0):
        turn = rotation(float(azimuth), 20.0)
        points = to_pixels(V @ turn.T, 96 / 2 / np.sqrt(3), np.array([47.5, 47.5]))
        depth = rasterize(points, sample, 96, 96).depth
        seen = 1.0 if marked is None else float(visible(points, depth, marked, 2.0).mean())
        score = float(np.isfinite(depth).mean()) * (0.3 + seen)
        if score > best_score * 1.001:
            best, best_score = turn, score
    return best


def to_pixels(turned: FloatArray, scale: float, centre: FloatArray) -> FloatArray:
    """Column, row (downwards) and depth (n, 3) of points in viewer coordinates (n, 3)."""
    return np.asarray(turned * [scale, -scale, scale] + [*centre, 0.0])
