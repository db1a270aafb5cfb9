"""Time, memory and accuracy of heat_igl beside potpourri3d, libigl's heat method, MeshLab's front and exact distances.

    python scripts/benchmark.py                                # spheres and bunny of 10k to 3M vertices: hours
    python scripts/benchmark.py --sizes 10000 30000 --runs 2   # some sizes
    python scripts/benchmark.py MESH ... --docs docs/cost.md   # meshes in place of bunny, subdivided; writes the page
    python scripts/benchmark.py --range --docs docs/cost.md    # long strips, large grids and spheres
    python scripts/benchmark.py --huge 10000000 --methods heat sweep windows     # one query each on an icosphere
    python scripts/benchmark.py --peers cow.obj bunny.obj --docs docs/peers.md   # all peers, on meshes as they are
    python scripts/benchmark.py --methods "heat, superlu" "heat, multifrontal" --sizes 300 1000 3000  # linear solvers
    python scripts/benchmark.py --methods heat "heat, not compared"   # the cost of comparisons: first and later query

Every method runs in a process of its own, which measures its peak memory; the processes take turns, so that what else
happens on the machine hits all alike, and ratios are medians over paired runs. On spheres truth is the great circle; on
subdivided meshes exact distance at the vertices of the first mesh, whose surface subdivision keeps. VTP is called where
the variable HEAT_IGL_VTP names its program.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import Mesh, read_mesh, shapes
from heat_igl.reference import exact
from heat_igl.runtime import PeakMemory
from heat_igl.typing import FloatArray
from heat_igl.validation import closed_forms
from heat_igl.validation.construction import hull

from harness import METHODS, Method, Row, Table, collected, drawn, errors, ours, parsed, publish, seconds

SIZES = [10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000]
BATCH, LATER = 64, 5
FITTED = (9_000, 1_250_000)  # range of sizes that exponents are fitted in
HEAT: dict[str, dict[str, Any]] = {
    "superlu": {"backend": "scipy"}, "multifrontal": {"backend": "multifrontal"}, "not compared": {"t_coef": 0.5},
    "t_coef 1": {"t_coef": 1.0}, "t_coef 0.4": {"t_coef": 0.4}, "the paper's": {"magnitude": "unit"},
}  # fmt: skip
TIMED = METHODS | {f"heat, {name}": Method(ours("heat", **options)) for name, options in HEAT.items()}
COMPARED = ["heat", "potpourri3d", "libigl heat", "MeshLab's front", "pygeodesic"]
PEERS = ["potpourri3d", "libigl heat"]
QUANTITIES = ("precomputation", "later", "batch", "peak")


# One run of one method, in a process of its own.


def run(method: str, mesh: Mesh, sources: list[int], is_whole: bool = True) -> tuple[Row, FloatArray]:
    """Seconds of each stage and bytes at the peak, and the distance from the first source."""
    prepare = TIMED[method].prepare
    warm_up = prepare(shapes.icosphere(4))
    warm_up(0)
    row: Row = {}
    with PeakMemory() as peak:
        start = time.perf_counter()
        query = prepare(mesh)
        row["precomputation"] = time.perf_counter() - start
        distance = query(sources[0])
        row["first"] = time.perf_counter() - start - row["precomputation"]
    row["peak"] = peak.bytes
    if not TIMED[method].prepares:
        row["precomputation"] = None
        return row, distance
    later = [seconds(lambda s=s: query(s), time.perf_counter) for s in sources[1 : 1 + LATER]]
    row["later"] = statistics.median(later) if later else None
    if is_whole and len(sources) > 1 + LATER:
        solver = getattr(query, "__self__", None)
        batch = solver.distances if solver else lambda s: [query(one) for one in s]
        row["batch"] = seconds(lambda: batch(sources[1:]), time.perf_counter) / (len(sources) - 1)
    return row, distance


def measured(
    name: str, mesh: Mesh, methods: Sequence[str], runs: int, sources: list[int], truth: FloatArray, whole: bool = True
) -> Iterator[Row]:
    """A row for each method: medians over rounds in which the methods take turns, and ratios to the peers'."""
    chosen = [m for m in methods if TIMED[m].is_there and mesh.n_vertices <= TIMED[m].most]
    found: dict[str, list[Row]] = {method: [] for method in chosen}
    rows: dict[str, Row] = {}
    pools = {method: ProcessPoolExecutor(1, get_context("spawn")) for method in chosen}
    for turn in range(runs):
        for method in chosen[turn % len(chosen) :] + chosen[: turn % len(chosen)]:
            row, distance = pools[method].submit(run, method, mesh, sources, whole).result()
            found[method].append(row)
            rows[method] = {"longest": distance.max()} | errors(distance[: len(truth)], truth)
    for pool in pools.values():
        pool.shutdown()
    for method, each in found.items():
        known = {key for key, value in each[0].items() if value is not None}
        rows[method] |= {key: statistics.median(one[key] for one in each) for key in known}
        rows[method] |= {"seconds": sum(rows[method].get(key, 0) for key in ("precomputation", "first"))}
        rows[method] |= {"MB": rows[method]["peak"] / 1e6} if "peak" in known else {}
        for peer in set(PEERS) & set(chosen):
            both = known & {key for key, value in found[peer][0].items() if value}
            pairs = list(zip(each, found[peer], strict=True))
            rows[method][peer] = {key: statistics.median(a[key] / b[key] for a, b in pairs) for key in both}
        yield {"mesh": name, "n": mesh.n_vertices, "method": method, "runs": runs, "exact": truth.max()} | rows[method]


# Meshes, and the exact distance on them.


def noisy_sphere(n: int, rng: np.random.Generator) -> Mesh:
    """A unit sphere through `n` jittered points of a spiral: irregular, but without slivers."""
    i = np.arange(n) + 0.5
    z, turn = 1 - 2 * i / n, np.pi * (1 + np.sqrt(5)) * i
    radius = np.sqrt(1 - z**2)
    V = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1) + rng.uniform(-0.7, 0.7, (n, 3)) / n**0.5
    return hull(V / np.linalg.norm(V, axis=1, keepdims=True))


def by_size(sizes: Sequence[int], paths: Sequence[Path], rng: np.random.Generator) -> Iterator[tuple[str, Mesh, Mesh]]:
    """Name, mesh, and the mesh for exact distances: spheres, and meshes subdivided to the sizes."""
    for n in sizes:
        sphere = noisy_sphere(n, rng)
        yield f"sphere {n}", sphere, sphere
    for path in paths:
        mesh = first = read_mesh(path)
        while mesh.n_vertices < 1.25 * max(sizes):
            if any(0.8 < mesh.n_vertices / n < 1.25 for n in sizes):
                yield f"{path.stem} {mesh.n_vertices}", mesh, first
            mesh = mesh.halved()


def timings(options: Any, paths: Sequence[Path]) -> Iterator[Row]:
    rng = np.random.default_rng(options.seed)
    for name, mesh, first in by_size(options.sizes, paths, rng):
        sources = [int(rng.integers(first.n_vertices)), *drawn(mesh, BATCH, options.seed)]
        truth = closed_forms.sphere(mesh, sources[0]) if name.startswith("sphere") else exact(first, sources[0])
        # A run takes minutes where noise is a small part of it.
        runs = min(options.runs, 5 if mesh.n_vertices < 125_000 else 3 if mesh.n_vertices < 400_000 else 1)
        yield from measured(name, mesh, options.methods, runs, sources, truth)


def at_range(options: Any) -> Iterator[Row]:
    """Where range and accuracy are put to the test, one run each."""
    sphere = shapes.icosphere(8)
    yield from measured("icosphere 655362", sphere, options.methods, 1, [0], closed_forms.sphere(sphere, 0))
    for name, mesh in (("strip 4000 x 3", shapes.strip(4000, 3)), ("grid 450 x 450", shapes.grid(450))):
        corner = int(np.argmin(mesh.V.sum(axis=1)))
        truth = np.linalg.norm(mesh.V - mesh.V[corner], axis=1)
        yield from measured(name, mesh, options.methods, 1, [corner], truth)


def huge(options: Any) -> Iterator[Row]:
    """One query and two later ones on an icosphere of about so many vertices, or a mesh subdivided to that."""
    if options.meshes:
        mesh = first = read_mesh(options.meshes[0])
        while mesh.n_vertices < 0.8 * options.huge:
            mesh = mesh.halved()
        truth = exact(first, 0)
    else:
        mesh = shapes.icosphere(max(0, round(np.log(options.huge / 10) / np.log(4))))
        truth = closed_forms.sphere(mesh, 0)
    for method in options.methods:
        sources = [0, len(truth) // 2, len(truth) // 3]
        yield from measured(mesh.n_vertices, mesh, [method], 1, sources, truth, whole=False)


def against_peers(options: Any) -> Iterator[Row]:
    for path in options.meshes:
        mesh = read_mesh(path)
        sources = drawn(mesh, 1 + LATER, options.seed)
        methods = [*METHODS] if options.methods == COMPARED else options.methods
        yield from measured(path.stem, mesh, methods, options.runs, sources, exact(mesh, sources[0]), whole=False)


# What the timings say together.


def exponents(rows: Sequence[Row]) -> Iterator[Row]:
    """By method, the exponent p of the power law n^p through the spheres, of each quantity."""
    for method in dict.fromkeys(row["method"] for row in rows):
        found = {}
        for key in QUANTITIES:
            points = [
                (row["n"], row[key])
                for row in rows
                if row["method"] == method and row["mesh"].startswith("sphere") and row.get(key)
                and FITTED[0] <= row["n"] <= FITTED[1]
            ]  # fmt: skip
            if len(points) > 1:
                found[key] = np.polyfit(*np.log(np.array(points, float)).T, 1)[0]
        yield {"method": method} | found


COST = {
    "mesh": "{mesh}", "method": "{method}", "runs": "{runs}", "precomputation": "{precomputation:.3f}",
    "first query": "{first:.4f}", "later query": "{later:.4f}", f"each of {BATCH}": "{batch:.4f}",
    "peak MB": "{MB:.0f}", "mean error": "{mean:.3f}", "largest error": "{largest:.3f}",
}  # fmt: skip
FIT = {"exponent of n": "{method}", "precomputation": "{precomputation:.2f}", "later query": "{later:.2f}",
       f"each of {BATCH}": "{batch:.2f}", "memory": "{peak:.2f}"}  # fmt: skip
RANGE = {"case": "{mesh}", "method": "{method}", "largest distance": "{longest:.6g}", "exact": "{exact:.6g}",
         "mean error": "{mean:.3f}", "largest error": "{largest:.3f}", "seconds": "{seconds:.2f}"}  # fmt: skip


def ratios(peer: str) -> dict[str, str]:
    keys = {"precomputation": "precomputation", "later query": "later", f"each of {BATCH}": "batch", "memory": "peak"}
    cells = {head: f"{{{peer}[{key}]:.2f}}" for head, key in keys.items()}
    return {"mesh": "{mesh}", f"of {peer}'s": "{method}"} | cells


def main(argv: Sequence[str] | None = None) -> None:
    more: dict[str, Any] = {"peers": False, "range": False, "huge": 0, "methods": COMPARED}
    options = parsed(__doc__, argv, "*", sizes=SIZES, runs=5, **more)
    if options.huge:
        publish(options, {"huge": Table(collected(huge(options)), COST)})
    elif options.peers:
        rows = collected(against_peers(options))
        columns = {head: form for head, form in COST.items() if head not in ("runs", f"each of {BATCH}")}
        publish(options, {"peers": Table(rows, columns)})
    elif options.range:
        publish(options, {"accuracy": Table(collected(at_range(options)), RANGE)})
    else:
        bunny = shapes.bunny_path()
        rows = collected(timings(options, options.meshes or ([bunny] if bunny else [])))
        own = [row for row in rows if row["method"].startswith("heat")]
        tables = {
            "timings": Table(rows, COST),
            **{f"ratios {peer}": Table(own, ratios(peer)) for peer in PEERS},
            "exponents": Table(list(exponents(rows)), FIT),
        }
        publish(options, tables)


if __name__ == "__main__":
    main()
