"""Commands that measure and cut: distances, isolines, paths, straight lines, signed distance, cutting."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import typer
from rich.console import Console

import heat_igl
from heat_igl import drawing
from heat_igl.cli import options as opt
from heat_igl.cli.options import Row, check_file, check_output, described, plan_row, print_rows, write_results, wrote
from heat_igl.errors import SourceError, errors_at
from heat_igl.geodesic import SolverChoice
from heat_igl.heat import HeatMethodSolver, Level, Magnitude, SignedHeatSolver
from heat_igl.io import MESH_SUFFIXES, is_flat, read_mesh_or_cloud, read_polylines, write_mesh
from heat_igl.linear import Backend
from heat_igl.mesh import Mesh, PointCloud, SurfaceCurve, SurfacePoints, as_simplices, closest_points
from heat_igl.operators import Laplacian
from heat_igl.sources import vertex_sources
from heat_igl.typing import BoolArray, FloatArray

# Positions and cells of small meshes, on which a first distance loads what every distance needs.
_PYRAMID = np.vstack([np.eye(3), -np.eye(3)[:2]]), [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]]
_CORNER = np.vstack([np.eye(3), np.zeros(3)]), [[0, 1, 2, 3]]

# Largest number of isolines; a larger number indicates a wrong spacing.
_MOST_LINES = 10000

CurvesOption = Annotated[
    Path, typer.Option(metavar="OBJ", help="Polylines (records l), as `isolines` and `path` write them; projected.")
]


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
        # On a small mesh first, so that times are of the work alone, and not of libraries that are loaded.
        is_tetrahedral = isinstance(loaded, Mesh) and loaded.is_tetrahedral
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _measured(Mesh(*_CORNER) if is_tetrahedral else Mesh(*_PYRAMID), 0, chosen, None)
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
    mesh: Mesh | PointCloud, sources: Any, choice: SolverChoice, cutoff: float | None, region: BoolArray | None = None
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
    if output.suffix.lower() == ".svg" and not is_flat(mesh):
        heat_igl.plots.write_line_drawing(output, mesh, curve)
    else:
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
        with errors_at(f"{path}, polyline {i}"):
            curves.append(heat_igl.curve_on(mesh, line.positions, closed=line.is_closed))
    return curves
