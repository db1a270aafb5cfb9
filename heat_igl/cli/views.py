"""Commands that show: a window or page, and the demonstration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from heat_igl.cli.demo import demonstrate
from heat_igl.cli.options import JsonOption, MeshArgument, MethodOption, PointsOption, ToleranceOption, choice, positive
from heat_igl.cli.output import check_json, check_page, check_writable, described, print_rows, say
from heat_igl.cli.regions import projected
from heat_igl.errors import ReferenceSolverError
from heat_igl.geodesic import SolverChoice
from heat_igl.heat_method import Boundary, SignedHeatSolver
from heat_igl.io import read_mesh_or_cloud
from heat_igl.mesh import Mesh, PointCloud, as_simplices
from heat_igl.sources import vertex_sources
from heat_igl.typing import FloatArray

__all__ = ["demo", "view"]


def view(
    mesh: MeshArgument,
    source: Annotated[
        list[int] | None, typer.Option(metavar="VERTEX", help="Source vertex to start with; repeat for several.")
    ] = None,
    t_coef: Annotated[
        float | None, typer.Option(help="Time step in squared mean edge lengths.", callback=positive)
    ] = None,
    boundary: Annotated[str, choice(Boundary, "What heat does at the boundary.")] = "neumann",
    method: MethodOption = None,
    tolerance: ToleranceOption = 1e-5,
    exact: Annotated[bool, typer.Option("--exact", help="Show the exact distance beside it; takes seconds.")] = False,
    curves: Annotated[
        Path | None, typer.Option(metavar="OBJ", help="Show the signed distance from these polylines, too.")
    ] = None,
    points: PointsOption = False,
    html: Annotated[Path | None, typer.Option(help="Write an interactive page to this file; no window.")] = None,
    json_file: JsonOption = None,
) -> None:
    """A window in which a click moves the source and the distance follows, or a page if there is no display."""
    from heat_igl.drawing.viewer import Exploration, Window, display_problem

    check_json(json_file)
    loaded = read_mesh_or_cloud(mesh, points)
    sources = vertex_sources(np.array(source or [0]), loaded.n_vertices)
    solver_choice = SolverChoice.of(method, tolerance, t_coef=t_coef, boundary=boundary)
    target = html or Path(f"{mesh.stem}-view.html")
    problem = None if html else display_problem()
    if html or problem:
        check_page(target)
    with Console(stderr=True).status("measuring"):
        shown = Exploration(loaded, sources, solver_choice, fields={} if curves is None else _signed(loaded, curves))
        if exact:
            shown.compare()
            if shown.exact is None:
                raise ReferenceSolverError(shown.message)
    if html is None and problem is None:
        try:
            window = Window(shown, title=f"heat-igl: {mesh.name}", exact=exact)
        except RuntimeError as error:
            problem = str(error)
            check_page(target)
        else:
            window.run()
            return
    shown.page(mesh.name, f"Distance by {shown.plan}.").save(target)
    if problem:
        say(f"no window: {problem}")
    written = ("wrote", f"{target} (open it in a browser)", str(target))
    print_rows([described(mesh, loaded), written], json_file)


def _signed(mesh: Mesh | PointCloud, curves: Path) -> dict[str, FloatArray]:
    """The signed distance from the polylines of a file, as a field by name."""
    surface = as_simplices(mesh)
    return {"signed distance": SignedHeatSolver(surface).distance(projected(surface, curves))}


def demo(
    out: Annotated[Path, typer.Option(help="Directory for the results; made if missing.")] = Path("heat-igl-demo"),
    json_file: JsonOption = None,
) -> None:
    """Distance on a real mesh, with errors against exact distance, files and a picture."""
    out.mkdir(parents=True, exist_ok=True)
    check_writable(out / "demo.png")
    check_json(json_file)
    print_rows(demonstrate(out), json_file)
