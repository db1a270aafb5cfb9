"""Commands for curves: paths, straight lines in a direction, signed distance from curves, and cutting along them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, cast

import numpy as np
import typer

import heat_igl
from heat_igl import drawing
from heat_igl.cli import options as opt
from heat_igl.cli.options import Row, check_file, check_output, print_rows, write_results, wrote
from heat_igl.errors import SourceError
from heat_igl.heat import Level, SignedHeatSolver
from heat_igl.io import MESH_SUFFIXES, read_mesh_or_cloud, read_polylines, write_mesh
from heat_igl.mesh import Mesh, SurfaceCurve, SurfacePoints, as_simplices, closest_points

CurvesOption = Annotated[
    Path, typer.Option(metavar="OBJ", help="Polylines (records l), as `isolines` and `path` write them; projected.")
]


def path(
    mesh: opt.MeshArgument,
    output: opt.CurveOutput,
    waypoints: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[A B ...]", help="Vertices, counted from 0, or positions X,Y,Z; before a negative one write --."
        ),
    ] = None,
    closed: Annotated[bool, typer.Option("--closed", help="Straighten the loop through the waypoints.")] = False,
    start: Annotated[
        int | None, typer.Option("--from", metavar="VERTEX", help="Vertex where the shortest path begins.")
    ] = None,
    end: Annotated[
        int | None, typer.Option("--to", metavar="VERTEX", help="Vertex where the shortest path ends.")
    ] = None,
    points: opt.PointsOption = False,
    json_file: opt.JsonOption = None,
) -> None:
    """A geodesic through waypoints, a closed one, or the shortest path between two vertices."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    if (start is None) != (end is None):
        missing = "--to" if end is None else "--from"
        raise SourceError(f"{missing} is missing: name a vertex with each of --from and --to")
    if (start is None) == (not waypoints) or (closed and not waypoints):
        raise SourceError(
            "name two waypoints or more, such as 12 900, or one vertex with --from and one with --to, not both"
        )
    if waypoints:
        places, gaps = zip(*(_place(loaded, text) for text in waypoints), strict=True)
        _report(loaded, heat_igl.geodesic_path(loaded, list(places), closed), output, json_file, gaps)
        return
    ends = []
    for option, vertex in (("--from", start), ("--to", end)):
        if vertex is None or not 0 <= vertex < loaded.n_vertices:
            raise SourceError(f"{option} {vertex} is no vertex: the mesh has {loaded.n_vertices}, counted from 0")
        ends.append(vertex)
    found = heat_igl.shortest_paths(loaded, *ends)
    _report(loaded, found[0], output, json_file, ())


def trace(
    mesh: opt.MeshArgument,
    start: Annotated[str, typer.Option("--from", metavar="V|X,Y,Z", help="Vertex, counted from 0, or position.")],
    direction: Annotated[str, typer.Option(metavar="X,Y,Z", help="Direction in space; its length does not matter.")],
    length: Annotated[float, typer.Option(help="Length of the line, in the unit of the mesh.")],
    output: opt.CurveOutput,
    points: opt.PointsOption = False,
    json_file: opt.JsonOption = None,
) -> None:
    """A straight line on the surface, from a point in a direction."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    place, gap = _place(loaded, start)
    towards = opt.position(direction, "--direction")
    _report(loaded, heat_igl.trace_geodesic(loaded, place, towards, length), output, json_file, [gap])


def _place(mesh: Mesh, text: str) -> tuple[int | SurfacePoints, float | None]:
    """The vertex of this number, or the closest point of the surface to this position and the distance between them."""
    if "," in text:
        found = closest_points(mesh, [opt.position(text, "position")])
        return found.points, float(found.gap[0])
    try:
        return int(text), None
    except ValueError:
        raise SourceError(f"{text!r} is no place: a vertex such as 12, or a position such as 0.5,0,1.25") from None


def _report(
    mesh: Mesh, curve: SurfaceCurve, output: Path, json_file: Path | None, gaps: Sequence[float | None]
) -> None:
    """Write a curve, and print the length, and how far positions were off the surface."""
    heat_igl.write_curves(output, mesh, [curve])
    length, segments = float(curve.lengths(mesh).sum()), len(curve)
    rows: list[Row] = [("length", f"{length:.6g}", length), ("segments", str(segments), segments)]
    given = [gap for gap in gaps if gap is not None]
    if given:
        rows.append(("off the surface", ", ".join(f"{gap:.6g}" for gap in given), given))
    print_rows([*rows, *wrote(output)], json_file)


def signed(
    mesh: opt.MeshArgument,
    curves: CurvesOption,
    output: Annotated[Path | None, typer.Option(help="PLY or VTU file for mesh and distance.")] = None,
    picture: opt.PictureOption = None,
    level: Annotated[
        str | None, opt.choice(Level, "The integrated distance: what is 0 of it, each curve, or the mean over all.")
    ] = None,
    t_coef: opt.TimeStepOption = None,
    points: opt.PointsOption = False,
    json_file: opt.JsonOption = None,
) -> None:
    """Distance from curves, negative on their left; curves may have gaps."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    drawn_on = projected(loaded, curves)
    check_output(loaded, output)
    phi = SignedHeatSolver(loaded, t_coef=t_coef).distance(drawn_on, level=cast(Level | None, level))
    written = write_results(
        loaded, phi, output, picture,
        lambda: drawing.plot_field(loaded, phi, label="signed distance", curves=drawn_on),
    )  # fmt: skip
    finite = phi[np.isfinite(phi)]
    low, high, left, right = float(finite.min()), float(finite.max()), int((finite < 0).sum()), int((finite > 0).sum())
    rows: list[Row] = [
        ("curves", str(len(drawn_on)), len(drawn_on)),
        ("left", f"{left} vertices, down to {low:.6g}", {"n_vertices": left, "distance": low}),
        ("right", f"{right} vertices, up to {high:.6g}", {"n_vertices": right, "distance": high}),
    ]
    unreachable = len(phi) - len(finite)
    if unreachable:
        rows.append(("unreachable", f"{unreachable} vertices", unreachable))
    print_rows([*rows, *written], json_file)


def cut(
    mesh: opt.MeshArgument,
    curves: CurvesOption,
    output: Annotated[Path, typer.Option(help="File for the cut mesh; with --split, one for each piece beside it.")],
    split: Annotated[bool, typer.Option("--split", help="Write each piece to a file of its own.")] = False,
    points: opt.PointsOption = False,
    json_file: opt.JsonOption = None,
) -> None:
    """Cut a mesh along curves, so that they become edges."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    check_file("--output", output, "meshes", MESH_SUFFIXES)
    found = heat_igl.cut(loaded, projected(loaded, curves))
    pieces = found.split()
    written = {output: found.mesh}
    if split:
        written = {output.with_stem(f"{output.stem}_{i}"): piece.mesh for i, piece in enumerate(pieces)}
    for path, part in written.items():
        write_mesh(path, part)
    areas = [float(piece.mesh.measures.sum()) for piece in pieces]
    n_faces = {"before": loaded.n_faces, "now": found.mesh.n_faces}
    rows: list[Row] = [
        ("faces", f"{loaded.n_faces} before, {found.mesh.n_faces} now", n_faces),
        ("pieces", ", ".join(f"{area:.6g}" for area in areas) + " in area", areas),
    ]
    print_rows([*rows, *wrote(*written)], json_file)


def projected(mesh: Mesh, path: Path) -> list[SurfaceCurve]:
    """The polylines of a file as curves on the mesh."""
    curves = []
    for i, line in enumerate(read_polylines(path)):
        try:
            curves.append(heat_igl.curve_on(mesh, line.positions, closed=line.is_closed))
        except SourceError as error:
            raise SourceError(f"{path}, polyline {i}: {error}") from None
    return curves
