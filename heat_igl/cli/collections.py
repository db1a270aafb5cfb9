"""The commands for many meshes."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import unquote

import numpy as np
import typer
from rich.console import Console

import heat_igl
from heat_igl.cli import options as opt
from heat_igl.cli.matrices import estimated_seconds, make_symmetric, write_matrix
from heat_igl.cli.output import print_json, prints_json, say
from heat_igl.errors import BatchError
from heat_igl.io import complete_file
from heat_igl.runtime import n_threads

if TYPE_CHECKING:
    from heat_igl.cluster import BatchReport

# Meshes of a data set on which queries are timed for the estimate.
_SAMPLE = 8


def batch(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of meshes, searched with all below it.")],
    store: Annotated[Path, typer.Option(help="Zarr directory for the distances; continued if it is there.")],
    sources: Annotated[
        str, typer.Option(metavar="all|farthest:K|FILE", help="Source sets; in a file, vertex indices, one set a line.")
    ] = "all",
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler; else this machine.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes on this machine; one a processor.")] = None,
    method: opt.MethodOption = None,
    tolerance: opt.ToleranceOption = 1e-5,
    dtype: opt.DtypeOption = "float32",
    normalize: opt.NormalizeOption = False,
    points: opt.PointsOption = False,
    log: Annotated[Path | None, typer.Option(help="File for a log of meshes and blocks.")] = None,
    dashboard: Annotated[bool, typer.Option(help="Serve Dask's dashboard (needs bokeh).")] = False,
    json_file: opt.JsonOption = None,
) -> None:
    """Distances on every mesh of a folder, written to a store; resumes if it was interrupted."""
    from heat_igl import cluster

    meshes = cluster.folder(folder, points)
    plan = sources if sources == "all" or sources.startswith("farthest:") else cluster.read_source_sets(sources)
    options: dict[str, Any] = {
        "method": method,
        "tolerance": tolerance,
        "dtype": dtype,
        "normalize": normalize,
        "points": points,
        "progress": Console(stderr=True).is_terminal,
    }
    with cluster.connected(scheduler, workers, dashboard) as client, _logged(log):
        if dashboard:
            say(f"dashboard: {client.dashboard_link}")
        report = cluster.distances(meshes, plan, store, client=client, **options)
    _finish(report, json_file)


def dataset(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of meshes, searched with all below it.")],
    output: Annotated[Path, typer.Argument(metavar="OUTPUT", help="Folder for the files; continued if it is there.")],
    form: Annotated[
        str,
        typer.Option("--format", help="Of the files, one for each mesh.", callback=opt.one_of(("npy", "mat", "zarr"))),
    ] = "npy",
    normalize: opt.NormalizeOption = False,
    dtype: opt.DtypeOption = "float32",
    workers: Annotated[int | None, typer.Option(min=1, help="Processes on this machine; one a processor.")] = None,
    json_file: opt.JsonOption = None,
) -> None:
    """Exact distances between all pairs of vertices on every mesh of a folder, as symmetric matrices in files."""
    from heat_igl import cluster

    meshes = cluster.folder(folder)
    options: dict[str, Any] = {"method": "exact", "tolerance": 0, "dtype": dtype, "normalize": normalize}
    store = output / "distances.zarr"
    with cluster.connected(None, workers) as client, _logged(None):
        say(_estimate(list(meshes.values()), np.dtype(dtype).itemsize, form, len(client.nthreads())))
        report = cluster.distances(
            meshes, "all", store, client=client, progress=Console(stderr=True).is_terminal, **options
        )
    for row in report.rows if form != "zarr" else ():
        if row.status == "done":
            found = cluster.read_distances(store, row.name)
            make_symmetric(found)
            file = output / f"{unquote(row.name)}.{form}"
            file.parent.mkdir(parents=True, exist_ok=True)
            with complete_file(file) as temporary:
                write_matrix(temporary, f".{form}", found)
    _finish(report, json_file)


def _estimate(paths: list[Path], itemsize: int, form: str, n_workers: int) -> str:
    """What all pairs take, from some of the meshes; a mesh that cannot be read fails later, with its reason."""
    seconds = size = timed = 0.0
    for path in paths[:: -(-len(paths) // _SAMPLE)]:
        with suppress(ValueError, OSError, BatchError):
            mesh = heat_igl.read_mesh(path)
            solver, vertices = heat_igl.GeodesicSolver(mesh, tolerance=0), np.arange(mesh.n_vertices)
            seconds += estimated_seconds(solver, vertices, ".mat" if form == "mat" else ".npy")
            size += mesh.n_vertices**2 * itemsize / 1e6
            timed += path.stat().st_size ** 2
    # Both grow with the square of a file's length.
    share = sum(path.stat().st_size ** 2 for path in paths) / max(timed, 1)
    return (
        f"all pairs on {len(paths)} meshes: about {seconds * share * n_threads() / n_workers:.0f} s "
        f"with {n_workers} workers, and {size * share:.0f} MB"
    )


def _finish(report: BatchReport, json_file: Path | None) -> None:
    """Print the report of a batch; the status is 1 if anything is missing."""
    if json_file is not None:
        print_json(report.to_dict(), json_file)
    if not prints_json(json_file):
        print(report.to_markdown(), end="")
    if report.failed or report.unfinished:
        raise typer.Exit(1)


@contextmanager
def _logged(path: Path | None) -> Iterator[None]:
    """Write the log of the batch to a file. Messages of Dask about lost connections are suppressed."""
    for name in ("distributed", "distributed.client", "tornado.application", "asyncio"):  # each has a separate level
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
