"""Static pictures and interactive pages of a distance or another field on a mesh. Needs the extra ``view``.

Pictures need neither a display nor OpenGL. matplotlib lays out the figure. The surface is rasterized in
`heat_igl.drawing.raster`: matplotlib does not remove hidden surfaces, and VTK needs OpenGL system libraries, which many
servers lack.

Examples
--------
>>> import heat_igl
>>> from pathlib import Path
>>> mesh = heat_igl.shapes.torus(20, 12)
>>> heat_igl.plots.plot(mesh, heat_igl.geodesic_distance(mesh, 0), sources=0).save("torus.png")
>>> Path("torus.png").read_bytes()[1:4]
b'PNG'
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from heat_igl.drawing.figure import Picture, fitted, lay_out
from heat_igl.drawing.html_view import Page, page
from heat_igl.drawing.raster import rasterize, to_pixels, visible_runs
from heat_igl.drawing.scene import DISTANCE_COLOURS, DISTANCE_LABEL, Scene, Style, colours, scene, slopes, vertex_values
from heat_igl.errors import as_array, require_choice
from heat_igl.io import complete_file, write_svg
from heat_igl.mesh import Mesh, MeshLike, NestedCurves, PointCloud, as_mesh, as_simplices
from heat_igl.sources import Sources
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray

__all__ = [
    "Page", "Picture", "page", "plot", "plot_field", "plot_labels", "write_line_drawing",
]  # fmt: skip

Hidden = Literal["dotted", "omitted"]

# Width of the depth buffer in pixels: visible parts of lines end within about a thousandth of the picture.
_PIXELS = 1600
# A line is hidden if it lies behind the surface by more than this share of the picture.
_BEHIND = 0.01
# Corners at which a line turns by less than this, in radians, are left out.
_STRAIGHT = 1e-9
# Of matplotlib's "tab10".
_N_COLOURS = 10


def plot(
    mesh: MeshLike,
    distance: ArrayLike,
    *,
    sources: Sources | None = None,
    spacing: float | None = None,
    style: Style = "lines",
    curves: NestedCurves = (),
    view: tuple[float, float] | None = None,
    up: str = "y",
    colormap: str = DISTANCE_COLOURS,
    label: str = DISTANCE_LABEL,
) -> Picture:
    """Draw a distance on a mesh with colours, isolines and sources.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra, of which the boundary is drawn; points of a `PointCloud` are drawn as discs.
    distance : (n,) array_like
        Distance, as returned by a solver; ``inf`` is drawn grey.
    sources : optional
        Sources to mark, as for `HeatMethodSolver.distance`: vertices, points in faces and curves.
    spacing : float, optional
        Distance between isolines; by default a round number near a sixteenth of the largest distance.
    style : {"lines", "stripes", "plain"}
        "lines" draws isolines. "stripes" draws alternating light and full stripes of width `spacing`, which show kinks
        and ripples best. "plain" draws colours only.
    curves : SurfaceCurve, or sequence of such of any depth
        Curves on the mesh; their hidden parts are thin and dotted.
    view : (azimuth, elevation), optional
        Direction of the viewer in degrees; see `heat_igl.drawing.raster.rotation`. By default a flat mesh is viewed at
        right angles, and any other mesh from the one of eight directions that shows the most of the surface and of the
        sources.
    up : {"x", "y", "z"}
        The coordinate axis that points upwards.
    colormap : str
        Name of a matplotlib colour map; the default is perceptually uniform.
    label : str
        Title of the colour bar.

    Returns
    -------
    Picture
        Displayed by notebooks; `Picture.save` writes it to a file.

    Raises
    ------
    ValueError
        If `distance` does not have shape (n,), contains NaN or no finite value, or an option is invalid.
    SourceError
        If `sources` are invalid, or a curve does not lie on the mesh.
    MissingExtraError
        If matplotlib is not installed.
    """
    mesh = as_mesh(mesh)
    require_choice("style", style, get_args(Style))
    seen = scene(mesh, distance, sources=sources, spacing=spacing, view=view, up=up)
    return lay_out(seen, seen.placed(curves, mesh), style, colours(colormap), label, "unreachable")


def plot_field(
    mesh: MeshLike,
    values: ArrayLike,
    *,
    label: str,
    limits: tuple[float, float] | None = None,
    spacing: float | None = None,
    sources: Sources | None = None,
    curves: NestedCurves = (),
    view: tuple[float, float] | None = None,
    up: str = "y",
    colormap: str | None = None,
) -> Picture:
    """Draw a scalar field on a mesh, such as heat or an error, by colours and optional isolines.

    Other parameters, the result and errors are those of `plot`.

    Parameters
    ----------
    values : (n,) array_like
        Values at the vertices; ``inf`` is drawn grey.
    label : str
        Title of the colour bar.
    limits : (low, high), optional
        Values at the ends of the colour bar; values beyond take the colour of the nearer end. By default the range of
        the values and 0, made symmetric about 0 if there are values of both signs.
    spacing : float, optional
        Difference between isolines; no isolines by default.
    colormap : str, optional
        Name of a matplotlib colour map. The default is "RdBu_r", which is white in the middle, for limits on both
        sides of 0, and the perceptually uniform "magma_r" otherwise.
    """
    mesh = as_mesh(mesh)
    if limits is None:
        finite = np.asarray(values, dtype=np.float64)
        finite = finite[np.isfinite(finite)]
        if len(finite) and finite.min() < 0 < finite.max():
            limits = -float(np.abs(finite).max()), float(np.abs(finite).max())
    has_signs = limits is not None and limits[0] < 0 < limits[1]
    table = colours(colormap or ("RdBu_r" if has_signs else "magma_r"), is_trimmed=not has_signs)
    seen = scene(
        mesh, values, name="values", sources=sources, spacing=spacing, limits=limits, view=view, up=up
    )  # fmt: skip
    style: Style = "plain" if spacing is None else "lines"
    return lay_out(seen, seen.placed(curves, mesh), style, table, label, "no value")


def plot_labels(
    mesh: MeshLike,
    labels: ArrayLike,
    *,
    distance: ArrayLike | None = None,
    sources: Sources | None = None,
    curves: NestedCurves = (),
    view: tuple[float, float] | None = None,
    up: str = "y",
) -> Picture:
    """Draw labels of vertices, such as those of Voronoi cells, with different colours for neighbouring labels.

    Other parameters, the result and other errors are those of `plot`.

    Parameters
    ----------
    labels : (n,) array_like of int
        A label for each vertex; -1, for vertices without one, is drawn grey.
    distance : (n,) array_like, optional
        For Voronoi cells, the distance of each vertex from the site of its cell: borders are then drawn where the
        distances from both sites are equal. Otherwise a point has the label of the nearest corner of its triangle.

    Raises
    ------
    ValueError
        If `labels` are not integers of shape (n,), or all negative.

    Notes
    -----
    There are ten colours of different hue. In ascending order, each label gets the first colour that no neighbouring
    label has, or if all ten are taken, the next one in turn.
    """
    mesh = as_mesh(mesh)
    given = as_array("labels", labels)
    if given.dtype.kind not in "iu":
        raise ValueError(f"labels must be integers, not {given.dtype}")
    table = colours("tab10", is_trimmed=False)
    if given.shape != (mesh.n_vertices,):
        raise ValueError(f"labels must have shape ({mesh.n_vertices},), one per vertex, but they have {given.shape}")
    if (given < 0).all():
        raise ValueError("labels are negative everywhere, so no vertex has one: label what is to be drawn from 0 on")
    values = np.where(given < 0, np.inf, _colour_numbers(given, as_simplices(mesh).edges, _N_COLOURS) + 0.5)
    seen = scene(
        mesh, values, name="labels", sources=sources, limits=(0, _N_COLOURS), view=view, up=up, is_categorical=True
    )  # fmt: skip
    if distance is not None:
        measured = vertex_values("distance", distance, mesh.n_vertices)
        if not isinstance(mesh, PointCloud):  # whose discs have one label each
            # Without a label there is no site to be far from.
            seen = replace(seen, borders=_borders(seen, given, np.where(given < 0, 0.0, measured / seen.unit)))
    return lay_out(seen, seen.placed(curves, mesh), "plain", table, "", "no label")


def _colour_numbers(labels: IntArray, edges: IntArray, n_colours: int) -> IntArray:
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


def _borders(seen: Scene, labels: IntArray, distance: FloatArray) -> FloatArray:
    """`Scene.borders` for cells: for each triangle, the distances of its three corners from the sites of all three.

    The distance of a corner from the site of another cell is extrapolated from its neighbours in that cell, by their
    distances and gradients there, and averaged. It depends on the vertex alone, so that borders continue across edges.
    """
    F, corners = seen.F, seen.V[seen.F]
    _, label = np.unique(labels, return_inverse=True)
    label = label[F]
    is_whole: BoolArray = np.asarray((label == label[:, :1]).all(axis=1) & np.isfinite(distance[F]).all(axis=1))
    slope = slopes(Mesh(seen.V, F), distance, is_whole)
    to_corner = corners[:, None] - corners[:, :, None]
    found = distance[F][:, :, None] + np.einsum("mkjx,mkx->mkj", to_corner, slope[F])
    other = label[:, :, None] != label[:, None, :]
    key = F[:, None, :] * (int(label.max()) + 1) + label[:, :, None]
    _, place, count = np.unique(key[other], return_inverse=True, return_counts=True)
    borders = np.repeat(distance[F][:, None, :], 3, axis=1)
    borders[other] = (np.bincount(place, found[other]) / count)[place]
    return borders


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
    mesh = as_simplices(mesh)
    seen = scene(mesh, np.zeros(mesh.n_vertices), view=view, up=up)
    scale, centre = fitted(seen, _PIXELS, _PIXELS, 0.02 * _PIXELS)
    depth = rasterize(to_pixels(seen.turned, scale, centre), seen.F, _PIXELS, _PIXELS).depth
    groups: dict[str, list[tuple[FloatArray, bool]]] = {"visible": [], "hidden": []}
    for line in seen.placed(curves, mesh):
        for is_seen, run in visible_runs(to_pixels(line, scale, centre), depth, _BEHIND * _PIXELS):
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
