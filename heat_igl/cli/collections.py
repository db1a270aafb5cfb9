"""The command for many meshes."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from heat_igl.cli.options import JsonOption, MethodOption, PointsOption, ToleranceOption, one_of
from heat_igl.cli.output import check_json, print_json, prints_json, say

__all__ = ["batch"]


def batch(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of meshes, searched with all below it.")],
    store: Annotated[Path, typer.Option(help="Zarr directory for the distances; continued if it is there.")],
    sources: Annotated[
        str, typer.Option(metavar="all|farthest:K|FILE", help="Source sets; in a file, vertex indices, one set a line.")
    ] = "all",
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler; else this machine.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes on this machine; one a processor.")] = None,
    method: MethodOption = None,
    tolerance: ToleranceOption = 1e-5,
    dtype: Annotated[str, typer.Option(help="Of the distances.", callback=one_of(("float32", "float64")))] = "float32",
    points: PointsOption = False,
    log: Annotated[Path | None, typer.Option(help="File for a log of meshes and blocks.")] = None,
    dashboard: Annotated[bool, typer.Option(help="Serve Dask's dashboard (needs bokeh).")] = False,
    json_file: JsonOption = None,
) -> None:
    """Distances on every mesh of a folder, written to a store; resumes if it was interrupted."""
    from heat_igl import cluster

    check_json(json_file)
    meshes = cluster.folder(folder, points)
    plan = sources if sources == "all" or sources.startswith("farthest:") else cluster.read_source_sets(sources)
    options: dict[str, Any] = {
        "method": method,
        "tolerance": tolerance,
        "dtype": dtype,
        "points": points,
        "progress": Console(stderr=True).is_terminal,
    }
    with cluster.connected(scheduler, workers, dashboard) as client, _logged(log):
        if dashboard:
            say(f"dashboard: {client.dashboard_link}")
        report = cluster.distances(meshes, plan, store, client=client, **options)
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
