"""Commands that show: an interactive page, and the demonstration."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from heat_igl import reference
from heat_igl.cli import options as opt
from heat_igl.cli.curves import projected
from heat_igl.cli.demo import demonstrate
from heat_igl.cli.options import check_file, check_json, check_writable, described, print_rows
from heat_igl.geodesic import SolverChoice
from heat_igl.heat import SignedHeatSolver
from heat_igl.io import read_mesh_or_cloud
from heat_igl.mesh import as_simplices
from heat_igl.sources import vertex_sources


def view(
    mesh: opt.MeshArgument,
    source: opt.SourcesOption = None,
    t_coef: opt.TimeStepOption = None,
    boundary: opt.BoundaryOption = "neumann",
    method: opt.MethodOption = None,
    tolerance: opt.ToleranceOption = 1e-5,
    exact: Annotated[bool, typer.Option("--exact", help="Show the exact distance beside it; takes seconds.")] = False,
    curves: Annotated[
        Path | None, typer.Option(metavar="OBJ", help="Show the signed distance from these polylines, too.")
    ] = None,
    points: opt.PointsOption = False,
    html: Annotated[Path | None, typer.Option(help="File for the page, which is not opened then.")] = None,
    json_file: opt.JsonOption = None,
) -> None:
    """An interactive page, opened in the browser: a click moves the source, and the distance follows."""
    from heat_igl.drawing import page
    from heat_igl.drawing.figure import PAGE_SUFFIXES

    target = html or Path(f"{mesh.stem}-view.html")
    check_file("--html", target, "pages", PAGE_SUFFIXES, "matplotlib view")
    loaded = read_mesh_or_cloud(mesh, points)
    sources = vertex_sources(np.array(source or [0]), loaded.n_vertices)
    with Console(stderr=True).status("measuring"):
        solver = SolverChoice.of(method, tolerance, t_coef=t_coef, boundary=boundary).on(loaded)
        fields = {"exact": reference.exact(as_simplices(loaded), sources)} if exact else {}
        if curves is not None:
            surface = as_simplices(loaded)
            fields["signed distance"] = SignedHeatSolver(surface).distance(projected(surface, curves))
        shown = page(
            loaded, solver.distance(sources), sources=sources, title=mesh.name, method=f"Distance by {solver.plan}.",
            fields=fields, beside=next(iter(fields), None),
        )  # fmt: skip
    shown.save(target)
    # A browser for terminals would take the place of the shell.
    has_display = not sys.platform.startswith("linux") or {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()
    is_open = html is None and has_display and webbrowser.open(target.resolve().as_uri())
    written = ("wrote", str(target) if is_open else f"{target} (open it in a browser)", str(target))
    print_rows([described(mesh, loaded), written], json_file)


def demo(
    out: Annotated[Path, typer.Option(help="Directory for the results; made if missing.")] = Path("heat-igl-demo"),
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="As for the other commands; may be in that directory.")
    ] = None,
) -> None:
    """Distance on a real mesh, with errors against exact distance, files and a picture."""
    out.mkdir(parents=True, exist_ok=True)
    check_writable(out / "demo.png")
    check_json(json_file)
    print_rows(demonstrate(out), json_file)
