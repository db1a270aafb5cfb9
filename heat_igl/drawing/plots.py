"""Pictures of a distance, or of another field, on a mesh: static ones without a display or OpenGL, and pages to turn.

matplotlib lays out the figure; `heat_igl.drawing` draws the surface, since matplotlib cannot hide what is behind and
VTK needs OpenGL system libraries that slim machines lack. Needs the extra ``view``.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from heat_igl.drawing.figure import lay_out
from heat_igl.drawing.html_view import Page, page
from heat_igl.drawing.output import Picture
from heat_igl.drawing.scene import DISTANCE_LABEL, Scene, Style, check_style, colours, scene
from heat_igl.mesh import Mesh, SurfaceCurve
from heat_igl.sources import Sources
from heat_igl.typing import ArrayLike, FloatArray

__all__ = ["Page", "Picture", "page", "picture", "plot", "plot_field", "write_html"]


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
        Where the viewer is, in degrees; see `heat_igl.drawing.camera.rotation`. By default a flat mesh is seen face on,
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
    return lay_out(seen, _lines_in_space(mesh, curves, seen), style, colours(colormap), label, "unreachable")


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
    return lay_out(seen, _lines_in_space(mesh, curves, seen), style, table, label, "no value")


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
