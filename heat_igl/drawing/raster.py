"""Which triangle does each pixel of a parallel projection show? A small depth buffer on numpy.

Matplotlib has no depth buffer, and OpenGL (VTK, pyvista) ends the interpreter on machines without its system libraries,
as most servers are. Projections are parallel, so that barycentric coordinates on the screen are those on the triangle
and a linear function is drawn exactly, not per face or per vertex.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = [
    "default_rotation",
    "isoline_spacing",
    "to_pixels",
    "visible",
    "Pixels",
    "isoline_coverage",
    "rasterize",
    "rotation",
    "screen_gradient",
    "shading",
    "stripe_coverage",
    "visible_runs",
]

# Candidate pixels handled at once: some 200 MB of temporary arrays.
_CHUNK = 2_000_000
# Pixels whose centre is outside by this share of the triangle still count, so that none falls between two neighbours.
_SLACK = 1e-9


class Pixels(NamedTuple):
    """The covered pixels, in no particular order.

    Attributes
    ----------
    place : (p,) int64
        ``row * width + column``.
    face : (p,) int64
        The nearest triangle there.
    weights : (p, 3) float64
        Barycentric coordinates of the pixel's centre in it.
    depth : (height, width) float64
        Depth at each pixel, ``-inf`` where nothing is.
    """

    place: IntArray
    face: IntArray
    weights: FloatArray
    depth: FloatArray


def rotation(azimuth: float, elevation: float) -> FloatArray:
    """Rows of the (3, 3) result: right, up and towards the viewer, who looks at the origin; y is up.

    Parameters
    ----------
    azimuth, elevation : float
        Place of the viewer in degrees: azimuth 0 is on the z axis, 90 on the x axis; elevation 90 is above.
    """
    a, e = np.radians([azimuth, elevation])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    viewer = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
    return np.stack([right, np.cross(viewer, right), viewer])


def default_rotation(V: FloatArray, F: IntArray, used: IntArray, marked: IntArray | None) -> FloatArray:
    """The rotation to look from when the caller does not say."""
    _, size, axes = np.linalg.svd(V[used] - V[used].mean(axis=0), full_matrices=False)
    if size[2] <= 1e-6 * size[0]:
        normal = axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))])
        above = next(axis for axis in np.eye(3)[[1, 2, 0]] if abs(axis @ normal) < 0.8)
        above = above - (above @ normal) * normal
        above /= np.linalg.norm(above)
        return np.stack([np.cross(above, normal), above, normal])
    # Enough triangles to tell how much of the shape a direction shows.
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
    """Column, row (downwards) and depth."""
    return np.asarray(turned * [scale, -scale, scale] + [*centre, 0.0])


def visible(points: FloatArray, depth: FloatArray, vertices: IntArray, tolerance: float) -> BoolArray:
    """Which vertices are not behind something by more than `tolerance` pixels."""
    column, row = np.rint(points[vertices, :2]).astype(np.int64).T
    row, column = np.clip(row, 0, depth.shape[0] - 1), np.clip(column, 0, depth.shape[1] - 1)
    return np.asarray(points[vertices, 2] >= depth[row, column] - tolerance)


def _candidates(low: IntArray, high: IntArray) -> Iterator[tuple[IntArray, IntArray, IntArray]]:
    """The (face, row, column) of every pixel in the box of each face, a chunk of them at a time."""
    size = np.maximum(high - low + 1, 0)
    count = size[:, 0] * size[:, 1]
    faces = np.flatnonzero(count)
    ends = np.cumsum(count[faces])
    start = 0
    while start < len(faces):
        before = int(ends[start - 1]) if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, before + _CHUNK, side="right")))
        chunk = faces[start:stop]
        face = np.repeat(chunk, count[chunk])
        place = np.arange(len(face)) - np.repeat(ends[start:stop] - count[chunk] - before, count[chunk])
        row, column = np.divmod(place, size[face, 0])
        yield face, row + low[face, 1], column + low[face, 0]
        start = stop


def rasterize(points: FloatArray, F: IntArray, width: int, height: int) -> Pixels:
    """Draw triangles with hidden surfaces removed.

    Parameters
    ----------
    points : (n, 3) float64
        Column, row and depth of each vertex; pixel (r, c) has its centre at row r, column c; larger depth is nearer.
    F : (m, 3) int64
        Triangles, in either orientation.
    width, height : int
        Size in pixels; what lies outside is cut off.
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

    depth = np.full(width * height, -np.inf)
    shown = np.full(width * height, -1, np.int64)
    for face, row, column in _candidates(low, high):
        dx, dy = column - x[face, 0], row - y[face, 0]
        b = (dx * e2[face, 1] - dy * e2[face, 0]) * inverse[face]
        c = (dy * e1[face, 0] - dx * e1[face, 1]) * inverse[face]
        inside: BoolArray = (b >= -_SLACK) & (c >= -_SLACK) & (b + c <= 1 + _SLACK)
        face, b, c = face[inside], b[inside], c[inside]
        pixel = row[inside] * width + column[inside]
        here = z[face, 0] + b * (z[face, 1] - z[face, 0]) + c * (z[face, 2] - z[face, 0])
        nearer = here > depth[pixel]
        face, pixel, here = face[nearer], pixel[nearer], here[nearer]
        # In ascending order the last one written per pixel is the nearest.
        order = np.argsort(here, kind="stable")
        depth[pixel[order]] = here[order]
        shown[pixel[order]] = face[order]

    place = np.flatnonzero(shown >= 0)
    face = shown[place]
    row, column = np.divmod(place, width)
    dx, dy = column - x[face, 0], row - y[face, 0]
    b = (dx * e2[face, 1] - dy * e2[face, 0]) * inverse[face]
    c = (dy * e1[face, 0] - dx * e1[face, 1]) * inverse[face]
    weights = np.stack([1 - b - c, b, c], axis=1)
    return Pixels(place, face, weights, depth.reshape(height, width))


def screen_gradient(points: FloatArray, F: IntArray, values: FloatArray) -> FloatArray:
    """Norm (m,) of the change per pixel of a function with `values` (n,) at the vertices; ``inf`` if seen edge on."""
    corners, f = points[F, :2], values[F]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    df1, df2 = f[:, 1] - f[:, 0], f[:, 2] - f[:, 0]
    doubled = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    gx, gy = df1 * e2[:, 1] - df2 * e1[:, 1], df2 * e1[:, 0] - df1 * e2[:, 0]
    result = np.full(len(F), np.inf)
    np.divide(np.hypot(gx, gy), np.abs(doubled), out=result, where=doubled != 0)
    return result


def isoline_coverage(
    values: FloatArray, per_pixel: FloatArray, step: float, width: float, at_zero: bool = False
) -> FloatArray:
    """How much of each pixel (p,) a contour line at a multiple of `step` covers, from 0 to 1.

    Lines are `width` pixels wide on the screen, but no wider than a quarter of their distance, so that a surface that
    turns away does not go black.

    Parameters
    ----------
    values : (p,) float64
        The function at the pixel's centre.
    per_pixel : (p,) float64
        Its change per pixel, from `screen_gradient`.
    step : float
        Distance between levels.
    width : float
        In pixels.
    at_zero : bool
        Whether there is a line at 0; a distance is 0 at its sources, which are marked otherwise.
    """
    level = np.rint(values / step)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.abs(values - level * step) / per_pixel
        width_here = np.minimum(width, 0.25 * step / per_pixel)
    coverage = np.clip(width_here / 2 + 0.5 - apart, 0.0, 1.0) * np.minimum(1.0, width_here)
    coverage[((level == 0) & (not at_zero)) | ~np.isfinite(per_pixel) | (per_pixel == 0)] = 0.0
    return np.asarray(coverage)


def stripe_coverage(values: FloatArray, per_pixel: FloatArray, step: float) -> FloatArray:
    """How much of each pixel (p,) lies in every second stripe of width `step`, from 0 to 1; the first one is not.

    The mean over the values inside the pixel, so that stripes too narrow to be seen become an even tone.

    Parameters
    ----------
    values, per_pixel : (p,) float64
        As for `isoline_coverage`.
    step : float
        Width of a stripe.
    """
    known = np.isfinite(per_pixel)
    level = values / step
    span = np.maximum(np.where(known, per_pixel / step, 0.0), 1e-6)

    def covered_up_to(x: FloatArray) -> FloatArray:
        return np.asarray(np.floor(x / 2) + np.maximum(x % 2 - 1, 0.0))

    share = (covered_up_to(level + span / 2) - covered_up_to(level - span / 2)) / span
    return np.where(known, share, 0.5)


def visible_runs(points: FloatArray, depth: FloatArray, tolerance: float) -> list[tuple[bool, FloatArray]]:
    """A polyline cut into what is seen and what is behind something by more than `tolerance` pixels.

    Parameters
    ----------
    points : (k, 3) float64
        Column, row and depth of its corners.
    depth : (height, width) float64
        Of `rasterize`.
    tolerance : float
        In pixels.

    Returns
    -------
    list of (bool, (j, 3) float64)
        Whether it is seen, and the corners of a piece; pieces are told apart to about two pixels.
    """
    if len(points) < 2:
        return []
    length = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    pieces = np.maximum(np.ceil(length / 2.0), 1).astype(np.int64)
    place = np.concatenate([np.repeat(np.arange(len(pieces)), pieces), [len(pieces) - 1]])
    along = np.concatenate([np.arange(count) / count for count in pieces] + [np.ones(1)])[:, None]
    fine = (1 - along) * points[place] + along * points[place + 1]
    middle = (fine[:-1] + fine[1:]) / 2
    is_seen = visible(middle, depth, np.arange(len(middle)), tolerance)
    cuts = np.flatnonzero(np.diff(is_seen)) + 1
    starts, stops = np.concatenate([[0], cuts]), np.concatenate([cuts, [len(middle)]])
    return [(bool(is_seen[start]), fine[start : stop + 1]) for start, stop in zip(starts, stops, strict=True)]


def shading(points: FloatArray, F: IntArray, pixels: Pixels) -> FloatArray:
    """A mild brightness factor (p,) that lets the shape be read: light from the upper left, in front.

    Normals are turned to the viewer, so that faces may be oriented either way, and smoothed over neighbours except
    across creases.
    """
    a, b, c = (points[F[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    normals *= np.where(normals[:, 2:] < 0, -1.0, 1.0)
    mean = np.stack(
        [np.bincount(F.ravel(), np.repeat(normals[:, axis], 3), minlength=len(points)) for axis in range(3)], axis=1
    )
    for array in (normals, mean):
        array /= np.maximum(np.linalg.norm(array, axis=1, keepdims=True), 1e-300)
    own = normals[:, None, :]
    smooth = mean[F]
    crease = np.einsum("fck,fck->fc", smooth, np.broadcast_to(own, smooth.shape)) < np.cos(np.radians(35.0))
    corners = np.where(crease[:, :, None], own, smooth)
    here = np.einsum("pc,pck->pk", pixels.weights, corners[pixels.face])
    here /= np.maximum(np.linalg.norm(here, axis=1, keepdims=True), 1e-300)
    # Rows run downwards. A face seen face on has factor 1, so that its colour is that of the colour bar.
    light = np.array([-0.53, -0.73, 1.0])
    return np.asarray(0.6 + 0.4 * np.clip(here @ light, 0.0, 1.15) ** 0.8)


def isoline_spacing(largest: float) -> float:
    """A round number (1, 2 or 5 times a power of ten) near a sixteenth of `largest`."""
    if not largest > 0:
        return 1.0
    exponent = np.floor(np.log10(largest / 16))
    candidates = [digit * 10.0 ** (exponent + shift) for shift in (0, 1) for digit in (1, 2, 5)]
    return float(min(candidates, key=lambda step: abs(np.log(largest / 16 / step))))
