"""Commands that measure: a distance, isolines."""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

import heat_igl
from heat_igl import drawing
from heat_igl.cli import options as opt
from heat_igl.cli.options import Row, check_output, described, plan_row, print_rows, write_results, wrote
from heat_igl.errors import SourceError
from heat_igl.geodesic import SolverChoice
from heat_igl.heat import HeatMethodSolver, Magnitude
from heat_igl.io import is_flat, read_mesh_or_cloud
from heat_igl.linear import Backend
from heat_igl.mesh import Mesh, PointCloud, as_simplices, closest_points
from heat_igl.operators import Laplacian
from heat_igl.sources import vertex_sources
from heat_igl.typing import BoolArray, FloatArray

# Positions and cells of small meshes, on which a first distance loads what every distance needs.
_PYRAMID = np.vstack([np.eye(3), -np.eye(3)[:2]]), [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]]
_CORNER = np.vstack([np.eye(3), np.zeros(3)]), [[0, 1, 2, 3]]

# Largest number of isolines; a larger number indicates a wrong spacing.
_MOST_LINES = 10000


def distance(
    mesh: opt.MeshArgument,
    source: opt.SourcesOption = None,
    at: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,Z", help="Source at the closest point of the surface; repeatable.")
    ] = None,
    method: opt.MethodOption = None,
    tolerance: opt.ToleranceOption = 1e-5,
    cutoff: Annotated[float | None, typer.Option(help="Distances beyond this are inf.", callback=opt.positive)] = None,
    region: opt.RegionOption = None,
    output: Annotated[
        Path | None, typer.Option(help="PLY, VTU or GIFTI file for mesh and distance, or NPY or CSV file for it.")
    ] = None,
    picture: opt.PictureOption = None,
    t_coef: opt.TimeStepOption = None,
    t: Annotated[float | None, typer.Option(help="Heat: time step, a squared length.", callback=opt.positive)] = None,
    laplacian: Annotated[str, opt.choice(Laplacian, "Heat: triangulation to solve on.")] = "auto",
    boundary: opt.BoundaryOption = "neumann",
    magnitude: Annotated[str, opt.choice(Magnitude, "Heat: length of the field that is integrated.")] = "auto",
    backend: Annotated[str, opt.choice(Backend, "Heat: linear solver.")] = "auto",
    points: opt.PointsOption = False,
    json_file: opt.JsonOption = None,
) -> None:
    """Distance from one or more sources: vertices, or points of the surface."""
    loaded = read_mesh_or_cloud(mesh, points)
    if not source and not at:
        raise SourceError("no source: name vertices with --source, or positions with --at x,y,z")
    vertices = vertex_sources(np.array(source), loaded.n_vertices) if source else None
    sources: Any = vertices
    gaps: list[Row] = []
    if at:
        places, gap = closest_points(loaded, [opt.position(text) for text in at])
        sources = places if vertices is None else [vertices, places]
        gaps = [("off the surface", ", ".join(f"{each:.6g}" for each in gap), gap.tolist())]
    check_output(loaded, output)
    mask = None if region is None else opt.region_mask(mesh, region)
    chosen = _choice(
        method,
        tolerance,
        t_coef=t_coef,
        t=t,
        laplacian=laplacian,
        boundary=boundary,
        magnitude=magnitude,
        backend=backend,
    )
    with Console(stderr=True).status("measuring"):
        _warm_up(loaded, chosen)
        phi, about = _measured(loaded, sources, chosen, cutoff, mask)
    written = write_results(loaded, phi, output, picture, lambda: drawing.plot(loaded, phi, sources=vertices))
    print_rows([*_summary(mesh, loaded, phi, cutoff), *about, *gaps, *written], json_file)


def _choice(method: str | None, tolerance: float, **options: Any) -> SolverChoice:
    """The solver that is meant: options of the heat method ask for it."""
    try:
        return SolverChoice.of(method, tolerance, **options)
    except ValueError as error:
        raise ValueError(str(error).replace("t_coef", "--t-coef").replace("the method is", "--method is")) from None


def _measured(
    mesh: Mesh | PointCloud,
    sources: Any,
    choice: SolverChoice,
    cutoff: float | None,
    region: BoolArray | None = None,
) -> tuple[FloatArray, list[Row]]:
    """The distance, and remarks on how it was found."""
    start = time.perf_counter()
    solver = choice.on(mesh, region)
    once = time.perf_counter() - start
    start = time.perf_counter()
    phi = solver.distance(sources, cutoff=cutoff)
    seconds = time.perf_counter() - start
    rows = [plan_row(solver.plan)]
    if isinstance(solver, HeatMethodSolver):
        found = solver.diagnostics
        raised = " (raised, so that heat crosses the mesh in double precision)" if found.t_raised else ""
        rows.append(("time step", f"{found.t:.6g}{raised}", found.t))
        rows.append(("flipped edges", str(found.n_flips), found.n_flips))
    per_distance = {"once": once, "per_distance": seconds}
    return phi, [*rows, ("seconds", f"{once:.3f} once, {seconds:.3f} per distance", per_distance)]


def _warm_up(mesh: Mesh | PointCloud, choice: SolverChoice) -> None:
    """Measure on a small mesh, so that times are of the work alone, without loading libraries for the first time."""
    is_tetrahedral = isinstance(mesh, Mesh) and mesh.is_tetrahedral
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        _measured(Mesh(*_CORNER) if is_tetrahedral else Mesh(*_PYRAMID), 0, choice, None)


def isolines(
    mesh: opt.MeshArgument,
    source: opt.SourcesOption,
    spacing: Annotated[float, typer.Option(help="Distance from one line to the next.", callback=opt.positive)],
    output: opt.CurveOutput,
    method: opt.MethodOption = None,
    tolerance: opt.ToleranceOption = 1e-5,
    points: opt.PointsOption = False,
    json_file: opt.JsonOption = None,
) -> None:
    """Curves of equal distance from one or more source vertices; in SVG they are dotted behind the surface."""
    loaded = as_simplices(read_mesh_or_cloud(mesh, points))
    sources = vertex_sources(np.array(source), loaded.n_vertices)
    phi, _ = _measured(loaded, sources, _choice(method, tolerance), None)
    farthest = float(phi[np.isfinite(phi)].max())
    if farthest < spacing:
        raise ValueError(f"--spacing {spacing:g} makes no line: the farthest vertex is at {farthest:.3g}")
    if farthest > _MOST_LINES * spacing:
        raise ValueError(
            f"--spacing {spacing:g} makes over {_MOST_LINES} lines up to {farthest:.3g}: choose a larger one"
        )
    levels = spacing * np.arange(1, int(farthest / spacing) + 1)
    curves = heat_igl.isolines(loaded, phi, levels)
    if output.suffix.lower() == ".svg" and not is_flat(loaded):
        heat_igl.plots.write_line_drawing(output, loaded, curves)
    else:
        heat_igl.write_curves(output, loaded, {f"{level:g}": each for level, each in zip(levels, curves, strict=True)})
    n = sum(map(len, curves))
    rows: list[Row] = [("farthest", f"{farthest:.6g}", farthest), ("lines", f"{n} at {len(levels)} distances", n)]
    print_rows([*rows, ("distances", f"{spacing:g} apart", levels.tolist()), *wrote(output)], json_file)


def _summary(path: Path, mesh: Mesh | PointCloud, phi: FloatArray, cutoff: float | None) -> list[Row]:
    finite = np.isfinite(phi)
    farthest = int(np.argmax(np.where(finite, phi, -1.0)))
    greatest, mean, unreachable = float(phi[farthest]), float(phi[finite].mean()), int((~finite).sum())
    rows: list[Row] = [
        described(path, mesh),
        ("farthest", f"{greatest:.6g} at vertex {farthest}", {"distance": greatest, "vertex": farthest}),
    ]
    if unreachable:
        beyond = "" if cutoff is None else ", or beyond the cutoff"
        rows.append(("unreachable", f"{unreachable} vertices{beyond}", unreachable))
    return [*rows, ("mean", f"{mean:.6g}", mean)]
