"""Commands for distances between many vertices: of one surface, or of all meshes of a folder."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, cast
from urllib.parse import unquote

import numpy as np
import scipy.io
import scipy.sparse as sp
import typer
from rich.console import Console

import heat_igl
from heat_igl.applications import Statistic
from heat_igl.cli import options as opt
from heat_igl.cli.options import Row, check_file, described, print_report, print_rows, say, wrote
from heat_igl.errors import BatchError
from heat_igl.io import complete_file, read_mesh
from heat_igl.mesh import Mesh
from heat_igl.runtime import n_threads
from heat_igl.typing import AnyArray, BoolArray, IntArray

if TYPE_CHECKING:
    from heat_igl.cluster import BatchReport

_DENSE, _SPARSE = (".npy", ".csv", ".mat"), (".npz", ".mat")
# Queries that are timed for the estimate: of six meshes, five are then estimated within 6 % (standard error) and one of
# parts within 10 %; with 16 within 12 and 20 %.
_QUERIES = 64
# Rows of a matrix that are made symmetric at a time, which bounds temporary arrays. From 32 to 512 the time differs by
# a third, with all of 6000 rows it is three times as long.
_ROWS = 512
# Meshes of a data set on which queries are timed for the estimate: of random folders of 60 meshes of 30 kinds half are
# within a factor of 1.26, and with 32 meshes 1.11.
_MESHES = 8


def matrix(
    mesh: opt.MeshArgument,
    output: Annotated[
        Path, typer.Option(help="NPY, CSV or MAT file; with --radius a sparse matrix: NPZ of scipy, or MAT.")
    ],
    radius: Annotated[float | None, typer.Option(help="Only distances up to this.", callback=opt.positive)] = None,
    parcels: Annotated[
        str | None,
        typer.Option(metavar="FILE|NAME", help="Between parcels: labels in an NPY, GIFTI or CIFTI file, or attribute."),
    ] = None,
    statistic: Annotated[str, opt.choice(Statistic, "Distance between two parcels.")] = "mean",
    region: opt.RegionOption = None,
    normalize: opt.NormalizeOption = False,
    dtype: opt.DtypeOption = "float32",
    json_file: opt.JsonOption = None,
) -> None:
    """Distances between all vertices, those within a radius, or parcels of a surface."""
    if radius is not None and parcels is not None:
        raise ValueError("--radius and --parcels ask for different matrices: leave one of them away")
    check_file("--output", output, "such matrices", _DENSE if radius is None else _SPARSE)
    loaded = read_mesh(mesh)
    mask = None if region is None else opt.region_mask(mesh, region)
    unit = float(np.sqrt(loaded.measures.sum())) if normalize else 1.0
    shows = Console(stderr=True).is_terminal
    with complete_file(output) as temporary:
        if radius is not None:
            found: Any = heat_igl.distances_within(loaded, radius, region=mask) / unit
        elif parcels is not None:
            labels = np.nan_to_num(opt.values_of(mesh, "--parcels", parcels), nan=-1).astype(np.int64)
            kind = cast(Statistic, statistic)
            found = heat_igl.parcel_distances(loaded, labels, statistic=kind, region=mask, progress=shows) / unit
        else:
            found = _all_pairs(loaded, temporary, output.suffix.lower(), np.dtype(dtype), mask, unit, shows)
        write_matrix(temporary, output.suffix.lower(), found)
    rows: list[Row] = [described(mesh, loaded), ("matrix", f"{found.shape[0]} by {found.shape[1]}", list(found.shape))]
    if sp.issparse(found):
        rows.append(("distances", str(found.nnz), found.nnz))
    print_rows([*rows, *wrote(output)], json_file)


def _all_pairs(
    mesh: Mesh, path: Path, suffix: str, dtype: np.dtype[Any], region: BoolArray | None, unit: float, shows: bool
) -> AnyArray:
    """Distances (n, n), in blocks, in the file at `path` as NPY; says first what it takes."""
    n = mesh.n_vertices
    solver = heat_igl.GeodesicSolver(mesh, tolerance=0, region=region)
    vertices = np.flatnonzero(mesh.referenced if region is None else solver.referenced)
    seconds = estimated_seconds(solver, vertices, suffix)
    size = n * n * dtype.itemsize / 1e6
    say(f"{n} by {n} distances: about {seconds:.0f} s on {n_threads()} threads, and {size:.0f} MB")
    out = np.lib.format.open_memmap(path, mode="w+", dtype=dtype, shape=(n, n))
    out[:] = np.inf
    with heat_igl.runtime.progress_bar("distances", len(vertices), shows) as advance:
        for vertex, row in zip(vertices, solver.iter_distances(vertices.tolist()), strict=True):
            out[vertex] = row / unit
            advance(1)
    make_symmetric(out)
    return out


def make_symmetric(matrix: AnyArray) -> None:
    """Give both entries of a pair the lesser: the distance and that of the way back may be rounded differently."""
    for start in range(0, len(matrix), _ROWS):
        rows = slice(start, start + _ROWS)
        lesser = np.minimum(matrix[rows, start:], matrix[start:, rows].T)
        matrix[rows, start:], matrix[start:, rows] = lesser, lesser.T


def estimated_seconds(solver: heat_igl.GeodesicSolver, vertices: IntArray, suffix: str) -> float:
    """About how long it takes to find distances from all these vertices and write them, from the time for some."""
    asked = np.random.default_rng(0).permutation(vertices)[:_QUERIES]
    with TemporaryDirectory() as folder:
        start = time.perf_counter()
        write_matrix(Path(folder) / f"rows{suffix}", suffix, solver.distances(asked.tolist()))
        return (time.perf_counter() - start) / len(asked) * len(vertices)


def write_matrix(path: Path, suffix: str, found: Any) -> None:
    """Write a matrix in the format of a suffix; nothing is done for an array that is the file already."""
    if suffix == ".mat":
        # On the way through memory, since the file may be the array. The format has no float16.
        scipy.io.savemat(
            path,
            {"distance": found if sp.issparse(found) else np.array(found, np.promote_types(found.dtype, np.float32))},
            appendmat=False,
        )
    elif suffix == ".npz":
        with path.open("wb") as file:
            sp.save_npz(file, found)
    elif suffix == ".csv":
        np.savetxt(path, np.array(found), delimiter=",", fmt="%.9g")  # through memory, too
    elif not isinstance(found, np.memmap):
        with path.open("wb") as file:
            np.save(file, found)


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
    with cluster.connected(scheduler, workers, dashboard) as client, _logged(log):
        if dashboard:
            say(f"dashboard: {client.dashboard_link}")
        report = cluster.distances(
            meshes, plan, store, client=client, method=cast(Any, method), tolerance=tolerance, dtype=dtype,
            normalize=normalize, points=points, progress=Console(stderr=True).is_terminal,
        )  # fmt: skip
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
    store = output / "distances.zarr"
    with cluster.connected(None, workers) as client, _logged(None):
        say(_estimate(client, list(meshes.values()), np.dtype(dtype).itemsize, form))
        report = cluster.distances(
            meshes, "all", store, client=client, method="exact", tolerance=0, dtype=dtype, normalize=normalize,
            progress=Console(stderr=True).is_terminal,
        )  # fmt: skip
    for row in report.rows if form != "zarr" else ():
        if row.status == "done":
            found = cluster.read_distances(store, row.name)
            make_symmetric(found)
            file = output / f"{unquote(row.name)}.{form}"
            file.parent.mkdir(parents=True, exist_ok=True)
            with complete_file(file) as temporary:
                write_matrix(temporary, f".{form}", found)
    _finish(report, json_file)


def _estimate(client: Any, paths: list[Path], itemsize: int, form: str) -> str:
    """What all pairs take, from some of the meshes, as the workers find it."""
    sample, n_workers = paths[:: -(-len(paths) // _MESHES)], len(client.nthreads())
    found = client.gather(client.map(_all_pairs_of, sample, suffix=".mat" if form == "mat" else ".npy", pure=False))
    seconds, n_pairs, timed = (sum(column) for column in zip(*found, strict=True))
    # Both grow with the square of a file's length.
    share = sum(path.stat().st_size ** 2 for path in paths) / max(timed, 1)
    return (
        f"all pairs on {len(paths)} meshes: about {seconds * share / n_workers:.0f} s "
        f"with {n_workers} workers, and {n_pairs * itemsize * share / 1e6:.0f} MB; "
        "beginning and ending a mesh in the store takes some hundredths of a second more"
    )


def _all_pairs_of(path: Path, suffix: str) -> tuple[float, int, int]:
    """Seconds, pairs and the square of the file's length; a mesh that cannot be read fails later, with its reason."""
    with suppress(ValueError, OSError, BatchError):
        start = time.perf_counter()
        mesh = heat_igl.read_mesh(path)
        solver, vertices = heat_igl.GeodesicSolver(mesh, tolerance=0), np.arange(mesh.n_vertices)
        seconds = time.perf_counter() - start + estimated_seconds(solver, vertices, suffix)
        return seconds, mesh.n_vertices**2, path.stat().st_size ** 2
    return 0.0, 0, 0


def _finish(report: BatchReport, json_file: Path | None) -> None:
    """Print the report of a batch; the status is 1 if anything is missing."""
    print_report(report.to_dict(), report.to_markdown(), json_file)
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
