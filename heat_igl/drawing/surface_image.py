"""The shaded image of a scene in colours, with isolines or stripes, and the dots of the sources."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.drawing.raster import rasterize, visible
from heat_igl.drawing.scene import LINE_INK, STRIPE_INK, UNREACHABLE, Scene, Style
from heat_igl.drawing.shading import isoline_coverage, screen_gradient, shading, stripe_coverage
from heat_igl.typing import BoolArray, FloatArray

OVERSAMPLING = 2
LINE = 2.2  # width of an isoline in pixels
SOURCE = "#e8000b"


def fitted(seen: Scene, columns: int, rows: int, margin: float) -> tuple[float, FloatArray]:
    """Scale and centre for `heat_igl.drawing.camera.to_pixels`, such that the surface fills the image."""
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
            between = np.flatnonzero((np.ptp(values[F], axis=1) > 0)[pixels.face])
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
