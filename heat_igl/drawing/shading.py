"""Contour lines, stripes and shading of rasterized surfaces."""

from __future__ import annotations

import numpy as np

from heat_igl.drawing.raster import Pixels
from heat_igl.typing import FloatArray, IntArray


def colour_numbers(labels: IntArray, edges: IntArray, n_colours: int) -> IntArray:
    """A colour (n,) for the label (n,) of each vertex: the first that none of its earlier neighbours has."""
    names, rank = np.unique(labels, return_inverse=True)
    pairs = np.unique(np.sort(rank[edges], axis=1), axis=0)
    colour = np.full(len(names), -1)
    earlier: list[list[int]] = [[] for _ in names]
    for low, high in pairs[pairs[:, 0] != pairs[:, 1]].tolist():
        earlier[high].append(low)
    for label, neighbours in enumerate(earlier):
        taken = {int(colour[other]) for other in neighbours}
        free = (number for number in range(n_colours) if number not in taken)
        colour[label] = next(free, label % n_colours)
    return np.asarray(colour[rank])


def isoline_spacing(largest: float) -> float:
    """A round number (1, 2 or 5 times a power of ten) near a sixteenth of `largest`."""
    if not largest > 0:
        return 1.0
    exponent = np.floor(np.log10(largest / 16))
    candidates = [digit * 10.0 ** (exponent + shift) for shift in (0, 1) for digit in (1, 2, 5)]
    return float(min(candidates, key=lambda step: abs(np.log(largest / 16 / step))))


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
