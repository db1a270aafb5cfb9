"""Batches on Dask: rate of two workers against one, overhead over a plain loop, and memory against its estimate.

    python scripts/cluster_table.py                     # 200 generated meshes, 64 sources each
    python scripts/cluster_table.py --meshes 20         # a shorter look
    python scripts/cluster_table.py --add FOLDER        # real meshes among them
    python scripts/cluster_table.py --docs docs/cluster.md    # also writes the tables of that page

The plain loop reads each file, makes a solver, solves, and saves one file of float32. All use one thread a process; the
three take turns, so that what else happens on the machine hits them alike. Writes cluster_table.json and .md. Needs the
extra ``cluster``.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import igl
import numpy as np

from heat_igl import HeatMethodSolver, Mesh, cluster, read_mesh, shapes, write_mesh
from heat_igl.cluster.memory import PROCESS_MEMORY, solver_memory

from scaffold import environment, option_parser, publish, table, write_parts

SOURCES = 64
MEMORY_SIZES = (3, 5, 6, 7)  # subdivisions of the icosphere


def collect(folder: Path, count: int, real: Path | None) -> int:
    """Write `count` meshes, `real` ones and others of 10 000 to 16 000 vertices; returns how many there are."""
    folder.mkdir()
    written = 0
    if real is not None:
        for path in sorted(real.iterdir()):
            if path.is_file() and path.suffix in (".off", ".obj", ".ply") and read_mesh(path).n_vertices >= SOURCES:
                shutil.copy(path, folder / path.name)
                written += 1
    rng = np.random.default_rng(0)
    while written < count:
        kind = written % 4
        mesh = (
            shapes.icosphere(5) if kind == 0
            else shapes.torus(140 + written % 30, 80) if kind == 1
            else shapes.grid(100 + written % 25) if kind == 2
            else shapes.cylinder(120, 90 + written % 20)
        )  # fmt: skip
        stretched = Mesh(mesh.V * rng.uniform(0.5, 2, 3), mesh.F)
        write_mesh(folder / f"{written:04d}.ply", stretched)
        written += 1
    return written


def plain_loop(folder: Path, out: Path) -> None:
    """What a user would write without a batch."""
    out.mkdir()
    for path in sorted(folder.iterdir()):
        distances = HeatMethodSolver(read_mesh(path)).distances(list(range(SOURCES)))
        np.save(out / f"{path.name}.npy", distances.astype(np.float32))


def seconds_of_loop(folder: Path, out: Path) -> float:
    """Time of the loop in a process of its own, without its imports."""
    environ = {**os.environ, **{f"{name}_NUM_THREADS": "1" for name in ("HEAT_IGL", "OMP", "OPENBLAS", "MKL")}}
    result = subprocess.run(
        [sys.executable, __file__, "--loop", str(folder), str(out)],
        env=environ,
        capture_output=True,
        text=True,
        check=True,
    )
    return float(result.stdout)


def seconds_of_batch(folder: Path, store: Path, workers: int) -> float:
    """Time of a batch, without starting and stopping the workers; checks that no mesh failed."""
    with cluster.connected(n_workers=workers) as client:
        client.run(_warm)
        start = time.perf_counter()
        report = cluster.distances(cluster.folder(folder), list(range(SOURCES)), store, client=client)
        seconds = time.perf_counter() - start
    if report.failed:
        raise RuntimeError(f"{report.failed[0].mesh}: {report.failed[0].reason}")
    return seconds


def _warm() -> None:
    """Imports, which the loop's time does not include either."""
    import zarr  # noqa: F401

    import heat_igl.cluster.worker  # noqa: F401

    HeatMethodSolver(shapes.icosphere(2)).distance(0)


def same_bits(store: Path, out: Path) -> bool:
    """Whether the store holds what the loop saved."""
    import zarr

    return all(
        np.array_equal(np.load(path), zarr.open_group(store / path.stem, mode="r")["distance"][:])
        for path in out.iterdir()
    )


def _peak() -> int:
    status = Path("/proc/self/status").read_text()
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM"))) * 1024


def memory(name: str, mesh: Mesh, method: str) -> dict[str, Any]:
    """Peak memory of a worker that does one mesh, beside the bound that the batch states for it."""
    with tempfile.TemporaryDirectory() as scratch, cluster.connected(n_workers=1) as client:
        sources = list(range(2 * SOURCES))
        cluster.distances({name: mesh}, sources, Path(scratch) / "store", client=client, method=method)
        (peak,) = client.run(_peak).values()
    stated = PROCESS_MEMORY + solver_memory(mesh)
    return {
        "mesh": name,
        "vertices": mesh.n_vertices,
        "method": method,
        "peak": peak,
        "stated": stated,
        "ratio": peak / stated,
    }


def memory_meshes(real: Path | None) -> list[tuple[str, Mesh]]:
    """Spheres, and the largest of the real meshes with each triangle cut into four."""
    meshes = [(f"sphere {size}", shapes.icosphere(size)) for size in MEMORY_SIZES]
    if real is not None:
        paths = [path for path in sorted(real.iterdir()) if path.suffix in (".off", ".obj", ".ply")]
        largest = max(paths, key=lambda path: read_mesh(path).n_vertices)
        mesh = read_mesh(largest)
        meshes.append((largest.stem, Mesh(*igl.upsample(mesh.V, mesh.F))))
    return meshes


def rates(count: int, real: Path | None, repeats: int) -> dict[str, Any]:
    """Times of the loop and of one and two workers, in turns."""
    times: dict[str, list[float]] = {"loop": [], "one worker": [], "two workers": []}
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch)
        n = collect(root / "meshes", count, real)
        for turn in range(repeats):
            times["loop"].append(seconds_of_loop(root / "meshes", root / f"loop{turn}"))
            for workers, name in ((1, "one worker"), (2, "two workers")):
                times[name].append(seconds_of_batch(root / "meshes", root / f"{name} {turn}", workers))
        same = same_bits(root / "two workers 0", root / "loop0")
    return {
        "meshes": n,
        "seconds": times,
        "same_bits": same,
        "rate_of_two": statistics.median(a / b for a, b in zip(times["one worker"], times["two workers"], strict=True)),
        "overhead": statistics.median(a / b for a, b in zip(times["one worker"], times["loop"], strict=True)) - 1,
    }


def markdown(result: dict[str, Any]) -> str:
    rate = result["rates"]
    memory_cells = [
        (
            row["mesh"],
            f"{row['vertices']}",
            row["method"],
            *(f"{row[name] / 2**20:.0f}" for name in ("peak", "stated")),
            f"{row['ratio']:.2f}",
        )
        for row in result["memory"]
    ]
    lines = [
        f"{rate['meshes']} meshes x {SOURCES} sources, medians of {len(rate['seconds']['loop'])} turns:",
        "",
        *table(["", "seconds"], [(name, f"{statistics.median(s):.1f}") for name, s in rate["seconds"].items()]),
        "",
        f"Two workers are {rate['rate_of_two']:.2f} times as fast as one. One worker takes "
        f"{100 * rate['overhead']:+.1f} % more time than the loop. Same bits: {'yes' if rate['same_bits'] else 'NO'}.",
        "",
        *table("mesh | vertices | method | peak memory, MiB | stated, MiB | ratio".split(" | "), memory_cells, (0, 2)),
    ]
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--meshes", type=int, default=200)
    parser.add_argument("--add", type=Path, metavar="FOLDER", help="real meshes")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--docs", type=Path, help="page whose tables are to be written")
    parser.add_argument("--loop", type=Path, nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args(argv)
    if arguments.loop:
        HeatMethodSolver(shapes.icosphere(2)).distance(0)
        start = time.perf_counter()
        plain_loop(*arguments.loop)
        print(time.perf_counter() - start)
        return 0
    result = {
        "environment": environment(),
        "rates": rates(arguments.meshes, arguments.add, arguments.repeats),
        "memory": [memory(*each, method) for each in memory_meshes(arguments.add) for method in ("heat", "sweep")],
    }
    page = publish(result, markdown(result), folder=arguments.out, name="cluster_table")
    if arguments.docs:
        write_parts(arguments.docs, {"rates and memory": page})
    return 0


if __name__ == "__main__":
    sys.exit(main())
