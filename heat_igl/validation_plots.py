"""The figure of a validation report: error per vertex on the surface, and error against distance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.errors import MissingExtraError
from heat_igl.mesh import Mesh
from heat_igl.metrics import relative_error
from heat_igl.typing import FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["error_figure"]

# Errors from 0.001 % to 10 %: what tells methods apart. All panels share the range, so that they can be compared.
_LOWEST, _HIGHEST = 1e-5, 1e-1
_ROW_INCHES = 2.6


def error_figure(title: str, mesh: Mesh, truth: FloatArray, distances: Mapping[str, FloatArray]) -> Figure:
    """Two panels for each method.

    Parameters
    ----------
    title : str
        Of the figure.
    mesh : Mesh
        Triangles, or tetrahedra whose boundary is drawn.
    truth : (n,) float64
        Distance to compare with.
    distances : mapping of str to (n,) float64
        Of at least one method.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    try:
        from matplotlib.colors import LogNorm
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtraError.of("a figure", "matplotlib", "view") from None
    figure = Figure(figsize=(9, _ROW_INCHES * len(distances) + 0.6), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(len(distances), 2, squeeze=False, width_ratios=(1, 1.2))
    norm = LogNorm(_LOWEST, _HIGHEST)
    reachable = np.isfinite(truth) & (truth > 0)
    for (surface, scatter), (method, distance) in zip(axes, distances.items(), strict=True):
        # A source has no relative error; it is drawn as if it had the smallest.
        error = np.where(reachable, relative_error(distance, truth), _LOWEST)
        painted = _paint(surface, mesh, np.clip(error, _LOWEST, _HIGHEST), norm)
        surface.set_title(method, fontsize=10)
        size = float(np.clip(60 / np.sqrt(reachable.sum()), 0.3, 3))
        errors = np.maximum(error[reachable], _LOWEST)
        scatter.plot(truth[reachable], errors, "o", ms=size, mew=0, color="tab:blue", rasterized=True)
        scatter.set(yscale="log", ylim=(_LOWEST / 2, 1), xlim=(0, truth[reachable].max()), ylabel="relative error")
        scatter.grid(visible=True, alpha=0.3)
        figure.colorbar(painted, ax=surface, extend="both")
    axes[-1, 1].set_xlabel("distance")
    return figure


def _paint(axes: Any, mesh: Mesh, values: FloatArray, norm: Any) -> Any:
    """Draw the surface in parallel projection along its shortest extent, far triangles first."""
    from matplotlib.collections import PolyCollection

    triangles = mesh.F if not mesh.is_tetrahedral else _skin(mesh)
    centred = mesh.V - mesh.V[mesh.referenced].mean(axis=0)
    _, _, directions = np.linalg.svd(centred[mesh.referenced], full_matrices=False)
    projected = centred @ directions.T
    order = np.argsort(projected[triangles, 2].mean(axis=1), kind="stable")
    painted = PolyCollection(
        projected[triangles[order], :2],
        array=values[triangles[order]].mean(axis=1),
        norm=norm,
        cmap="viridis",
        edgecolors="face",  # without, the seams between triangles shine through
        linewidths=0.2,
        rasterized=True,
    )
    axes.add_collection(painted)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
    return painted


def _skin(mesh: Mesh) -> Any:
    from heat_igl.connectivity import facets

    found = facets(mesh.F, mesh.n_vertices)
    return found.vertices[found.n_faces == 1]
