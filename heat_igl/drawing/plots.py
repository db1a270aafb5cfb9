"""Pictures of a distance, or of another field, on a mesh: static ones without a display or OpenGL, and pages to turn.

matplotlib lays out the figure; `heat_igl.drawing` draws the surface, since matplotlib cannot hide what is behind and
VTK needs OpenGL system libraries that slim machines lack. Needs the extra ``view``.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.drawing.html_view import Page, page
from heat_igl.drawing.output import DPI, Picture
from heat_igl.drawing.raster import to_pixels, visible_runs
from heat_igl.drawing.scene import (
    DISTANCE_LABEL,
    LINE_INK,
    STRIPE_INK,
    UNREACHABLE,
    Scene,
    Style,
    check_style,
    colours,
    scene,
)
from heat_igl.drawing.surface_image import LINE, OVERSAMPLING, SOURCE, fitted, mark_dots, surface_image
from heat_igl.mesh import Mesh, SurfaceCurve
from heat_igl.sources import Sources
from heat_igl.typing import ArrayLike, BoolArray, FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Page", "Picture", "page", "picture", "plot", "plot_field", "write_html"]

_WIDTH = 3.15  # inches, one column of a journal
_FONT = 7.0  # points
_CURVE = "#ff4fd8"


def plot(
    mesh: Mesh,
    distance: ArrayLike,
    *,
    sources: Sources | None = None,
    spacing: float | None = None,
    style: Style = "lines",
    curves: Sequence[SurfaceCurve] = (),
    view: tuple[float, float] | None = None,
    up: str = "y",
    colormap: str = "viridis_r",
    label: str = DISTANCE_LABEL,
) -> Picture:
    """Draw a distance on a mesh: colours, isolines, and where it starts.

    Parameters
    ----------
    mesh : Mesh
        Triangles, or tetrahedra, whose surface is drawn.
    distance : (n,) array_like
        As a solver returns it; ``inf`` is drawn grey.
    sources : optional
        To mark: whatever ``solver.distance`` takes, vertices, points in faces and curves.
    spacing : float, optional
        Distance between isolines; a round number near a sixteenth of the largest distance by default.
    style : {"lines", "stripes", "plain"}
        Isolines; light and full stripes in turn, each `spacing` wide, which show kinks and ripples best; or colours
        alone.
    curves : sequence of SurfaceCurve
        Drawn on the surface; thin and dotted where they are behind it.
    view : (azimuth, elevation), optional
        Where the viewer is, in degrees; see `heat_igl.drawing.raster.rotation`. By default a flat mesh is seen face on,
        and another from the one of eight directions that shows the most of it and of its sources.
    up : {"x", "y", "z"}
        The coordinate that points upwards.
    colormap : str
        A colour map of matplotlib; the default is perceptually uniform.
    label : str
        Title of the colour bar.

    Returns
    -------
    Picture
        Shown by notebooks; `Picture.save` writes it.

    Raises
    ------
    ValueError
        If `distance` is not one number per vertex, holds NaN or nothing finite, or an option has no meaning.
    SourceError
        If `sources` does not name vertices, or a curve does not lie on the mesh.
    MissingExtraError
        If matplotlib is not installed.
    """
    check_style(style)
    seen = scene(mesh, distance, sources=sources, spacing=spacing, view=view, up=up)
    return _laid_out(seen, _lines_in_space(mesh, curves, seen), style, colours(colormap), label, "unreachable")


def plot_field(
    mesh: Mesh,
    values: ArrayLike,
    *,
    label: str,
    limits: tuple[float, float] | None = None,
    spacing: float | None = None,
    sources: Sources | None = None,
    curves: Sequence[SurfaceCurve] = (),
    view: tuple[float, float] | None = None,
    up: str = "y",
    colormap: str | None = None,
) -> Picture:
    """Draw any number per vertex, such as heat or an error, by colours, with isolines if asked for.

    Parameters
    ----------
    values : (n,) array_like
        ``inf`` is drawn grey.
    label : str
        Title of the colour bar.
    limits : (low, high), optional
        Values at the ends of the colour bar; what lies beyond takes the colour of the end. By default from the smallest
        value, or 0 if that is less, to the largest; where there are values of both signs, as far on either side of 0.
    spacing : float, optional
        Distance between isolines; none by default.
    colormap : str, optional
        A colour map of matplotlib; by default "RdBu_r", whose middle is white, for limits on both sides of 0, and the
        perceptually uniform "magma_r" for others.
    mesh, sources, curves, view, up
        As for `plot`.

    Returns
    -------
    Picture
        Shown by notebooks; `Picture.save` writes it.

    Raises
    ------
    ValueError, SourceError, MissingExtraError
        As for `plot`.
    """
    if limits is None:
        limits = _limits(values)
    has_signs = limits is not None and limits[0] < 0 < limits[1]
    table = colours(colormap or ("RdBu_r" if has_signs else "magma_r"), is_trimmed=not has_signs)
    seen = scene(
        mesh, values, name="values", sources=sources, spacing=spacing, limits=limits, view=view, up=up
    )  # fmt: skip
    style: Style = "plain" if spacing is None else "lines"
    return _laid_out(seen, _lines_in_space(mesh, curves, seen), style, table, label, "no value")


def picture(path: str | os.PathLike[str], mesh: Mesh, distance: ArrayLike, **options: Any) -> None:
    """Draw `distance` and write it to `path`; options of `plot`, suffixes and errors of `Picture.save` too."""
    plot(mesh, distance, **options).save(path)


def write_html(path: str | os.PathLike[str], mesh: Mesh, distance: ArrayLike, **options: Any) -> None:
    """Write an interactive page to `path`; options of `page`, errors of `Page.save` too."""
    page(mesh, distance, **options).save(path)


def _limits(values: ArrayLike) -> tuple[float, float] | None:
    """Symmetric limits for values of both signs; None leaves it to `scene`, which also says what is wrong."""
    finite = np.asarray(values, dtype=np.float64)
    finite = finite[np.isfinite(finite)]
    if not len(finite) or not finite.min() < 0 < finite.max():
        return None
    reach = float(np.abs(finite).max())
    return -reach, reach


def _lines_in_space(mesh: Mesh, curves: Sequence[SurfaceCurve], seen: Scene) -> list[FloatArray]:
    """The corners of each curve, in the viewer's coordinates."""
    return [(curve.positions(mesh) - seen.centre) / seen.unit @ seen.turn.T for curve in curves]


def _laid_out(
    seen: Scene, lines: list[FloatArray], style: Style, table: Any, label: str, without_value: str
) -> Picture:
    """The figure: surface on the left, colour bar on the right, legend below. Lengths are inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, right, bottom, top = 0.05, 0.72, 0.26, 0.16
    turned = seen.turned
    low, high = turned[seen.used, :2].min(axis=0), turned[seen.used, :2].max(axis=0)
    extent = np.maximum(high - low, 1e-3 * (high - low).max())
    across = _WIDTH - left - right
    tall = float(np.clip(across * extent[1] / extent[0], 1.5, 2.6))
    columns, rows = (round(length * DPI) for length in (across, tall))
    scale, centre = fitted(seen, columns, rows, 0.07 * DPI)  # a margin for markers at the rim
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
    bar = figure.add_axes(((left + across + 0.08) / _WIDTH, bottom / height, 0.09 / _WIDTH, tall / height))
    _colour_bar(bar, seen, style, table, label)
    lacking = without_value if bool(np.isinf(seen.values[seen.used]).any()) else None
    _legend(figure, seen, hidden, style, len(lines), lacking, left / _WIDTH)
    return Picture(figure)


def _draw_curves(axes: Any, lines: list[FloatArray], depth: FloatArray, colour: str) -> None:
    """Lines through points given in pixels: full where they are seen, dotted where they are behind the surface."""
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
    axes.set_yticks(every * np.arange(np.ceil(low / every * (1 - 1e-12)), np.floor(high / every * (1 + 1e-12)) + 1))
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
