"""The command for distances between many vertices of one surface."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, cast

import numpy as np
import scipy.io
import scipy.sparse as sp
import typer
from rich.console import Console

import heat_igl
from heat_igl.applications import Statistic
from heat_igl.cli import options as opt
from heat_igl.cli.output import Row, check_writable, described, print_rows, say, wrote
from heat_igl.io import complete_file, read_mesh
from heat_igl.mesh import Mesh
from heat_igl.runtime import n_threads
from heat_igl.typing import AnyArray, BoolArray, IntArray

_DENSE, _SPARSE = (".npy", ".csv", ".mat"), (".npz", ".mat")
# Queries that are timed for the estimate: the time of one varies by up to two thirds of the mean on a mesh of parts.
_SAMPLE = 64
_ROWS = 512


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
    suffixes = _DENSE if radius is None else _SPARSE
    if output.suffix.lower() not in suffixes:
        raise ValueError(f"--output {output}: such a matrix goes to {', '.join(suffixes)} files")
    if radius is not None and parcels is not None:
        raise ValueError("--radius and --parcels ask for different matrices: leave one of them away")
    check_writable(output)
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
    asked = np.random.default_rng(0).permutation(vertices)[:_SAMPLE]
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
        np.savetxt(path, found, delimiter=",", fmt="%.9g")
    elif not isinstance(found, np.memmap):
        with path.open("wb") as file:
            np.save(file, found)
