"""Time, memory and accuracy of heat_igl beside potpourri3d and libigl's own heat method.

Every method runs in a process of its own, which measures its peak memory; the processes take turns, so that what else
happens on the machine hits all of them alike, and ratios are medians over paired runs.

    python scripts/benchmark.py                  # 10k to 300k vertices, range and accuracy
    python scripts/benchmark.py --size 100000    # one size
    python scripts/benchmark.py --quick          # less than 2 minutes
    python scripts/benchmark.py --large          # adds the icosphere with 655 362 vertices

Writes benchmark.json and benchmark.md. Needs the extras ``bench`` (potpourri3d), ``fast``, ``cli`` and ``validate``.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from heat_igl import HeatMethodSolver, Mesh, MissingExtraError, ReferenceSolverError, reference, shapes
from heat_igl.demo import sample_mesh
from heat_igl.io import read_mesh
from heat_igl.peak_memory import PeakMemory

from environment import environment

METHODS = ("heat_igl", "heat_igl (scipy)", "potpourri3d", "libigl heat")
SIZES = (10_000, 30_000, 100_000, 300_000)
BATCH = 16
Solve = Callable[[int], np.ndarray]
Batch = Callable[[Sequence[int]], Any]


# The methods: each makes two functions of positions and faces.


def _heat_igl(backend: str) -> Callable[[np.ndarray, np.ndarray], tuple[Solve, Batch]]:
    def prepare(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch]:
        solver = HeatMethodSolver(V, F, backend=backend)
        return solver.distance, solver.distances

    return prepare


def _potpourri3d(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch]:
    import potpourri3d

    solver = potpourri3d.MeshHeatMethodDistanceSolver(V, F)
    return solver.compute_distance, lambda sources: [solver.compute_distance(int(s)) for s in sources]


def _libigl(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch]:
    import igl

    data = igl.HeatGeodesicsData()
    igl.heat_geodesics_precompute(V, F, data)

    def solve(source: int) -> np.ndarray:
        return np.asarray(igl.heat_geodesics_solve(data, np.array([source])))

    return solve, lambda sources: [solve(s) for s in sources]


PREPARE = {
    "heat_igl": _heat_igl("auto"),
    "heat_igl (scipy)": _heat_igl("scipy"),
    "potpourri3d": _potpourri3d,
    "libigl heat": _libigl,
}
NEEDS = {"potpourri3d": "potpourri3d"}


# The child process: one method on one mesh, one run per line of its input.


def _child(method: str, path: str) -> None:
    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what native code prints is no reply
    prepare = PREPARE[method]
    warm_up = shapes.icosphere(2)
    solve, batch = prepare(warm_up.V, warm_up.F)
    solve(0)
    batch([0, 1])
    with np.load(path) as arrays:
        V, F, sources = arrays["V"], arrays["F"], arrays["sources"]
    for line in sys.stdin:
        request = json.loads(line)
        with PeakMemory() as peak:
            start = time.perf_counter()
            solve, batch = prepare(V, F)
            ready = time.perf_counter()
            distance = solve(int(sources[0]))
            solved = time.perf_counter()
        reply = {"precomputation": ready - start, "query": solved - ready, "peak_memory": peak.bytes}
        if len(sources) > 1:
            start = time.perf_counter()
            batch(sources[1:])
            reply["batch"] = (time.perf_counter() - start) / (len(sources) - 1)
        if request["save"]:
            np.save(request["save"], distance)
        del solve, batch, distance
        print(json.dumps(reply), file=replies, flush=True)


class Child:
    """The process of one method on one mesh."""

    def __init__(self, method: str, path: Path) -> None:
        self.method = method
        self._process = subprocess.Popen(
            [sys.executable, __file__, "--child", method, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, save: Path | None = None) -> dict[str, float]:
        """Seconds and bytes of one run; the distance from the first source goes to `save`."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        line = ""
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps({"save": str(save) if save else None}) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"{self.method} ended with status {self._process.wait()}")
        return dict(json.loads(line))

    def close(self) -> None:
        """End the process."""
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with contextlib.suppress(BrokenPipeError):
                pipe.close()
        self._process.wait()


# Meshes, and the exact distance where it is known.


def noisy_sphere(n: int, rng: np.random.Generator) -> Mesh:
    """A unit sphere through `n` jittered points, triangulated by their convex hull: irregular, but without slivers."""
    i = np.arange(n) + 0.5
    z, turn = 1 - 2 * i / n, np.pi * (1 + np.sqrt(5)) * i
    radius = np.sqrt(1 - z**2)
    V = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    V += rng.uniform(-0.7, 0.7, (n, 3)) / np.sqrt(n)
    V /= np.linalg.norm(V, axis=1, keepdims=True)
    F = ConvexHull(V).simplices.astype(np.int64)
    normals = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    inward = np.einsum("fd,fd->f", normals, V[F[:, 0]]) < 0
    F[inward] = F[inward][:, ::-1]
    return Mesh(V, F)


def subdivided(mesh: Mesh) -> Mesh:
    """Four triangles for each, on the same surface."""
    import igl

    return Mesh(*igl.upsample(mesh.V, mesh.F, 1))


def great_circles(V: np.ndarray, source: int) -> np.ndarray:
    """Distance on the unit sphere; the arc tangent keeps its accuracy near 0 and pi."""
    across = np.linalg.norm(np.cross(V, V[source]), axis=1)
    return np.arctan2(across, V @ V[source])


def timed_meshes(sizes: Sequence[int], rng: np.random.Generator) -> list[tuple[str, Mesh]]:
    """A sphere of each size, and the bunny at the levels of subdivision that come near one."""
    meshes = [(f"sphere {n}", noisy_sphere(n, rng)) for n in sizes]
    path = sample_mesh()
    if path is None:
        print("no bunny: pymeshlab is missing", file=sys.stderr)
        return meshes
    bunny = read_mesh(path)
    while bunny.n_vertices < 1.25 * max(sizes):
        if any(0.8 < bunny.n_vertices / n < 1.25 for n in sizes):
            meshes.append((f"bunny {bunny.n_vertices}", bunny))
        bunny = subdivided(bunny)
    return meshes


def exact_distance(name: str, mesh: Mesh, source: int) -> np.ndarray | None:
    """Closed form on spheres, polyhedral on the bunny; None where no exact solver can be had."""
    if not name.startswith("bunny"):
        return great_circles(mesh.V, source)
    try:
        return reference.exact(mesh, source)
    except (MissingExtraError, ReferenceSolverError) as error:
        print(f"no exact distance for {name}: {error}", file=sys.stderr)
        return None


def errors(distance: np.ndarray, exact: np.ndarray | None) -> dict[str, float | None]:
    """Mean relative error, and largest error over largest distance, both in percent."""
    if exact is None:
        return {"mean_error": None, "max_error": None}
    away = exact > 0
    return {
        "mean_error": 100 * float(np.mean(np.abs(distance[away] / exact[away] - 1))),
        "max_error": 100 * float(np.abs(distance - exact).max() / exact.max()),
    }


# The measurements.


def measure(
    name: str, mesh: Mesh, methods: Sequence[str], runs: int, sources: np.ndarray, exact: np.ndarray | None
) -> list[dict[str, Any]]:
    """One row per method: medians over `runs` rounds in which the methods take turns."""
    found: dict[str, list[dict[str, float]]] = {method: [] for method in methods}
    accurate: dict[str, dict[str, float | None]] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mesh.npz")
        np.savez(path, V=mesh.V, F=mesh.F, sources=sources)
        children = [Child(method, path) for method in methods]
        try:
            for number in range(runs):
                first = number % len(children)  # no method is always the one that follows another
                for child in children[first:] + children[:first]:
                    save = Path(folder, "distance.npy")
                    found[child.method].append(child.run(save))
                    distance = np.load(save)
                    accurate[child.method] = {"largest_distance": float(distance.max()), **errors(distance, exact)}
        finally:
            for child in children:
                child.close()
    return [
        {"mesh": name, "n": mesh.n_vertices, "method": method, **medians(found, method), **accurate[method]}
        for method in methods
    ]


def medians(found: dict[str, list[dict[str, float]]], method: str) -> dict[str, float | None]:
    """What a method cost, and its time over that of potpourri3d in the same round."""
    row: dict[str, float | None] = {
        key: statistics.median(run[key] for run in found[method])
        for key in ("precomputation", "query", "batch")
        if key in found[method][0]
    }
    row["peak_memory"] = found[method][0]["peak_memory"]
    if "potpourri3d" in found:
        own, peer = ([r["precomputation"] + r["query"] for r in found[m]] for m in (method, "potpourri3d"))
        row["ratio"] = statistics.median(a / b for a, b in zip(own, peer, strict=True))
    return row


def accuracy(methods: Sequence[str], large: bool) -> list[dict[str, Any]]:
    """Where range and accuracy are put to the test, one run each."""
    cases = []
    for name, mesh in (("strip 4000 x 3", shapes.strip(4000, 3)), ("grid 450 x 450", shapes.grid(450))):
        corner = int(np.argmin(mesh.V.sum(axis=1)))
        cases.append((name, mesh, corner, np.linalg.norm(mesh.V - mesh.V[corner], axis=1)))
    if large:
        sphere = shapes.icosphere(8)
        cases.append(("icosphere 655362", sphere, 0, great_circles(sphere.V, 0)))
    rows = []
    for name, mesh, source, exact in cases:
        print(name, file=sys.stderr)
        found = measure(name, mesh, methods, 1, np.array([source]), exact)
        rows += [{**row, "exact_largest": float(exact.max())} for row in found]
    return rows


# The report.


def _row(cells: Sequence[tuple[Any, str]]) -> str:
    return f"| {' | '.join('-' if value is None else format(value, digits) for value, digits in cells)} |"


def markdown(result: dict[str, Any]) -> str:
    """The result as two tables."""
    lines = [
        ", ".join(f"{name} {value}" for name, value in result["environment"].items()),
        "",
        "Seconds are medians of runs in which the methods take turns; *ratio* is precomputation and one query over "
        "potpourri3d's. Errors in percent: mean relative error, and largest error over largest distance.",
        "",
        "| mesh | method | precomputation | query | each of 16 | ratio | peak MB | mean error | largest error |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for row in result["timings"]:
        cells = [(row["mesh"], ""), (row["method"], ""), (row["precomputation"], ".3f"), (row["query"], ".4f")]
        memory = None if row["peak_memory"] is None else row["peak_memory"] / 1e6
        cells += [(row["batch"], ".4f"), (row.get("ratio"), ".2f"), (memory, ".0f")]
        lines.append(_row([*cells, (row["mean_error"], ".2f"), (row["max_error"], ".2f")]))
    lines += [
        "",
        "| case | method | largest distance | exact | mean error | largest error | seconds |",
        "|---|---|--:|--:|--:|--:|--:|",
    ]
    for row in result["accuracy"]:
        cells = [
            (row["mesh"], ""),
            (row["method"], ""),
            (row["largest_distance"], ".6g"),
            (row["exact_largest"], ".6g"),
        ]
        cells += [(row["mean_error"], ".3f"), (row["max_error"], ".3f"), (row["precomputation"] + row["query"], ".2f")]
        lines.append(_row(cells))
    for row in result["timings"]:
        if row["method"] == "heat_igl" and "ratio" in row:
            lines += ["", f"{row['mesh']}: precomputation and one query take {row['ratio']:.2f} of potpourri3d's time."]
    return "\n".join(lines) + "\n"


def _parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, action="append", help="number of vertices; may be repeated")
    parser.add_argument("--runs", type=int, default=5, help="paired runs per mesh")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="10k and 30k vertices, at most 3 runs")
    parser.add_argument("--large", action="store_true", help="add the icosphere with 655 362 vertices")
    parser.add_argument("--out", type=Path, default=Path("benchmark-results"), help="directory of the results")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print and write; see the module's docstring."""
    arguments = _parsed(argv)
    if arguments.child:
        _child(*arguments.child)
        return 0
    arguments.out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(arguments.seed)
    sizes = arguments.size or (SIZES[:2] if arguments.quick else SIZES)
    runs = min(arguments.runs, 3) if arguments.quick else arguments.runs
    methods = [m for m in METHODS if importlib.util.find_spec(NEEDS.get(m, "heat_igl")) is not None]
    result: dict[str, Any] = {"environment": environment() | {"seed": str(arguments.seed)}, "timings": []}
    for name, mesh in timed_meshes(sizes, rng):
        print(name, file=sys.stderr)
        sources = rng.choice(mesh.n_vertices, 1 + BATCH, replace=False)
        exact = exact_distance(name, mesh, int(sources[0]))
        result["timings"] += measure(name, mesh, methods, runs, sources, exact)
    reference.close()
    result["accuracy"] = accuracy([m for m in methods if m != "heat_igl (scipy)"], arguments.large)
    (arguments.out / "benchmark.json").write_text(json.dumps(result, indent=2) + "\n")
    (arguments.out / "benchmark.md").write_text(markdown(result))
    print(markdown(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
