"""Pictures by matplotlib, for notebooks and files, and their layout: surface, colour bar and legend."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.drawing.raster import to_pixels, visible_runs
from heat_igl.drawing.scene import LINE_INK, STRIPE_INK, UNREACHABLE, Scene, Style
from heat_igl.drawing.surface_image import LINE, OVERSAMPLING, SOURCE, fitted, mark_dots, surface_image
from heat_igl.io import complete_file
from heat_igl.typing import BoolArray, FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURE_SUFFIXES = (".png", ".pdf", ".svg")
PAGE_SUFFIXES = (".html", ".htm")
DPI = 400  # resolution of raster output: 1260 pixels for 8 cm


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


_WIDTH = 3.15  # inches, one column of a journal

_FONT = 7.0  # points

_CURVE = "#ff4fd8"


def lay_out(seen: Scene, lines: list[FloatArray], style: Style, table: Any, label: str, without_value: str) -> Picture:
    """The figure: surface on the left, colour bar on the right, legend below. Lengths are in inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, right, bottom, top = 0.05, 0.72, 0.26, 0.16
    turned = seen.turned
    low, high = turned[seen.used, :2].min(axis=0), turned[seen.used, :2].max(axis=0)
    extent = np.maximum(high - low, 1e-3 * (high - low).max())
    across = _WIDTH - left - right
    tall = float(np.clip(across * extent[1] / extent[0], 1.5, 2.6))
    columns, rows = (round(length * DPI) for length in (across, tall))
    scale, centre = fitted(seen, columns, rows, 0.07 * DPI)  # the margin has room for markers at the rim
    points = to_pixels(turned, scale, centre)

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
