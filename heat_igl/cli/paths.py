"""Commands for curves: paths and loops through waypoints, and straight lines in a direction."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

import heat_igl
from heat_igl.cli.options import JsonOption, MeshArgument, PointsOption, position
from heat_igl.cli.output import Row, check_curves, check_json, print_rows
from heat_igl.errors import SourceError
from heat_igl.io import read_mesh_or_cloud
from heat_igl.mesh import Mesh, SurfaceCurve, SurfacePoints, as_simplices, closest_points

__all__ = ["path", "trace"]

CurveOutput = Annotated[Path, typer.Option(help="OBJ, SVG (flat meshes) or DXF file for the curve.")]


def path(
    mesh: MeshArgument,
    output: CurveOutput,
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
    points: PointsOption = False,
    json_file: JsonOption = None,
) -> None:
    """A geodesic through waypoints, a closed one, or the shortest path between two vertices."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    check_curves(output)
    check_json(json_file)
    if (start is None) != (end is None):
        missing = "--to" if end is None else "--from"
        raise SourceError(f"{missing} is missing: name a vertex with each of --from and --to")
    if (start is None) == (not waypoints) or (closed and not waypoints):
        raise SourceError(
            "name two waypoints or more, such as 12 900, or one vertex with --from and one with --to, not both"
        )
    if waypoints:
        places, gaps = zip(*(_place(loaded, text) for text in waypoints), strict=True)
        _write(loaded, heat_igl.geodesic_path(loaded, list(places), closed), output, json_file, gaps)
        return
    ends = []
    for option, vertex in (("--from", start), ("--to", end)):
        if vertex is None or not 0 <= vertex < loaded.n_vertices:
            raise SourceError(f"{option} {vertex} is no vertex: the mesh has {loaded.n_vertices}, counted from 0")
        ends.append(vertex)
    found = heat_igl.shortest_paths(loaded, *ends)
    _write(loaded, found[0], output, json_file, ())


def trace(
    mesh: MeshArgument,
    start: Annotated[str, typer.Option("--from", metavar="V|X,Y,Z", help="Vertex, counted from 0, or position.")],
    direction: Annotated[str, typer.Option(metavar="X,Y,Z", help="Direction in space; its length does not matter.")],
    length: Annotated[float, typer.Option(help="Length of the line, in the unit of the mesh.")],
    output: CurveOutput,
    points: PointsOption = False,
    json_file: JsonOption = None,
) -> None:
    """A straight line on the surface, from a point in a direction."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    check_curves(output)
    check_json(json_file)
    place, gap = _place(loaded, start)
    towards = position(direction, "--direction")
    _write(loaded, heat_igl.trace_geodesic(loaded, place, towards, length), output, json_file, [gap])


def _place(mesh: Mesh, text: str) -> tuple[int | SurfacePoints, float | None]:
    """The vertex of this number, or the closest point of the surface to this position and the distance between them."""
    if "," in text:
        found = closest_points(mesh, [position(text, "position")])
        return found.points, float(found.gap[0])
    try:
        return int(text), None
    except ValueError:
        raise SourceError(f"{text!r} is no place: a vertex such as 12, or a position such as 0.5,0,1.25") from None


def _write(mesh: Mesh, curve: SurfaceCurve, output: Path, json_file: Path | None, gaps: Sequence[float | None]) -> None:
    """Write a curve, and print the length, and how far positions were off the surface."""
    heat_igl.write_curves(output, mesh, [curve])
    length, segments = float(curve.lengths(mesh).sum()), len(curve)
    rows: list[Row] = [("length", f"{length:.6g}", length), ("segments", str(segments), segments)]
    given = [gap for gap in gaps if gap is not None]
    if given:
        rows.append(("off the surface", ", ".join(f"{gap:.6g}" for gap in given), given))
    print_rows([*rows, ("wrote", str(output))], json_file)
