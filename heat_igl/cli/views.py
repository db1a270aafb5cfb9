"""Commands that judge and show: the report of a mesh, the validation of methods, a page, the demonstration."""

from __future__ import annotations

import os
import sys
import webbrowser
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import Progress

import heat_igl
from heat_igl import reference
from heat_igl.cli import options as opt
from heat_igl.cli.demo import demonstrate
from heat_igl.cli.distances import projected
from heat_igl.cli.options import described, print_report, print_rows, say
from heat_igl.drawing.figure import Picture
from heat_igl.geodesic import SolverChoice
from heat_igl.heat import SignedHeatSolver
from heat_igl.io import read_mesh_or_cloud
from heat_igl.mesh import as_simplices
from heat_igl.reference.guarded import TIMEOUT
from heat_igl.sources import vertex_sources
from heat_igl.validation import METHODS, ValidationRow, draw_sources
from heat_igl.validation.report import plain

_NARROW = "mean %", "max %", "precompute s", "solve ms", "memory MB"
_DEFAULT_METHODS = "heat,sweep,exact,meshlab,igl"


def info(mesh: opt.MeshArgument, points: opt.PointsOption = False, json_file: opt.JsonOption = None) -> None:
    """Describe a mesh or the triangles of a point cloud: sizes, defects, and properties that affect distances."""
    loaded = read_mesh_or_cloud(mesh, points)
    report = loaded.report()
    rows = [(*row, value) for row, value in zip(report.rows(), plain(asdict(report)).values(), strict=True)]
    try:
        plan = [opt.plan_row(heat_igl.GeodesicSolver(loaded).plan)]
    except heat_igl.MeshError:  # the report above says what is wrong
        plan = []
    print_rows([described(mesh, loaded), *rows, *plan], json_file)


def validate(
    mesh: opt.MeshArgument,
    sources: Annotated[int, typer.Option(min=1, help="Single source vertices, one distance from each.")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="For drawing them.")] = 0,
    methods: Annotated[str, typer.Option(help=f"Separated by commas: {', '.join(METHODS)}.")] = _DEFAULT_METHODS,
    reference: Annotated[str, typer.Option(help="Method to measure errors against.")] = "exact",
    timeout: Annotated[float, typer.Option(help="Seconds for one native solve.", callback=opt.positive)] = TIMEOUT,
    points: opt.PointsOption = False,
    json_file: opt.JsonOption = None,
    picture: opt.PictureOption = None,
    fail_above: Annotated[
        float | None,
        typer.Option(metavar="PERCENT", help="Exit with 1 if a mean error is larger.", callback=opt.positive),
    ] = None,
) -> None:
    """Errors of methods against a reference, with time and memory."""
    loaded = read_mesh_or_cloud(mesh, points)
    drawn_sources = draw_sources(loaded, sources, seed)
    console = Console(stderr=True)
    # Without a terminal there is no bar, not even the empty line after a finished one.
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)
        report = heat_igl.validate(
            loaded, drawn_sources, [name.strip() for name in methods.split(",")], name=mesh.stem,
            reference=reference, timeout=timeout,
            progress=lambda label, done, total: bar.update(task, description=label, completed=done, total=total),
        )  # fmt: skip
    if picture is not None and report.truths is None:
        say(f"no picture of errors: {report.failure or 'there is no reference'}")
    elif picture is not None:
        Picture(report.plot()).save(picture)
    # The columns that a terminal has space for, and all to anything else.
    text = report.to_markdown(_NARROW) if Console().is_terminal else report.to_markdown()
    print_report(report.to_dict(), text, json_file)
    exceeding = report.exceeding(fail_above) if fail_above is not None else ()
    if exceeding:
        found = ", ".join(f"{row.method} {_verdict(row)}" for row in exceeding)
        say(f"the mean error is not at most {fail_above:g} %: {found}")
        raise typer.Exit(1)


def _verdict(row: ValidationRow) -> str:
    """Why a method does not have the error that is asked for."""
    if row.errors is None:
        return "failed" if row.failure else "has no reference"
    if row.errors.n_wrong_reach:
        return f"reaches {row.errors.n_wrong_reach} other vertices than the reference"
    return f"{100 * row.errors.mean:.3g} %"


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
    opt.check_file("--html", target, "pages", PAGE_SUFFIXES, "matplotlib view")
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
    opt.check_writable(out / "demo.png")
    opt.check_json(json_file)
    print_rows(demonstrate(out), json_file)
