"""The view direction, the parallel projection to pixels, and hidden surface removal by a depth buffer in numpy.

matplotlib has no depth buffer, and OpenGL (VTK, pyvista) ends the interpreter on machines without the OpenGL system
libraries, such as most servers. In a parallel projection the barycentric coordinates on the screen equal those on the
triangle, so a piecewise linear function is drawn exactly at every pixel.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from heat_igl.mesh.connectivity import enumerate_runs
from heat_igl.typing import BoolArray, FloatArray, IntArray


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
        seen = 1.0 if marked is None else float(visible(points[marked], depth, 2.0).mean())
        score = float(np.isfinite(depth).mean()) * (0.3 + seen)
        if score > best_score * 1.001:
            best, best_score = turn, score
    return best


def to_pixels(turned: FloatArray, scale: float, centre: FloatArray) -> FloatArray:
    """Column, row (downwards) and depth (n, 3) of points in viewer coordinates (n, 3)."""
    return np.asarray(turned * [scale, -scale, scale] + [*centre, 0.0])


# Candidate pixels per chunk, which bounds temporary arrays to about 200 MB.
_CHUNK = 2_000_000

# Tolerance on barycentric coordinates, so that no pixel centre falls between two adjacent triangles.
_SLACK = 1e-9


class Pixels(NamedTuple):
    """The covered pixels, in arbitrary order.

    `place` (p,) is ``row * width + column``, `face` (p,) the triangle that is visible there, and `weights` (p, 3) the
    barycentric coordinates of the pixel's centre in it. `depth` (height, width) is ``-inf`` at uncovered pixels.
    """

    place: IntArray
    face: IntArray
    weights: FloatArray
    depth: FloatArray


def rasterize(points: FloatArray, F: IntArray, width: int, height: int) -> Pixels:
    """Rasterize triangles with hidden surface removal.

    `points` (n, 3) are column, row and depth of each vertex. The centre of pixel (r, c) is at row r and column c; a
    larger depth is nearer to the viewer. Triangles may have either orientation, and are clipped to the image.
    """
    corners = points[F]
    x, y, z = (corners[:, :, axis] for axis in range(3))
    e1, e2 = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
    doubled = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    edge_on = doubled == 0
    inverse = 1.0 / np.where(edge_on, 1.0, doubled)
    limit = np.array([width - 1, height - 1])
    low = np.maximum(np.ceil(np.stack([x.min(1), y.min(1)], 1)), 0).astype(np.int64)
    high = np.minimum(np.floor(np.stack([x.max(1), y.max(1)], 1)), limit).astype(np.int64)
    high[edge_on] = low[edge_on] - 1

    def weights(face: IntArray, row: IntArray, column: IntArray) -> tuple[FloatArray, FloatArray]:
        """Barycentric coordinates of pixels for the second and the third corner of their faces."""
        dx, dy = column - x[face, 0], row - y[face, 0]
        b = (dx * e2[face, 1] - dy * e2[face, 0]) * inverse[face]
        return b, (dy * e1[face, 0] - dx * e1[face, 1]) * inverse[face]

    depth = np.full(width * height, -np.inf)
    shown = np.full(width * height, -1, np.int64)
    for face, row, column in _candidates(low, high):
        b, c = weights(face, row, column)
        inside: BoolArray = (b >= -_SLACK) & (c >= -_SLACK) & (b + c <= 1 + _SLACK)
        face, b, c = face[inside], b[inside], c[inside]
        pixel = row[inside] * width + column[inside]
        here = z[face, 0] + b * (z[face, 1] - z[face, 0]) + c * (z[face, 2] - z[face, 0])
        nearer = here > depth[pixel]
        face, pixel, here = face[nearer], pixel[nearer], here[nearer]
        # In ascending order of depth the last value written to a pixel is the nearest.
        order = np.argsort(here, kind="stable")
        depth[pixel[order]] = here[order]
        shown[pixel[order]] = face[order]

    place = np.flatnonzero(shown >= 0)
    face = shown[place]
    row, column = np.divmod(place, width)
    b, c = weights(face, row, column)
    return Pixels(place, face, np.stack([1 - b - c, b, c], axis=1), depth.reshape(height, width))


def _candidates(low: IntArray, high: IntArray) -> Iterator[tuple[IntArray, IntArray, IntArray]]:
    """Yield chunks of (face, row, column) for every pixel in the bounding box of each face."""
    size = np.maximum(high - low + 1, 0)
    count = size[:, 0] * size[:, 1]
    faces = np.flatnonzero(count)
    ends = np.cumsum(count[faces])
    start = 0
    while start < len(faces):
        before = int(ends[start - 1]) if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, before + _CHUNK, side="right")))
        chunk = faces[start:stop]
        which, place = enumerate_runs(count[chunk])
        face = chunk[which]
        row, column = np.divmod(place, size[face, 0])
        yield face, row + low[face, 1], column + low[face, 0]
        start = stop


def visible(points: FloatArray, depth: FloatArray, tolerance: float) -> BoolArray:
    """Mask of the points that are at most `tolerance` pixels behind the visible surface."""
    column, row = np.rint(points[:, :2]).astype(np.int64).T
    row, column = np.clip(row, 0, depth.shape[0] - 1), np.clip(column, 0, depth.shape[1] - 1)
    return np.asarray(points[:, 2] >= depth[row, column] - tolerance)


def visible_runs(points: FloatArray, depth: FloatArray, tolerance: float) -> list[tuple[bool, FloatArray]]:
    """Split a polyline, column, row and depth of its vertices (k, 3), into visible and hidden pieces.

    A point is hidden if it is behind the depth buffer by more than `tolerance` pixels. Of each piece: whether it is
    visible, and the vertices (j, 3). The ends of pieces are accurate to about two pixels.
    """
    length = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    pieces = np.maximum(np.ceil(length / 2.0), 1).astype(np.int64)
    place = np.concatenate([np.repeat(np.arange(len(pieces)), pieces), [len(pieces) - 1]])
    along = np.concatenate([np.arange(count) / count for count in pieces] + [np.ones(1)])[:, None]
    fine = (1 - along) * points[place] + along * points[place + 1]
    middle = (fine[:-1] + fine[1:]) / 2
    is_seen = visible(middle, depth, tolerance)
    cuts = np.flatnonzero(np.diff(is_seen)) + 1
    runs = np.split(np.arange(len(middle)), cuts)
    return [(bool(is_seen[run[0]]), fine[run[0] : run[-1] + 2]) for run in runs]
