"""The command line: the package's words, one line per error, no half-written files.

Imported by `heat_igl.__main__` only; needs the extra ``cli``.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, cast, get_args

import numpy as np
import typer
from rich.console import Console
from rich.progress import Progress
from rich.text import Text

import heat_igl
from heat_igl.drawing import PAGE_SUFFIXES, PICTURE_SUFFIXES, Picture
from heat_igl.errors import (
    AccuracyWarning,
    BatchError,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
)
from heat_igl.heat_method import HeatMethodSolver, Magnitude
from heat_igl.io import CURVE_SUFFIXES, complete_file, read_mesh, write_mesh
from heat_igl.linear import Backend
from heat_igl.mesh import Mesh, closest_points
from heat_igl.operators import Laplacian
from heat_igl.reference.guarded import TIMEOUT
from heat_igl.sources import vertex_sources
from heat_igl.steps import Boundary
from heat_igl.typing import FloatArray
from heat_igl.unfolding import Refine
from heat_igl.validation import METHODS, draw_sources

__all__ = ["app", "run"]

# What a user can cause; anything else is a fault of the package and shows its traceback.
_EXPECTED = (OSError, ValueError, BatchError, FactorizationError, ReferenceSolverError, MissingExtraError, MemoryError)

# More isolines than this are a mistaken spacing.
_MOST_LINES = 10000

_DEFAULT_METHODS = "heat,sweep,unfold,meshlab,igl"

app = typer.Typer(
    help="Geodesic distance on meshes by the heat method.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def run(arguments: Sequence[str]) -> int:
    """Run one command and return the exit status: 0, 1 for errors, 2 for wrong usage, 130 when interrupted."""
    command = typer.main.get_command(app)
    try:
        # Not command.main, whose own handling of errors and of Ctrl-C differs between versions of typer.
        with (
            _warnings_on_one_line(),
            command.make_context("heat-igl", list(arguments) or ["--help"]) as context,
        ):
            command.invoke(context)
            sys.stdout.flush()
    except typer.Exit as error:
        return error.exit_code
    except (KeyboardInterrupt, typer.Abort):
        _say("interrupted")
        return 130
    except BrokenPipeError:
        # Whoever read the output has left. Python flushes once more at exit, which must not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except _EXPECTED as error:
        _say(_one_line(error))
        return 1
    except Exception as error:
        # typer's usage errors have no public class in common over its versions.
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        _say(f"{message()} (see heat-igl --help)")
        return int(getattr(error, "exit_code", 2))
    return 0


def _say(message: str) -> None:
    print(f"heat-igl: {' '.join(message.split())}", file=sys.stderr)


def _one_line(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return f"out of memory: {error}" if str(error) else "out of memory"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error) or type(error).__name__


@contextmanager
def _warnings_on_one_line() -> Iterator[None]:
    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        _say(f"warning: {message}")

    with warnings.catch_warnings():
        warnings.simplefilter("always", AccuracyWarning)
        warnings.showwarning = show
        yield


def _print_rows(rows: Sequence[tuple[str, str]]) -> None:
    """Print names and values as two columns."""
    width = max(len(name) for name, _ in rows)
    console = Console(highlight=False, soft_wrap=True)  # a line is a line, also in a pipe
    for name, value in rows:
        console.print(Text.assemble((f"{name:{width}}", "bold"), f"  {value}"))


def _check_writable(path: Path) -> None:
    """Make sure that a file can be written to `path`, before any work is done for it.

    Raises
    ------
    OSError
        If it cannot.
    """
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a directory: name a file in it")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path} cannot be written: there is no directory {path.parent}")
    try:
        # Permissions alone do not tell: the file system may be read-only.
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OSError(f"{path} cannot be written: {error.strerror}") from error


def _one_of(choices: tuple[str, ...]) -> Callable[[str | None], str | None]:
    def check(value: str | None) -> str | None:
        if value is not None and value not in choices:
            raise typer.BadParameter(f"{value!r} is not one of {', '.join(choices)}")
        return value

    return check


def _positive(value: float | None) -> float | None:
    if value is not None and not (np.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value:g} is not a positive number")
    return value


def _choice(kind: Any, text: str) -> Any:
    choices = get_args(kind)
    return typer.Option(help=text, metavar="|".join(choices), callback=_one_of(choices))


MeshArgument = Annotated[Path, typer.Argument(metavar="MESH", help="OFF, OBJ, PLY, STL, MESH, MSH or VTU file.")]


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False) -> None:
    if version:
        print(heat_igl.__version__)
        raise typer.Exit


@app.command()
def info(mesh: MeshArgument) -> None:
    """Describe a mesh: sizes, defects, and what bears on distances."""
    _print_rows(read_mesh(mesh).report().rows())


@app.command()
def distance(
    mesh: MeshArgument,
    source: Annotated[list[int] | None, typer.Option(help="Source vertex, counted from 0; repeat for several.")] = None,
    at: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,Z", help="Source at the closest point of the surface; repeatable.")
    ] = None,
    cutoff: Annotated[float | None, typer.Option(help="Distances beyond this are inf.", callback=_positive)] = None,
    output: Annotated[Path | None, typer.Option(help="PLY or VTU file for mesh and distance.")] = None,
    picture: Annotated[Path | None, typer.Option(help="PNG, PDF or SVG file for a picture.")] = None,
    t_coef: Annotated[
        float | None, typer.Option(help="Time step in squared mean edge lengths.", callback=_positive)
    ] = None,
    t: Annotated[float | None, typer.Option(help="Time step, a squared length.", callback=_positive)] = None,
    laplacian: Annotated[str, _choice(Laplacian, "Triangulation to solve on.")] = "auto",
    boundary: Annotated[str, _choice(Boundary, "What heat does at the boundary.")] = "neumann",
    magnitude: Annotated[str, _choice(Magnitude, "Length of the field that is integrated.")] = "auto",
    refine: Annotated[str | None, _choice(Refine, "Unfold triangles in heat order: near-exact.")] = None,
    backend: Annotated[str, _choice(Backend, "Linear solver.")] = "auto",
) -> None:
    """Distance from one or more sources: vertices, or points of the surface."""
    loaded = read_mesh(mesh)
    if not source and not at:
        raise SourceError("no source: name vertices with --source, or positions with --at x,y,z")
    vertices = vertex_sources(np.array(source), loaded.n_vertices) if source else None
    sources: Any = vertices
    gaps: list[tuple[str, str]] = []
    if at:
        points, gap = closest_points(loaded, [_position(text) for text in at])
        sources = points if vertices is None else [vertices, points]
        gaps = [("off the surface", ", ".join(f"{each:.6g}" for each in gap))]
    _check_outputs(loaded, output, picture)
    with Console(stderr=True).status("factoring"):
        options: dict[str, Any] = {
            "laplacian": laplacian,
            "boundary": boundary,
            "magnitude": magnitude,
            "refine": refine,
            "backend": backend,
        }
        solver = HeatMethodSolver(loaded, t_coef=t_coef, t=t, **options)
    start = time.perf_counter()
    phi = solver.distance(sources, cutoff=cutoff)
    seconds = time.perf_counter() - start
    written = _write(loaded, phi, vertices, output, picture)
    _print_rows([*_summary(mesh, loaded, phi, solver, seconds), *gaps, *(("wrote", str(path)) for path in written)])


@app.command()
def isolines(
    mesh: MeshArgument,
    source: Annotated[list[int], typer.Option(help="Source vertex, counted from 0; repeat for several.")],
    spacing: Annotated[float, typer.Option(help="Distance from one line to the next.", callback=_positive)],
    output: Annotated[Path, typer.Option(help="OBJ, SVG (flat meshes) or DXF file for the lines.")],
    refine: Annotated[str | None, _choice(Refine, "Unfold triangles in heat order: near-exact.")] = None,
) -> None:
    """Curves of equal distance from one or more source vertices."""
    loaded = read_mesh(mesh)
    sources = vertex_sources(np.array(source), loaded.n_vertices)
    _check_curves(output)
    phi = HeatMethodSolver(loaded, refine=cast(Refine | None, refine)).distance(sources)
    farthest = float(phi[np.isfinite(phi)].max())
    if farthest < spacing:
        raise ValueError(f"--spacing {spacing:g} makes no line: the farthest vertex is at {farthest:.3g}")
    if farthest > _MOST_LINES * spacing:
        raise ValueError(
            f"--spacing {spacing:g} makes over {_MOST_LINES} lines up to {farthest:.3g}: choose a larger one"
        )
    levels = spacing * np.arange(1, int(farthest / spacing) + 1)
    curves = heat_igl.isolines(loaded, phi, levels)
    heat_igl.write_curves(output, loaded, {f"{level:g}": each for level, each in zip(levels, curves, strict=True)})
    rows = [("farthest", f"{farthest:.6g}"), ("lines", f"{sum(map(len, curves))} at {len(levels)} distances")]
    _print_rows([*rows, ("wrote", str(output))])


@app.command()
def path(
    mesh: MeshArgument,
    start: Annotated[int, typer.Option("--from", help="Vertex where the path begins, counted from 0.")],
    end: Annotated[int, typer.Option("--to", help="Vertex where it ends.")],
    output: Annotated[Path, typer.Option(help="OBJ, SVG (flat meshes) or DXF file for the path.")],
) -> None:
    """A locally shortest path between two vertices."""
    loaded = read_mesh(mesh)
    for option, vertex in (("--from", start), ("--to", end)):
        if not 0 <= vertex < loaded.n_vertices:
            raise SourceError(f"{option} {vertex} is no vertex: the mesh has {loaded.n_vertices}, counted from 0")
    _check_curves(output)
    found = heat_igl.shortest_paths(loaded, HeatMethodSolver(loaded, refine="unfold"), start, end)
    heat_igl.write_curves(output, loaded, found)
    length = float(found[0].lengths(loaded).sum())
    _print_rows([("length", f"{length:.6g}"), ("segments", str(len(found[0]))), ("wrote", str(output))])


@app.command()
def validate(
    mesh: MeshArgument,
    sources: Annotated[int, typer.Option(min=1, help="Single source vertices, one distance from each.")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="For drawing them.")] = 0,
    methods: Annotated[str, typer.Option(help=f"Separated by commas: {', '.join(METHODS)}.")] = _DEFAULT_METHODS,
    reference: Annotated[str, typer.Option(help="Method to measure errors against.")] = "exact",
    timeout: Annotated[float, typer.Option(help="Seconds for one native solve.", callback=_positive)] = TIMEOUT,
    json_file: Annotated[Path | None, typer.Option("--json", help="JSON file for the report.")] = None,
    picture: Annotated[Path | None, typer.Option(help="PNG, PDF or SVG file for errors on the surface.")] = None,
    fail_above: Annotated[
        float | None,
        typer.Option(metavar="PERCENT", help="Exit with 1 if a mean error is larger.", callback=_positive),
    ] = None,
) -> None:
    """How far each method is from a reference, and what it costs."""
    loaded = read_mesh(mesh)
    drawn_sources = draw_sources(loaded, sources, seed)
    _check_outputs(loaded, None, picture)
    if json_file is not None:
        _check_writable(json_file)
    console = Console(stderr=True)
    # Where nobody watches, not even the empty line that a finished bar leaves.
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)
        report = heat_igl.validate(
            loaded, drawn_sources, [name.strip() for name in methods.split(",")], reference, name=mesh.stem,
            timeout=timeout,
            progress=lambda label, done, total: bar.update(task, description=label, completed=done, total=total),
        )  # fmt: skip
    if picture is not None:
        Picture(report.plot()).save(picture)
    if json_file is not None:
        with complete_file(json_file) as temporary:
            temporary.write_bytes((json.dumps(report.to_dict(), indent=1, allow_nan=False) + "\n").encode("utf8"))
    print(report.to_markdown(), end="")
    exceeding = report.exceeding(fail_above) if fail_above is not None else ()
    if exceeding:
        names = ", ".join(row.method for row in exceeding)
        _say(f"no mean error of at most {fail_above:g} % for {names}")
        raise typer.Exit(1)


@app.command()
def view(
    mesh: MeshArgument,
    source: Annotated[list[int] | None, typer.Option(help="Source vertex to start with; repeat for several.")] = None,
    t_coef: Annotated[
        float | None, typer.Option(help="Time step in squared mean edge lengths.", callback=_positive)
    ] = None,
    boundary: Annotated[str, _choice(Boundary, "What heat does at the boundary.")] = "neumann",
    refine: Annotated[str | None, _choice(Refine, "Unfold triangles in heat order: near-exact.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write an interactive page to this file; no window.")] = None,
) -> None:
    """A window in which a click moves the source and the distance follows; where there is no display, a page."""
    from heat_igl.drawing.viewer import Exploration, Options, Window, display_problem

    loaded = read_mesh(mesh)
    sources = vertex_sources(np.array(source or [0]), loaded.n_vertices)
    chosen: dict[str, Any] = {"boundary": boundary, "refine": refine}
    target = html or Path(f"{mesh.stem}-view.html")
    problem = None if html else display_problem()
    if html or problem:
        _check_page(target)
    with Console(stderr=True).status("factoring"):
        shown = Exploration(loaded, sources, Options(t_coef=t_coef, **chosen))
    if html is None and problem is None:
        try:
            window = Window(shown, title=f"heat-igl: {mesh.name}")
        except RuntimeError as error:
            problem = str(error)
            _check_page(target)
        else:
            window.run()
            return
    from heat_igl.drawing import write_html

    kind = f"unfolded in heat order (refine = {refine})" if refine else "the heat method"
    write_html(
        target, loaded, shown.distance, sources=sources, title=mesh.name,
        method=f"Distance by {kind}, t = {shown.t_coef:.3g} h^2, boundary {boundary}.",
    )  # fmt: skip
    if problem:
        _say(f"no window: {problem}")
    _print_rows([("mesh", f"{mesh}: {loaded.n_vertices} vertices"), ("wrote", f"{target} (open it in a browser)")])


def _check_page(path: Path) -> None:
    if path.suffix.lower() not in PAGE_SUFFIXES:
        raise ValueError(f"--html {path}: pages go to {' or '.join(PAGE_SUFFIXES)} files")
    _require("matplotlib", "a page", "view")
    _check_writable(path)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Directory for the results; made if missing.")] = Path("heat-igl-demo"),
) -> None:
    """The whole job on a real mesh: distance, error against exact, files, picture."""
    from heat_igl.demo import demonstrate

    out.mkdir(parents=True, exist_ok=True)
    _check_writable(out / "demo.png")
    _print_rows(demonstrate(out))


@app.command()
def batch(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of meshes, searched with all below it.")],
    store: Annotated[Path, typer.Option(help="Zarr directory for the distances; continued if it is there.")],
    sources: Annotated[
        str, typer.Option(metavar="all|farthest:K|FILE", help="Source sets; in a file, vertex indices, one set a line.")
    ] = "all",
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler; else this machine.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes on this machine; one a processor.")] = None,
    refine: Annotated[str | None, _choice(Refine, "Unfold triangles in heat order: near-exact.")] = None,
    dtype: Annotated[str, typer.Option(help="Of the distances.", callback=_one_of(("float32", "float64")))] = "float32",
    log: Annotated[Path | None, typer.Option(help="File for a log of meshes and blocks.")] = None,
    dashboard: Annotated[bool, typer.Option(help="Serve Dask's dashboard (needs bokeh).")] = False,
) -> None:
    """Distances on every mesh of a folder, into a store, on all processors or a cluster; resumes where it stopped."""
    from heat_igl import cluster

    meshes = cluster.folder(folder)
    plan = sources if sources == "all" or sources.startswith("farthest:") else cluster.read_source_sets(sources)
    options: dict[str, Any] = {"refine": refine, "dtype": dtype, "progress": Console(stderr=True).is_terminal}
    with cluster.connected(scheduler, workers, dashboard) as client, _logged(log):
        if dashboard:
            _say(f"dashboard: {client.dashboard_link}")
        report = cluster.distances(meshes, plan, store, client=client, **options)
    print(report.to_markdown(), end="")
    if report.failed:
        raise typer.Exit(1)


@contextmanager
def _logged(path: Path | None) -> Iterator[None]:
    """Write what the batch logs to a file; what Dask logs about lost connections is told in one line at the end."""
    for name in ("distributed", "distributed.client", "tornado.application", "asyncio"):  # each has a level of its own
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    if path is None:
        yield
        return
    handler = logging.FileHandler(path, encoding="utf8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logger = logging.getLogger("heat_igl.cluster")
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        handler.close()


def _position(text: str) -> list[float]:
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        raise SourceError(f"--at {text}: three numbers separated by commas are expected, such as 0.5,0,1.25") from None
    return [x, y, z]


def _check_outputs(mesh: Mesh, output: Path | None, picture: Path | None) -> None:
    if output is not None:
        accepted = (".vtu",) if mesh.is_tetrahedral else (".ply", ".vtu")
        if output.suffix.lower() not in accepted:
            kind = "tetrahedra with distances" if mesh.is_tetrahedral else "distances"
            raise MeshError(f"--output {output}: {kind} go to {' or '.join(accepted)} files")
        if output.suffix.lower() == ".vtu":
            _require("meshio", "a .vtu file", "io")
        _check_writable(output)
    if picture is not None:
        if picture.suffix.lower() not in PICTURE_SUFFIXES:
            raise ValueError(f"--picture {picture}: pictures go to {', '.join(PICTURE_SUFFIXES)} files")
        _require("matplotlib", "a picture", "view")
        _check_writable(picture)


def _check_curves(output: Path) -> None:
    if output.suffix.lower() not in CURVE_SUFFIXES:
        raise ValueError(f"--output {output}: curves go to {', '.join(CURVE_SUFFIXES)} files")
    if output.suffix.lower() == ".dxf":
        _require("ezdxf", "a .dxf file", "io")
    _check_writable(output)


def _require(package: str, purpose: str, extra: str) -> None:
    from importlib.util import find_spec

    if find_spec(package) is None:
        raise MissingExtraError.of(purpose, package, extra)


def _write(mesh: Mesh, phi: FloatArray, sources: Any, output: Path | None, picture: Path | None) -> list[Path]:
    drawn = None
    if picture is not None:
        from heat_igl.drawing import plot

        # Drawn before anything is written, since it is what may still fail.
        with Console(stderr=True).status("drawing"):
            drawn = plot(mesh, phi, sources=sources)
    if output is not None:
        write_mesh(output, mesh, distance=phi)
    if drawn is not None and picture is not None:
        drawn.save(picture)
    return [path for path in (output, picture) if path is not None]


def _summary(
    path: Path, mesh: Mesh, phi: FloatArray, solver: HeatMethodSolver, seconds: float
) -> list[tuple[str, str]]:
    found = solver.diagnostics
    finite = np.isfinite(phi)
    farthest = int(np.argmax(np.where(finite, phi, -1.0)))
    kind = "tetrahedra" if mesh.is_tetrahedral else "triangles"
    raised = " (raised, so that heat crosses the mesh in double precision)" if found.t_raised else ""
    rows = [
        ("mesh", f"{path}: {mesh.n_vertices} vertices, {mesh.n_faces} {kind}"),
        ("farthest", f"{phi[farthest]:.6g} at vertex {farthest}"),
        ("mean", f"{phi[finite].mean():.6g}"),
        ("time step", f"{found.t:.6g}{raised}"),
        ("flipped edges", str(found.n_flips)),
        ("seconds", f"{found.seconds_operators + found.seconds_factorization:.3f} once, {seconds:.3f} per distance"),
    ]
    if not finite.all():
        rows.insert(2, ("unreachable", f"{int((~finite).sum())} vertices"))
    return rows
