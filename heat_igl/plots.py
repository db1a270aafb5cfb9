"""Static pictures of a distance on a mesh, without a display or OpenGL.

matplotlib lays out the figure; `heat_igl.raster` draws the surface, since matplotlib cannot hide what is behind and VTK
needs OpenGL system libraries that slim machines lack. Needs the extra ``view``.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.errors import MissingExtraError
from heat_igl.mesh import Mesh
from heat_igl.picture import DPI, Picture
from heat_igl.raster import (
    default_rotation,
    isoline_coverage,
    isoline_spacing,
    rasterize,
    rotation,
    screen_gradient,
    shading,
    to_pixels,
    visible,
)
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Picture", "picture", "plot"]

_OVERSAMPLING = 2
_WIDTH = 3.15  # inches, one column of a journal
_FONT = 7.0  # points
_LINE = 0.0055  # width of an isoline in inches
_UNREACHABLE = (0.72, 0.72, 0.72)
_LINE_DARKNESS = 0.42
_UNIT = "distance, in the mesh's unit"
_PERMUTATION = {"x": [1, 0, 2], "y": [0, 1, 2], "z": [1, 2, 0]}


def plot(
    mesh: Mesh,
    distance: ArrayLike,
    *,
    sources: Sources | None = None,
    spacing: float | None = None,
    view: tuple[float, float] | None = None,
    up: str = "y",
    colormap: str = "viridis_r",
    label: str = _UNIT,
) -> Picture:
    """Draw a distance on a mesh: colours, isolines, and where it starts.

    Parameters
    ----------
    mesh : Mesh
        Triangles, or tetrahedra, whose surface is drawn.
    distance : (n,) array_like
        As a solver returns it; ``inf`` is drawn grey.
    sources : int, sequence of int, or (n,) mask of bool, optional
        Vertices to mark.
    spacing : float, optional
        Distance between isolines; a round number near a sixteenth of the largest distance by default.
    view : (azimuth, elevation), optional
        Where the viewer is, in degrees; see `heat_igl.raster.rotation`. By default a flat mesh is seen face on, and
        another from the one of eight directions that shows the most of it and of its sources.
    up : {"x", "y", "z"}
        The coordinate that points upwards.
    colormap : str
        A perceptually uniform colour map of matplotlib.
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
    MissingExtraError
        If matplotlib is not installed.
    """
    values = _checked(mesh, distance)
    marked = None if sources is None else vertex_sources(sources, mesh.n_vertices)
    if up not in _PERMUTATION:
        raise ValueError(f"up must be 'x', 'y' or 'z', not {up!r}")
    largest = float(values[np.isfinite(values)].max())
    step = isoline_spacing(largest) if spacing is None else float(spacing)
    if not (np.isfinite(step) and step > 0) or largest / step > 1000:
        raise ValueError(f"spacing must be a positive number, and no less than {largest / 1000:.2g}, not {spacing!r}")
    _require_matplotlib()

    F = mesh.facets.vertices[mesh.facets.n_faces == 1] if mesh.is_tetrahedral else mesh.F
    used = np.unique(F)
    V = mesh.V - (mesh.V[used].min(axis=0) + mesh.V[used].max(axis=0)) / 2
    V = (V / np.abs(V[used]).max())[:, _PERMUTATION[up]]
    turn = default_rotation(V, F, used, marked) if view is None else rotation(*view)
    return _laid_out(V @ turn.T, F, used, values, marked, step, colormap, label)


def picture(path: str | os.PathLike[str], mesh: Mesh, distance: ArrayLike, **options: Any) -> None:
    """Draw `distance` and write it to `path`; options of `plot`, suffixes and errors of `Picture.save` too."""
    plot(mesh, distance, **options).save(path)


def _checked(mesh: Mesh, distance: ArrayLike) -> FloatArray:
    values = np.asarray(distance, dtype=np.float64)
    if values.shape != (mesh.n_vertices,):
        raise ValueError(f"distance must have shape ({mesh.n_vertices},), one per vertex, but it has {values.shape}")
    if np.isnan(values).any():
        raise ValueError(f"distance[{int(np.flatnonzero(np.isnan(values))[0])}] is NaN: there is nothing to draw")
    if not np.isfinite(values).any():
        raise ValueError("distance is infinite everywhere: there is nothing to draw")
    return values


def _require_matplotlib() -> None:
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingExtraError.of("a picture", "matplotlib", "view") from None


def _laid_out(
    turned: FloatArray,
    F: IntArray,
    used: IntArray,
    values: FloatArray,
    marked: IntArray | None,
    step: float,
    colormap: str,
    label: str,
) -> Picture:
    """The figure: surface on the left, colour bar on the right, legend below. Lengths are inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    left, right, bottom, top = 0.05, 0.72, 0.26, 0.16
    low, high = turned[used, :2].min(axis=0), turned[used, :2].max(axis=0)
    extent = np.maximum(high - low, 1e-3 * (high - low).max())
    across = _WIDTH - left - right
    tall = float(np.clip(across * extent[1] / extent[0], 1.5, 2.6))
    columns, rows = (round(length * DPI) for length in (across, tall))
    margin = 0.07 * DPI  # for markers at the rim
    scale = float(min((columns - 2 * margin) / extent[0], (rows - 2 * margin) / extent[1]))
    centre = np.array([columns - 1, rows - 1]) / 2 - (low + high) / 2 * scale * [1, -1]
    points = to_pixels(turned, scale, centre)

    figure = Figure(figsize=(_WIDTH, bottom + tall + top), dpi=DPI / 2, facecolor="white")
    FigureCanvasAgg(figure)
    height = bottom + tall + top
    axes = figure.add_axes((left / _WIDTH, bottom / height, across / _WIDTH, tall / height))
    axes.set_axis_off()
    image, depth = _surface(points, F, values, columns, rows, step, colormap)
    axes.imshow(image, interpolation="antialiased", aspect="auto")
    hidden = _mark(axes, points, depth, marked)
    bar = figure.add_axes(((left + across + 0.08) / _WIDTH, bottom / height, 0.09 / _WIDTH, tall / height))
    _colour_bar(bar, values, step, colormap, label)
    _legend(figure, marked, hidden, step, bool(np.isinf(values[used]).any()), left / _WIDTH)
    return Picture(figure)


def _surface(
    points: FloatArray, F: IntArray, values: FloatArray, columns: int, rows: int, step: float, colormap: str
) -> tuple[FloatArray, FloatArray]:
    """The image (rows, columns, 4) of the surface, and its depth on the finer grid that it was drawn on."""
    fine = points * _OVERSAMPLING
    fine[:, :2] += (_OVERSAMPLING - 1) / 2  # centres of pixels, not corners, are at whole numbers
    pixels = rasterize(fine, F, columns * _OVERSAMPLING, rows * _OVERSAMPLING)
    reached: BoolArray = np.asarray(np.isfinite(values[F]).all(axis=1))
    finite = np.where(np.isfinite(values), values, 0.0)
    here = np.einsum("pk,pk->p", pixels.weights, finite[F[pixels.face]])
    known: BoolArray = reached[pixels.face]

    colour = _colours(colormap)(here / _top_of_scale(values))[:, :3]
    per_pixel = screen_gradient(fine, F, finite)[pixels.face]
    line = isoline_coverage(here, per_pixel, step, _LINE * DPI * _OVERSAMPLING)
    colour *= 1 - (1 - _LINE_DARKNESS) * line[:, None]
    colour[~known] = _UNREACHABLE
    colour *= shading(fine, F, pixels)[:, None]

    image = np.zeros((rows * columns * _OVERSAMPLING**2, 4))
    image[pixels.place] = np.concatenate([colour, np.ones((len(colour), 1))], axis=1)
    blocks = image.reshape(rows, _OVERSAMPLING, columns, _OVERSAMPLING, 4)
    covered = blocks[..., 3].mean(axis=(1, 3))
    mixed = blocks[..., :3].mean(axis=(1, 3)) / np.maximum(covered, 1e-9)[..., None]
    return np.concatenate([np.clip(mixed, 0, 1), covered[..., None]], axis=2), pixels.depth


def _colours(colormap: str) -> Any:
    """The map without its darkest end, on which no line would be seen."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    try:
        whole = matplotlib.colormaps[colormap]
    except KeyError:
        raise ValueError(f"colormap must be one of matplotlib's, such as 'viridis_r', not {colormap!r}") from None
    table = whole(np.linspace(0, 1, 512))
    return ListedColormap(table[table[:, :3] @ [0.2126, 0.7152, 0.0722] > 0.2])


def _mark(axes: Any, points: FloatArray, depth: FloatArray, marked: IntArray | None) -> BoolArray:
    """Dots at the sources, rings at those behind the surface; returns which are."""
    if marked is None:
        return np.zeros(0, bool)
    fine = points * _OVERSAMPLING
    seen = visible(fine, depth, marked, 0.01 * max(depth.shape))
    size = 16.0 if len(marked) <= 20 else 4.0
    for chosen, fill in ((seen, "#e8000b"), (~seen, "none")):
        x, y = points[marked[chosen], :2].T
        axes.scatter(
            x, y, s=size, c=fill, edgecolors="white" if fill != "none" else "#e8000b", linewidths=0.6, zorder=3
        )
    return ~seen


def _colour_bar(axes: Any, values: FloatArray, step: float, colormap: str, label: str) -> None:
    top = _top_of_scale(values)
    axes.imshow(np.linspace(0, 1, 512)[:, None], cmap=_colours(colormap), origin="lower", extent=(0, 1, 0, top))
    axes.set_aspect("auto")
    levels = step * np.arange(1, int(np.ceil(top / step)))
    axes.hlines(levels, 0, 1, colors=(0, 0, 0, 1 - _LINE_DARKNESS), linewidth=_LINE * 72)
    axes.set_xticks([])
    axes.yaxis.tick_right()
    axes.yaxis.set_label_position("right")
    every = next((k for k in (1, 2, 4, 5, 10, 20, 50, 100, 200) if top / (k * step) <= 6), 500)
    axes.set_yticks(step * every * np.arange(int(top / (step * every) * (1 + 1e-12)) + 1))
    axes.tick_params(labelsize=_FONT, length=2, width=0.4, pad=1.5)
    axes.yaxis.get_offset_text().set(fontsize=_FONT, horizontalalignment="left", x=1.0)
    axes.set_ylabel(label, fontsize=_FONT, labelpad=3)
    for spine in axes.spines.values():
        spine.set_linewidth(0.4)


def _legend(
    figure: Figure, marked: IntArray | None, hidden: BoolArray, step: float, unreachable: bool, left: float
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def dot(fill: str, edge: str, text: str) -> Line2D:
        return Line2D(
            [],
            [],
            linestyle="",
            marker="o",
            markersize=4,
            markerfacecolor=fill,
            markeredgecolor=edge,
            markeredgewidth=0.6,
            label=text,
        )

    handles: list[Any] = []
    if marked is not None and not hidden.all():
        handles.append(dot("#e8000b", "white", "source" if (~hidden).sum() == 1 else "sources"))
    if hidden.any():
        handles.append(dot("none", "#e8000b", "source behind" if hidden.sum() == 1 else "sources behind"))
    handles.append(Line2D([], [], color="0.35", linewidth=0.7, label=f"every {step:g}"))
    if unreachable:
        handles.append(Patch(facecolor=_UNREACHABLE, label="unreachable"))
    figure.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(left, 0.0),
        ncols=len(handles),
        fontsize=_FONT,
        frameon=False,
        handlelength=1.2,
        handletextpad=0.4,
        columnspacing=1.0,
        borderaxespad=0.2,
    )


def _top_of_scale(values: FloatArray) -> float:
    return float(values[np.isfinite(values)].max()) or 1.0
