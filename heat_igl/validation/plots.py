"""The figure of a validation report: error per vertex on the surface, and error against distance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.drawing.camera import to_pixels
from heat_igl.drawing.scene import Scene, colours, scene
from heat_igl.drawing.surface_image import fitted, mark_dots, surface_image
from heat_igl.errors import MissingExtraError
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray
from heat_igl.validation.metrics import relative_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Errors from 0.001 % to 10 %, the range in which methods differ. All panels share it, so that they can be compared.
_LOWEST, _HIGHEST = 1e-5, 1e-1
_ACROSS, _ROW_INCHES = 3, 3.2
_COLUMNS, _LARGEST_ROWS = 560, 450  # of the picture of the surface


def error_figure(title: str, mesh: Mesh, truth: FloatArray, distances: Mapping[str, FloatArray]) -> Figure:
    """A figure with two panels for each method: its error on the surface, and below that against distance.

    `truth` (n,) is what each of the `distances` (n,) is compared with. The surface is seen as `heat_igl.plots.plot`
    shows it. A MissingExtraError without matplotlib.
    """
    try:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LogNorm
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtraError.of("a figure", "matplotlib", "view") from None
    across = min(_ACROSS, len(distances))
    down = -(-len(distances) // across)
    figure = Figure(figsize=(0.6 + 2.8 * across, _ROW_INCHES * down + 0.4), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(2 * down, across, squeeze=False)
    surfaces, scatters = axes[::2].ravel(), axes[1::2].ravel()
    for empty in (*surfaces[len(distances) :], *scatters[len(distances) :]):
        empty.set_axis_off()
    norm = LogNorm(_LOWEST, _HIGHEST)
    reachable = np.isfinite(truth) & (truth > 0)
    limits = float(np.log10(_LOWEST)), float(np.log10(_HIGHEST))
    seen = scene(mesh, np.zeros(mesh.n_vertices), sources=np.flatnonzero(truth == 0), limits=limits)
    table = colours("viridis", is_trimmed=False)
    for (surface, scatter), (method, distance) in zip(
        zip(surfaces, scatters, strict=True), distances.items(), strict=False
    ):
        error = np.nan_to_num(relative_error(distance, truth), nan=_HIGHEST)
        # A source has no relative error; it is drawn as if it had the smallest. Unreachable vertices have no colour.
        shown = np.where(reachable, np.clip(error, _LOWEST, _HIGHEST), np.where(truth == 0, _LOWEST, np.inf))
        _paint(surface, replace(seen, values=np.log10(shown)), table)
        surface.set_title(method, fontsize=10)
        size = float(np.clip(60 / np.sqrt(reachable.sum()), 0.3, 3))
        errors = np.maximum(error[reachable], _LOWEST)
        scatter.plot(truth[reachable], errors, "o", ms=size, mew=0, color="tab:blue", rasterized=True)
        scatter.set(yscale="log", ylim=(_LOWEST / 2, 1), xlim=(0, truth[reachable].max()))
        scatter.grid(visible=True, alpha=0.3)
    figure.colorbar(ScalarMappable(norm, table), ax=axes, extend="both", label="relative error", shrink=0.5)
    for row in axes[1::2]:
        row[0].set_ylabel("relative error")
    for scatter in axes[-1]:
        scatter.set_xlabel("distance")
    return figure


def _paint(axes: Any, seen: Scene, table: Any) -> None:
    """Draw the surface in the colours of its values, and mark the sources."""
    width, height = np.ptp(seen.turned[seen.used, :2], axis=0)
    rows = int(np.clip(_COLUMNS * height / max(width, 1e-3 * height), 200, _LARGEST_ROWS))
    scale, centre = fitted(seen, _COLUMNS, rows, 0.02 * _COLUMNS)
    image, depth = surface_image(to_pixels(seen.turned, scale, centre), seen, _COLUMNS, rows, "plain", table)
    axes.imshow(image, interpolation="antialiased")
    mark_dots(axes, to_pixels(seen.dots @ seen.turn.T, scale, centre), depth)
    axes.set_axis_off()
