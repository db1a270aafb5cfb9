"""Pictures by matplotlib, for notebooks and files: the shaded surface in colours, the colour bar and the legend."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import igl
import numpy as np

from heat_igl.drawing.raster import Pixels, rasterize, to_pixels, visible, visible_runs
from heat_igl.drawing.scene import LINE_INK, STRIPE_INK, UNREACHABLE, Scene, Style
from heat_igl.io import complete_file
from heat_igl.typing import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURE_SUFFIXES = (".png", ".pdf", ".svg")
PAGE_SUFFIXES = (".html", ".htm")
OVERSAMPLING = 2  # along each side of a pixel; 1 has 2.4 times the error of a colour, 3 half of it in twice the time
LINE = 2.2  # width of an isoline in pixels
SOURCE = "#e8000b"
DPI = 400  # resolution of raster output: 1260 pixels for 8 cm
_WIDTH = 3.15  # inches, one column of a journal
_FONT = 7.0  # points
_CURVE = "#ff4fd8"


@dataclass(frozen=True, eq=False)
class Picture:
    """A finished picture, which notebooks display.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
        The figure, which may be changed. pyplot does not manage it.
    """

    figure: Figure

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a PNG, PDF or SVG file, according to the suffix. An existing file is replaced only by a complete one.

        Raises
        ------
        ValueError
            If the suffix is not .png, .pdf or .svg.
        OSError
            If the file cannot be written.
        """
        target = Path(path)
        suffix = target.suffix.lower()
        if suffix not in PICTURE_SUFFIXES:
            raise ValueError(f"{target} must end in one of {', '.join(PICTURE_SUFFIXES)} to be a picture")
        with complete_file(target) as temporary:
            temporary.write_bytes(self._rendered(suffix[1:]))

    def _rendered(self, form: str, dpi: float = DPI) -> bytes:
        import matplotlib

        buffer = io.BytesIO()
        # Without a date and random names, the same input gives the same bytes.
        metadata = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[form]
        with matplotlib.rc_context({"svg.hashsalt": "heat_igl"}):
            self.figure.savefig(buffer, format=form, dpi=dpi, metadata=metadata)
        return buffer.getvalue()

    def _repr_png_(self) -> bytes:
        return self._rendered("png", dpi=DPI / 2)


def lay_out(seen: Scene, lines: list[FloatArray], style: Style, table: Any, label: str, without_value: str) -> Picture:
    """The figure: surface on the left, colour bar on the right, legend below. Lengths are in inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, right, bottom, top = 0.05, 0.72, 0.26, 0.16
    _, extent = seen.box
    across = _WIDTH - left - right
    tall = float(np.clip(across * extent[1] / extent[0], 1.5, 2.6))
    columns, rows = (round(length * DPI) for length in (across, tall))
    scale, centre = fitted(seen, columns, rows, 0.07 * DPI)  # the margin has room for markers at the rim
    points = to_pixels(seen.turned, scale, centre)

    figure = Figure(figsize=(_WIDTH, bottom + tall + top), dpi=DPI / 2, facecolor="white")
    FigureCanvasAgg(figure)
    height = bottom + tall + top
    axes = figure.add_axes((left / _WIDTH, bottom / height, across / _WIDTH, tall / height))
    axes.set_axis_off()
    image, depth = surface_image(points, seen, columns, rows, style, table)
    axes.imshow(image, interpolation="antialiased", aspect="auto")
    for colour, drawn in ((_CURVE, lines), (SOURCE, list(seen.lines @ seen.turn.T))):
        _draw_curves(axes, [to_pixels(line, scale, centre) for line in drawn], depth, colour)
    hidden = mark_dots(axes, to_pixels(seen.dots @ seen.turn.T, scale, centre), depth)
    if not seen.is_categorical:
        bar = figure.add_axes(((left + across + 0.08) / _WIDTH, bottom / height, 0.09 / _WIDTH, tall / height))
        _colour_bar(bar, seen, style, table, label)
    lacking = without_value if bool(np.isinf(seen.values[seen.used]).any()) else None
    _legend(figure, seen, hidden, style, len(lines), lacking, left / _WIDTH)
    return Picture(figure)


def _draw_curves(axes: Any, lines: list[FloatArray], depth: FloatArray, colour: str) -> None:
    """Draw polylines through points in pixels: visible parts are solid, hidden parts dotted."""
    from matplotlib.collections import LineCollection

    runs: dict[bool, list[FloatArray]] = {False: [], True: []}
    for points in lines:
        fine = points * OVERSAMPLING
        fine[:, :2] += (OVERSAMPLING - 1) / 2
        for is_seen, run in visible_runs(fine, depth, 0.01 * max(depth.shape)):
            runs[is_seen].append((run[:, :2] - (OVERSAMPLING - 1) / 2) / OVERSAMPLING)
    for is_seen, ink, width in ((False, colour, 0.6), (True, "white", 1.9), (True, colour, 1.1)):
        if not runs[is_seen]:
            continue
        style = "solid" if is_seen else (0, (0.8, 1.6))
        axes.add_collection(
            LineCollection(runs[is_seen], colors=ink, linewidths=width, linestyles=style, capstyle="round", zorder=2.5),
            autolim=False,
        )


def _colour_bar(axes: Any, seen: Scene, style: Style, table: Any, label: str) -> None:
    (low, high), step = seen.limits, seen.step
    axes.imshow(np.linspace(0, 1, 512)[:, None], cmap=table, origin="lower", extent=(0, 1, low, high), vmin=0, vmax=1)
    axes.set_aspect("auto")
    axes.set_ylim(low, high)
    levels = step * np.arange(np.floor(low / step) + 1, np.ceil(high / step))
    if style == "lines":
        axes.hlines(
            levels if low < 0 else levels[levels > 0], 0, 1, colors=(0, 0, 0, LINE_INK), linewidth=LINE / DPI * 72
        )
    elif style == "stripes":
        for level in levels[np.rint(levels / step) % 2 == 1]:
            axes.axhspan(level, min(level + step, high), color=(1, 1, 1, STRIPE_INK), linewidth=0)
    axes.set_xticks([])
    axes.yaxis.tick_right()
    axes.yaxis.set_label_position("right")
    every = step * next((k for k in (1, 2, 4, 5, 10, 20, 50, 100, 200) if (high - low) / (k * step) <= 6), 500)
    ticks = every * np.arange(np.ceil(low / every * (1 - 1e-12)), np.floor(high / every * (1 + 1e-12)) + 1)
    if len(ticks) > 2:  # lines may be so far apart that fewer would not tell the scale
        axes.set_yticks(ticks)
    else:
        axes.locator_params(axis="y", nbins=6)
    axes.tick_params(labelsize=_FONT, length=2, width=0.4, pad=1.5)
    axes.yaxis.get_offset_text().set(fontsize=_FONT, horizontalalignment="left", x=1.0)
    axes.set_ylabel(label, fontsize=_FONT, labelpad=3)
    for spine in axes.spines.values():
        spine.set_linewidth(0.4)


def _legend(
    figure: Figure, seen: Scene, hidden: BoolArray, style: Style, n_curves: int, lacking: str | None, left: float
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def dot(fill: str, edge: str, text: str) -> Line2D:
        return Line2D(
            [], [], linestyle="", marker="o", markersize=4, markerfacecolor=fill, markeredgecolor=edge,
            markeredgewidth=0.6, label=text,
        )  # fmt: skip

    handles: list[Any] = []
    if not hidden.all():
        handles.append(dot(SOURCE, "white", "source" if (~hidden).sum() == 1 else "sources"))
    if hidden.any():
        handles.append(dot("none", SOURCE, "source behind" if hidden.sum() == 1 else "sources behind"))
    if len(seen.lines):
        handles.append(Line2D([], [], color=SOURCE, linewidth=1.1, label="source curve"))
    if n_curves:
        handles.append(Line2D([], [], color=_CURVE, linewidth=1.1, label="curve" if n_curves == 1 else "curves"))
    if style == "lines":
        handles.append(Line2D([], [], color="0.35", linewidth=0.7, label=f"every {seen.step:g}"))
    elif style == "stripes":
        handles.append(Patch(facecolor="0.75", label=f"stripes of {seen.step:g}"))
    if lacking is not None:
        handles.append(Patch(facecolor=UNREACHABLE, label=lacking))
    if not handles:
        return
    figure.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(left, 0.0), ncols=len(handles), fontsize=_FONT,
        frameon=False, handlelength=1.2, handletextpad=0.4, columnspacing=1.0, borderaxespad=0.2,
    )  # fmt: skip


def fitted(seen: Scene, columns: int, rows: int, margin: float) -> tuple[float, FloatArray]:
    """Scale and centre for `heat_igl.drawing.raster.to_pixels`, such that the surface fills the image."""
    middle, extent = seen.box
    scale = float(min((columns - 2 * margin) / extent[0], (rows - 2 * margin) / extent[1]))
    return scale, np.array([columns - 1, rows - 1]) / 2 - middle * scale * [1, -1]


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
    slope = np.hypot(*(igl.grad(fine[:, :2], F) @ finite).reshape(2, -1))
    per_pixel = np.nan_to_num(slope, nan=np.inf, posinf=np.inf)[pixels.face]
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
    is_seen = visible(fine, depth, 0.01 * max(depth.shape))
    size = 16.0 if len(dots) <= 20 else 4.0
    for chosen, fill in ((is_seen, SOURCE), (~is_seen, "none")):
        x, y = dots[chosen, :2].T
        axes.scatter(x, y, s=size, c=fill, edgecolors="white" if fill != "none" else SOURCE, linewidths=0.6, zorder=3)
    return ~is_seen


def isoline_coverage(
    values: FloatArray, per_pixel: FloatArray, step: float, width: float, at_zero: bool = False
) -> FloatArray:
    """Fraction (p,) of each pixel that is covered by a contour line at a multiple of `step`.

    `values` (p,) are those at the pixel centres, and `per_pixel` (p,) their change per pixel, the norm of the gradient
    on the screen of the linear function on the face that is seen; ``inf`` for faces seen edge on.
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
