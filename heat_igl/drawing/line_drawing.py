"""Line drawings of curves on a surface as SVG; hidden parts are dotted or left out."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from heat_igl.drawing.raster import rasterize, to_pixels, visible_runs
from heat_igl.drawing.scene import scene
from heat_igl.drawing.surface_image import fitted
from heat_igl.errors import require_choice
from heat_igl.io import complete_file, write_svg
from heat_igl.mesh import MeshLike, as_simplices, flat_curves
from heat_igl.typing import FloatArray

Hidden = Literal["dotted", "omitted"]

# Width of the depth buffer in pixels: visible parts of lines end within about a thousandth of the picture.
_PIXELS = 1600
# A line is hidden if it lies behind the surface by more than this share of the picture.
_BEHIND = 0.01
# Corners at which a line turns by less than this, in radians, are left out.
_STRAIGHT = 1e-9


def write_line_drawing(
    path: str | os.PathLike[str],
    mesh: MeshLike,
    curves: Any,
    *,
    hidden: Hidden = "dotted",
    view: tuple[float, float] | None = None,
    up: str = "y",
) -> None:
    """Draw curves on a surface as lines in an SVG file, as they are seen from one side.

    Parameters
    ----------
    path : path-like
        An .svg file. An existing one is replaced only when the new one is complete.
    mesh : mesh
        Triangles on which the curves lie.
    curves : SurfaceCurve, or sequence of such of any depth
        For instance isolines or paths.
    hidden : {"dotted", "omitted"}
        How to draw lines behind the surface. In the file they are in the group "hidden", and other lines in "visible".
    view, up
        The direction of the viewer, as for `plot`.

    Raises
    ------
    ValueError
        If the extension or an option is another.
    TypeError
        If `curves` holds anything else.
    OSError
        If the file cannot be written.

    Notes
    -----
    The drawing is a parallel projection in the unit of the mesh. Only core dependencies are needed.
    """
    target = Path(os.fspath(path))
    if target.suffix.lower() != ".svg":
        raise ValueError(f"{target}: line drawings go to .svg files")
    require_choice("hidden", hidden, get_args(Hidden))
    mesh, lines = as_simplices(mesh), flat_curves(curves)
    seen = scene(mesh, np.zeros(mesh.n_vertices), view=view, up=up)
    scale, centre = fitted(seen, _PIXELS, _PIXELS, 0.02 * _PIXELS)
    depth = rasterize(to_pixels(seen.turned, scale, centre), seen.F, _PIXELS, _PIXELS).depth
    groups: dict[str, list[tuple[FloatArray, bool]]] = {"visible": [], "hidden": []}
    for curve in lines:
        for is_seen, run in visible_runs(to_pixels(seen.line(curve, mesh), scale, centre), depth, _BEHIND * _PIXELS):
            # Pixels count downwards, the plane of the drawing upwards; its unit is that of the mesh.
            drawn = (run[:, :2] - centre) * [1, -1] / scale * seen.unit
            groups["visible" if is_seen else "hidden"].append((_corners(drawn), False))
    if hidden == "omitted":
        del groups["hidden"]
    with complete_file(target) as temporary:
        write_svg(temporary, groups, dotted="hidden")


def _corners(points: FloatArray) -> FloatArray:
    """The points of a polyline (k, 2) without those on straight pieces."""
    along = np.diff(points, axis=0)
    length = np.linalg.norm(along, axis=1)
    moving = np.concatenate([[True], length > 0])
    points, along = points[moving], along[length > 0]
    if len(points) < 3:
        return points
    turn = along[:-1, 0] * along[1:, 1] - along[:-1, 1] * along[1:, 0]
    straight = np.abs(turn) <= _STRAIGHT * np.linalg.norm(along[:-1], axis=1) * np.linalg.norm(along[1:], axis=1)
    return np.asarray(points[np.concatenate([[True], ~straight, [True]])])
