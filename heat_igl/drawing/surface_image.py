"""The shaded image of a scene in colours, with isolines or stripes, and the dots of the sources."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.drawing.raster import Pixels, rasterize, visible
from heat_igl.drawing.scene import LINE_INK, STRIPE_INK, UNREACHABLE, Scene, Style
from heat_igl.typing import BoolArray, FloatArray, IntArray

OVERSAMPLING = 2
LINE = 2.2  # width of an isoline in pixels
SOURCE = "#e8000b"


def fitted(seen: Scene, columns: int, rows: int, margin: float) -> tuple[float, FloatArray]:
    """Scale and centre for `heat_igl.drawing.raster.to_pixels`, such that the surface fills the image."""
    turned = seen.turned[seen.used, :2]
    low, high = turned.min(axis=0), turned.max(axis=0)
    extent = np.maximum(high - low, 1e-3 * (high - low).max())
    scale = float(min((columns - 2 * margin) / extent[0], (rows - 2 * margin) / extent[1]))
    return scale, np.array([columns - 1, rows - 1]) / 2 - (low + high) / 2 * scale * [1, -1]


def surface_image(
    points: FloatArray, seen: Scene, columns: int, rows: int, style: Style, table: Any
) -> tuple[FloatArray, FloatArray]:
    """The image (rows, columns, 4) of the surface, and the depth buffer at `OVERSAMPLING` times the resolution."""
    F, values = seen.F, seen.values
    fine = points * OVERSAMPLING
    fine[:, :2] += (OVERSAMPLING - 1) / 2  # integers are the centres of pixels, not corners
    pixels = rasterize(fine, F, columns * OVERSAMPLING, rows * OVERSAMPLING)
    reached: BoolArray = np.asarray(np.isfinite(values[F]).all(axis=1))
    finite = np.where(np.isfinite(values), values, 0.0)
    if seen.is_categorical:
        corner = np.argmax(pixels.weights, axis=1)
        if seen.borders is not None:
            between = np.flatnonzero((np.ptp(finite[F], axis=1) > 0)[pixels.face])
            cost = np.einsum("pj,pkj->pk", pixels.weights[between], seen.borders[pixels.face[between]])
            corner[between] = np.argmin(cost, axis=1)
        here = finite[F[pixels.face, corner]]
    else:
        here = np.einsum("pk,pk->p", pixels.weights, finite[F[pixels.face]])
    known: BoolArray = reached[pixels.face]

    low, high = seen.limits
    colour = table((here - low) / (high - low))[:, :3]
    per_pixel = screen_gradient(fine, F, finite)[pixels.face]
    if style == "lines":
        line = isoline_coverage(here, per_pixel, seen.step, LINE * OVERSAMPLING, at_zero=low < 0)
        colour *= 1 - LINE_INK * line[:, None]
    elif style == "stripes":
        colour += STRIPE_INK * stripe_coverage(here, per_pixel, seen.step)[:, None] * (1 - colour)
    colour[~known] = UNREACHABLE
    colour *= shading(fine, F, pixels)[:, None]

    image = np.zeros((rows * columns * OVERSAMPLING**2, 4))
    image[pixels.place] = np.concatenate([colour, np.ones((len(colour), 1))], axis=1)
    blocks = image.reshape(rows, OVERSAMPLING, columns, OVERSAMPLING, 4)
    covered = blocks[..., 3].mean(axis=(1, 3))
    mixed = blocks[..., :3].mean(axis=(1, 3)) / np.maximum(covered, 1e-9)[..., None]
    return np.concatenate([np.clip(mixed, 0, 1), covered[..., None]], axis=2), pixels.depth


def mark_dots(axes: Any, dots: FloatArray, depth: FloatArray) -> BoolArray:
    """Draw a dot at each source, or a ring if it is behind the surface; return the mask (k,) of hidden sources."""
    if not len(dots):
        return np.zeros(0, bool)
    fine = dots * OVERSAMPLING
    is_seen = visible(fine, depth, np.arange(len(dots)), 0.01 * max(depth.shape))
    size = 16.0 if len(dots) <= 20 else 4.0
    for chosen, fill in ((is_seen, SOURCE), (~is_seen, "none")):
        x, y = dots[chosen, :2].T
        axes.scatter(x, y, s=size, c=fill, edgecolors="white" if fill != "none" else SOURCE, linewidths=0.6, zorder=3)
    return ~is_seen


def screen_gradient(points: FloatArray, F: IntArray, values: FloatArray) -> FloatArray:
    """Norm (m,) of the gradient per pixel of the linear function with `values` (n,); ``inf`` for faces seen edge on."""
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
    """Fraction (p,) of each pixel that is covered by a contour line at a multiple of `step`.

    `values` (p,) are those at the pixel centres, and `per_pixel` (p,) their change per pixel, from `screen_gradient`.
    Lines are `width` pixels wide on the screen, but at most a quarter of the distance between lines; otherwise a
    surface that is seen at a grazing angle would become black. Distances need no line `at_zero`: their sources have
    dots.
    """
    level = np.rint(values / step)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.abs(values - level * step) / per_pixel
        width_here = np.minimum(width, 0.25 * step / per_pixel)
    coverage = np.clip(width_here / 2 + 0.5 - apart, 0.0, 1.0) * np.minimum(1.0, width_here)
    coverage[((level == 0) & (not at_zero)) | ~np.isfinite(per_pixel) | (per_pixel == 0)] = 0.0
    return np.asarray(coverage)


def stripe_coverage(values: FloatArray, per_pixel: FloatArray, step: float) -> FloatArray:
    """Fraction (p,) of each pixel in the odd stripes [step, 2 step), [3 step, 4 step), ..., as for `isoline_coverage`.

    The fraction is the mean over the values inside the pixel. Stripes narrower than a pixel blend to an even tone.
    """
    known = np.isfinite(per_pixel)
    level = values / step
    span = np.maximum(np.where(known, per_pixel / step, 0.0), 1e-6)

    def covered_up_to(x: FloatArray) -> FloatArray:
        return np.asarray(np.floor(x / 2) + np.maximum(x % 2 - 1, 0.0))

    share = (covered_up_to(level + span / 2) - covered_up_to(level - span / 2)) / span
    return np.where(known, share, 0.5)


def shading(points: FloatArray, F: IntArray, pixels: Pixels) -> FloatArray:
    """Brightness factor (p,) of each pixel for a light in front, at the upper left.

    Normals point towards the viewer for either orientation of the faces. They are smoothed over adjacent faces except
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
    # Rows run downwards. A face at right angles to the view has factor 1, the colour of the colour bar.
    light = np.array([-0.53, -0.73, 1.0])
    return np.asarray(0.6 + 0.4 * np.clip(here @ light, 0.0, 1.15) ** 0.8)
