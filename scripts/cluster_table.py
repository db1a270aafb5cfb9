"""Batches on Dask: rate of two workers against one, overhead over a plain loop, and memory against its estimate.

    python scripts/cluster_table.py                     # 200 generated meshes, 64 sources each
    python scripts/cluster_table.py --count 20          # a shorter look
    python scripts/cluster_table.py FOLDER/* --docs docs/cluster.md    # real meshes among them

The plain loop reads each file, makes a solver, solves, and saves one file of float32. All use one thread a process; the
three take turns, so that what else happens on the machine hits them alike. Needs the extra ``cluster``.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from heat_igl import HeatMethodSolver, Mesh, cluster, read_mesh, shapes, write_mesh
from heat_igl.cluster.worker import PROCESS_MEMORY, solver_memory
from heat_igl.geodesic import DistanceMethod
from heat_igl.runtime.memory import memory_field

from harness import Row, Table, collected, parsed, publish, ratio

SOURCES = 64
METHODS: tuple[DistanceMethod, ...] = ("heat", "sweep", "windows")
MEMORY_SIZES = (3, 5, 6, 7)  # subdivisions of the icosphere


def collect(folder: Path, count: int, real: Sequence[Path]) -> int:
    """Write `count` meshes, `real` ones and others of 10 000 to 16 000 vertices; returns how many there are."""
    folder.mkdir()
    for path in real:
        shutil.copy(path, folder / path.name)
    rng = np.random.default_rng(0)
    for k in range(len(real), count):
        mesh = (
            lambda: shapes.icosphere(5),
            lambda k=k: shapes.torus(140 + k % 30, 80),
            lambda k=k: shapes.grid(100 + k % 25),
            lambda k=k: shapes.cylinder(120, 90 + k % 20),
        )[k % 4]()
        write_mesh(folder / f"{k:04d}.ply", Mesh(mesh.V * rng.uniform(0.5, 2, 3), mesh.F))
    return max(count, len(real))


def plain_loop(folder: Path, out: Path) -> float:
    """Seconds of what a user would write without a batch, in a process of its own, without its imports."""
    HeatMethodSolver(shapes.icosphere(2)).distance(0)
    out.mkdir()
    start = time.perf_counter()
    for path in sorted(folder.iterdir()):
        distances = HeatMethodSolver(read_mesh(path)).distances(list(range(SOURCES)))
        np.save(out / f"{path.name}.npy", distances.astype(np.float32))
    return time.perf_counter() - start


def batch(folder: Path, store: Path, workers: int) -> float:
    """Seconds of a batch, without starting and stopping the workers; checks that no mesh failed."""
    with cluster.connected(n_workers=workers) as client:
        client.run(_warm)
        start = time.perf_counter()
        sources = list(range(SOURCES))
        report = cluster.distances(cluster.folder(folder), sources, store, client=client, method="heat")
        took = time.perf_counter() - start
    if report.failed:
        raise RuntimeError(f"{report.failed[0].mesh}: {report.failed[0].reason}")
    return took


def _warm() -> None:
    """Imports, which the loop's time does not include either."""
    import zarr  # noqa: F401

    import heat_igl.cluster.worker  # noqa: F401

    HeatMethodSolver(shapes.icosphere(2)).distance(0)


def rates(count: int, real: Sequence[Path], repeats: int) -> tuple[Table, str]:
    """Times of the loop and of one and two workers, in turns, and what they say."""
    times: dict[str, list[float]] = {"loop": [], "one worker": [], "two workers": []}
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch)
        n = collect(root / "meshes", count, real)
        for turn in range(repeats):
            # Children start with the environment of this process.
            os.environ |= {f"{name}_NUM_THREADS": "1" for name in ("HEAT_IGL", "OMP", "OPENBLAS", "MKL")}
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                times["loop"].append(pool.submit(plain_loop, root / "meshes", root / f"loop {turn}").result())
            for workers, name in ((1, "one worker"), (2, "two workers")):
                times[name].append(batch(root / "meshes", root / f"{name} {turn}", workers))
    loop, one, two = (np.array(each) for each in times.values())
    text = f"{n} meshes x {SOURCES} sources, medians of {repeats} turns:"
    rows = [{"name": name, "seconds": float(np.median(each))} for name, each in times.items()]
    said = (
        f"Two workers are {ratio(one, two):.2f} times as fast as one. One worker takes "
        f"{100 * (ratio(one, loop) - 1):+.1f} % more time than the loop."
    )
    return Table(rows, {"": "name", "seconds": "{seconds:.1f}"}, text), said


def memory(real: Sequence[Path]) -> Iterator[Row]:
    """Peak memory of a worker beside the bound that the batch states: spheres, the first real mesh subdivided."""
    meshes = {f"sphere {size}": shapes.icosphere(size) for size in MEMORY_SIZES}
    meshes |= {f"{path.stem}, subdivided": read_mesh(path).halved() for path in real[:1]}
    for name, mesh in meshes.items():
        for method in METHODS:
            with tempfile.TemporaryDirectory() as scratch, cluster.connected(n_workers=1) as client:
                store = Path(scratch) / "store"
                cluster.distances({name: mesh}, list(range(2 * SOURCES)), store, client=client, method=method)
                (peak,) = client.run(memory_field, "self/status", "VmHWM").values()
            stated = PROCESS_MEMORY + solver_memory(mesh, method)
            row = {"mesh": name, "n": mesh.n_vertices, "method": method, "ratio": peak / stated}
            yield row | {"peak": peak / 2**20, "stated": stated / 2**20}


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", count=200, repeats=3)
    table, said = rates(options.count, options.meshes, options.repeats)
    columns = {"mesh": "mesh", "vertices": "n", "method": "method", "peak memory, MiB": "{peak:.0f}"}
    columns |= {"stated, MiB": "{stated:.0f}", "ratio": "{ratio:.2f}"}
    needed = Table(collected(memory(options.meshes)), columns)
    publish(options, {"rates and memory": "\n\n".join([table.markdown(), said, needed.markdown()])})


if __name__ == "__main__":
    main()
