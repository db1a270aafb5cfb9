"""Commands for curves that separate: signed distance, and cutting."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import numpy as np
import typer

import heat_igl
from heat_igl.cli.options import JsonOption, MeshArgument, PointsOption, choice, positive
from heat_igl.cli.output import Row, check_json, check_outputs, check_writable, print_rows, write_distance
from heat_igl.errors import MeshError, SourceError
from heat_igl.heat import Level, SignedHeatSolver
from heat_igl.io import MESH_SUFFIXES, read_mesh_or_cloud, read_polylines, write_mesh
from heat_igl.mesh import Mesh, SurfaceCurve, as_simplices, curve_on

__all__ = ["cut", "projected", "signed"]

CurvesOption = Annotated[
    Path, typer.Option(metavar="OBJ", help="Polylines (records l), as `isolines` and `path` write them; projected.")
]


def signed(
    mesh: MeshArgument,
    curves: CurvesOption,
    output: Annotated[Path | None, typer.Option(help="PLY or VTU file for mesh and distance.")] = None,
    picture: Annotated[Path | None, typer.Option(help="PNG, PDF or SVG file for a picture.")] = None,
    level: Annotated[
        str | None, choice(Level, "The integrated distance: what is 0 of it, each curve, or the mean over all.")
    ] = None,
    t_coef: Annotated[
        float | None, typer.Option(help="Time step in squared mean edge lengths.", callback=positive)
    ] = None,
    points: PointsOption = False,
    json_file: JsonOption = None,
) -> None:
    """Distance from curves, negative on their left; curves may have gaps."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    drawn_on = projected(loaded, curves)
    check_outputs(loaded, output, picture)
    check_json(json_file)
    solver = SignedHeatSolver(loaded, t_coef=t_coef)
    phi = solver.distance(drawn_on, level=cast(Level | None, level))
    drawn = None
    if picture is not None:
        from heat_igl.drawing import plots

        shown = np.where(np.isfinite(phi), phi, np.nan)
        drawn = plots.plot_field(loaded, shown, label="signed distance", curves=drawn_on)
    if output is not None:
        write_distance(output, loaded, phi)
    if drawn is not None and picture is not None:
        drawn.save(picture)
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
    print_rows([*rows, *(("wrote", str(path)) for path in (output, picture) if path is not None)], json_file)


def cut(
    mesh: MeshArgument,
    curves: CurvesOption,
    output: Annotated[Path, typer.Option(help="File for the cut mesh; with --split, one for each piece beside it.")],
    split: Annotated[bool, typer.Option("--split", help="Write each piece to a file of its own.")] = False,
    points: PointsOption = False,
    json_file: JsonOption = None,
) -> None:
    """Cut a mesh along curves, so that they become edges."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    if output.suffix.lower() not in MESH_SUFFIXES:
        raise MeshError(f"--output {output}: meshes go to {', '.join(MESH_SUFFIXES)} files")
    check_writable(output)
    check_json(json_file)
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
    print_rows([*rows, *(("wrote", str(path)) for path in written)], json_file)


def projected(mesh: Mesh, path: Path) -> list[SurfaceCurve]:
    """The polylines of a file as curves on the mesh."""
    curves = []
    for i, line in enumerate(read_polylines(path)):
        try:
            curves.append(curve_on(mesh, line.positions, closed=line.is_closed))
        except SourceError as error:
            raise SourceError(f"{path}, polyline {i}: {error}") from None
    return curves
