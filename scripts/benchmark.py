"""Time, memory and accuracy of heat_igl beside potpourri3d, libigl's heat method, MeshLab's front and exact distances.

Every method runs in a process of its own, which measures its peak memory; the processes take turns, so that what else
happens on the machine hits all of them alike, and ratios are medians over paired runs.

    python scripts/benchmark.py                           # 10k to 3M vertices, range and accuracy: hours
    python scripts/benchmark.py --size 100000             # one size
    python scripts/benchmark.py --mesh MESH [--mesh ...]  # real meshes, subdivided to the sizes, in place of the bunny
    python scripts/benchmark.py --quick                   # less than 2 minutes
    python scripts/benchmark.py --large                   # adds the icosphere with 655 362 vertices
    python scripts/benchmark.py --huge 10000000           # one query on a sphere of about that size, and nothing else
    python scripts/benchmark.py --docs docs/cost.md       # also writes the tables of that page
    python scripts/benchmark.py --page docs/peers.md --vtp PROGRAM  # all peers, on the bunny or each --mesh

Writes benchmark.json, benchmark.md and pictures. Needs the extras ``bench`` (potpourri3d), ``fast``, ``cli``, ``view``
and ``validate``.
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

from heat_igl import HeatMethodSolver, Mesh, read_mesh, reference, shapes
from heat_igl.cli.demo import sample_mesh
from heat_igl.errors import MissingExtraError, ReferenceSolverError
from heat_igl.runtime import PeakMemory

import peers
from measuring import bandwidth
from scaffold import add_seed, environment, option_parser, page, publish, table, write_parts

HEAT = ("heat_igl", "potpourri3d", "libigl heat")
SINGLE = ("MeshLab's front", "pygeodesic")  # nothing of a query is left for the next
METHODS = HEAT + SINGLE
SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000)
BATCH = 64
LATER = 5
# Above these sizes, minutes and gigabytes go to what is known by then.
LARGEST = {"potpourri3d": 1_250_000, "libigl heat": 1_250_000, "MeshLab's front": 125_000, "pygeodesic": 50_000}
# Paired runs up to each number of vertices; one beyond, where a run takes minutes and noise is a small part of it.
RUNS = {125_000: 5, 400_000: 3}
QUANTITIES = {
    "precomputation": "precomputation [s]",
    "later": "a later query [s]",
    "batch": f"each of {BATCH} [s]",
    "peak_memory": "peak memory [bytes]",
}
FITTED = (9_000, 1_250_000)  # range of sizes that exponents are fitted in
Solve = Callable[[int], np.ndarray]
Batch = Callable[[Sequence[int]], Any]


# The methods: each makes functions of positions and faces, for one query and a batch, and says what it holds.


def _heat_igl(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch | None, dict[str, Any]]:
    solver = HeatMethodSolver(V, F)
    found = solver.diagnostics
    factor_bytes = getattr(found, "factor_bytes", None)
    facts = {"factor_bytes": factor_bytes, "backend": found.backend, "again": lambda: solver.with_vertices(V * 1.01)}
    return solver.distance, solver.distances, facts


def _potpourri3d(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch | None, dict[str, Any]]:
    import potpourri3d

    solver = potpourri3d.MeshHeatMethodDistanceSolver(V, F)
    return solver.compute_distance, lambda sources: [solver.compute_distance(int(s)) for s in sources], {}


def _libigl(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch | None, dict[str, Any]]:
    import igl

    data = igl.HeatGeodesicsData()
    igl.heat_geodesics_precompute(V, F, data)

    def solve(source: int) -> np.ndarray:
        return np.asarray(igl.heat_geodesics_solve(data, np.array([source])))

    return solve, lambda sources: [solve(s) for s in sources], {}


def _front(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch | None, dict[str, Any]]:
    from heat_igl.reference.native import meshlab_front

    return lambda source: meshlab_front(V, F, np.array([source]))["distance"], None, {}


def _exact(V: np.ndarray, F: np.ndarray) -> tuple[Solve, Batch | None, dict[str, Any]]:
    from heat_igl.reference.native import pygeodesic_exact

    return lambda source: pygeodesic_exact(V, F, np.array([source]))["distance"], None, {}


PREPARE = {
    "heat_igl": _heat_igl,
    "potpourri3d": _potpourri3d,
    "libigl heat": _libigl,
    "MeshLab's front": _front,
    "pygeodesic": _exact,
    **peers.PREPARE,
}
NEEDS = {"potpourri3d": "potpourri3d", "MeshLab's front": "pymeshlab", "pygeodesic": "pygeodesic", **peers.NEEDS}


# The child process: one method on one mesh, one run per line of its input.


def _child(method: str, path: str) -> None:
    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what native code prints is no reply
    prepare = PREPARE[method]
    warm_up = shapes.icosphere(4)
    solve, batch, _ = prepare(warm_up.V, warm_up.F)
    solve(0)
    if batch is not None:
        batch(range(16))
    with np.load(path) as arrays:
        V, F, sources = arrays["V"], arrays["F"], arrays["sources"]
    for line in sys.stdin:
        request = json.loads(line)
        with PeakMemory() as peak:
            start = time.perf_counter()
            solve, batch, facts = prepare(V, F)
            ready = time.perf_counter()
            distance = solve(int(sources[0]))
            solved = time.perf_counter()
        again = facts.pop("again", None)
        reply = {"precomputation": ready - start, "query": solved - ready, "peak_memory": peak.bytes, **facts}
        later = []
        for source in sources[1 : 1 + LATER] if batch is not None else []:
            start = time.perf_counter()
            solve(int(source))
            later.append(time.perf_counter() - start)
        reply["later"] = statistics.median(later) if later else None
        if batch is not None and len(sources) > 1:
            start = time.perf_counter()
            batch(sources[1:])
            reply["batch"] = (time.perf_counter() - start) / (len(sources) - 1)
        if again is not None:
            start = time.perf_counter()
            again()
            reply["moved"] = time.perf_counter() - start
        if request["save"]:
            np.save(request["save"], distance)
        del solve, batch, distance, again
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


def timed_meshes(sizes: Sequence[int], paths: Sequence[Path], rng: np.random.Generator) -> list[tuple[str, Mesh, Mesh]]:
    """Name, mesh, and a mesh for exact distances: spheres, and meshes subdivided to the sizes.

    Subdivision leaves the surface as it is, so that exact distances between the vertices of the first mesh hold.
    """
    meshes = []
    for n in sizes:
        sphere = noisy_sphere(n, rng)
        meshes.append((f"sphere {n}", sphere, sphere))
    for path in paths:
        mesh = first = read_mesh(path)
        while mesh.n_vertices < 1.25 * max(sizes):
            if any(0.8 < mesh.n_vertices / n < 1.25 for n in sizes):
                meshes.append((f"{path.stem} {mesh.n_vertices}", mesh, first))
            mesh = subdivided(mesh)
    return meshes


def exact_distance(name: str, first: Mesh, source: int) -> np.ndarray | None:
    """Closed form on spheres, polyhedral for the vertices of the first mesh; None where no exact solver can be had."""
    if name.startswith("sphere"):
        return great_circles(first.V, source)
    try:
        return reference.exact(first, source)
    except (MissingExtraError, ReferenceSolverError) as error:
        print(f"no exact distance for {name}: {error}", file=sys.stderr)
        return None


def errors(distance: np.ndarray, exact: np.ndarray | None) -> dict[str, float | None]:
    """Mean relative error, and largest error over largest distance, both in percent."""
    if exact is None:
        return {"mean_error": None, "max_error": None}
    distance = distance[: len(exact)]
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
    found: dict[str, list[dict[str, Any]]] = {method: [] for method in methods}
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
        {"mesh": name, "n": mesh.n_vertices, "method": method, "runs": runs} | medians(found, method) | accurate[method]
        for method in methods
    ]


def medians(found: dict[str, list[dict[str, Any]]], method: str) -> dict[str, Any]:
    """What a method cost, and the same over what each heat method of others cost in the same round."""
    runs = found[method]
    row: dict[str, Any] = {
        key: statistics.median(run[key] for run in runs)
        for key in ("precomputation", "query", "later", "batch", "moved")
        if runs[0].get(key) is not None
    }
    row |= {key: runs[0].get(key) for key in ("peak_memory", "factor_bytes", "backend")}
    for peer in set(HEAT[1:]) & set(found):
        row[f"over {peer}"] = {
            key: statistics.median(a[key] / b[key] for a, b in zip(runs, found[peer], strict=True))
            for key in ("precomputation", "query", "later", "batch", "peak_memory")
            if runs[0].get(key) and found[peer][0].get(key)
        }
    if "potpourri3d" in found:
        own, peer_total = ([r["precomputation"] + r["query"] for r in found[m]] for m in (method, "potpourri3d"))
        row["ratio"] = statistics.median(a / b for a, b in zip(own, peer_total, strict=True))
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


def import_seconds(repetitions: int = 7) -> dict[str, float]:
    """Median seconds of a new interpreter that imports heat_igl, its solver, and what that is built on."""
    statements = {
        "import heat_igl": "import heat_igl",
        "from heat_igl import HeatMethodSolver": "from heat_igl import HeatMethodSolver",
        "libigl and scipy's sparse matrices alone": "import igl, scipy.sparse.linalg, scipy.sparse.csgraph",
    }
    seconds: dict[str, list[float]] = {name: [] for name in statements}
    for _ in range(repetitions):
        for name, statement in statements.items():
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", statement], check=True)
            seconds[name].append(time.perf_counter() - start)
    return {name: statistics.median(values) for name, values in seconds.items()}


def exponents(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """By method and quantity, the exponent p of the power law n^p through the spheres."""
    found: dict[str, dict[str, float]] = {}
    for method in METHODS:
        for key in QUANTITIES:
            points = [
                (row["n"], row[key])
                for row in rows
                if row["method"] == method
                and row["mesh"].startswith("sphere")
                and FITTED[0] <= row["n"] <= FITTED[1]
                and row.get(key)
                and not (key == "precomputation" and method in SINGLE)
            ]
            if len({n for n, _ in points}) > 1:
                n, values = np.log(np.array(points, dtype=float)).T
                found.setdefault(method, {})[key] = float(np.polyfit(n, values, 1)[0])
    return found


def floors(rows: Sequence[dict[str, Any]], bytes_per_second: float) -> list[dict[str, Any]]:
    """What reading the factors takes, forward and backward, beside what a query takes."""
    found = []
    for row in rows:
        if row["method"] == "heat_igl" and row.get("factor_bytes"):
            floor = 2 * row["factor_bytes"] / bytes_per_second
            found.append({**row, "floor": floor, "over_floor": row["later"] / floor})
    return found


def break_even(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """From how many queries on a mesh heat_igl's precomputation has paid, against methods without one."""
    found = []
    for row in (row for row in rows if row["method"] == "heat_igl"):
        for other in (o for o in rows if o["mesh"] == row["mesh"] and o["method"] in SINGLE):
            gain = other["query"] - row["later"]
            queries = max(1, int(np.ceil(row["precomputation"] / gain))) if gain > 0 else None
            found.append({"mesh": row["mesh"], "method": other["method"], "query": other["query"], "queries": queries})
    return found


# The largest meshes: one method, one query.


def huge(n: int, mesh_path: Path | None, backend: Any = "auto", later: bool = True) -> dict[str, Any]:
    """One query on an icosphere of about `n` vertices, or on a mesh subdivided to at least `n`, and maybe two more."""
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    result: dict[str, Any] = {}
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with PeakMemory() as peak, Progress(*columns, console=Console(stderr=True), refresh_per_second=2) as bar:

        def timed(stage: str, work: Callable[[], Any]) -> Any:
            task = bar.add_task(stage)
            start = time.perf_counter()
            value = work()
            result[stage] = time.perf_counter() - start
            bar.stop_task(task)
            return value

        mesh, exact_mesh = timed("making the mesh", lambda: huge_mesh(n, mesh_path))
        V, n_first = mesh.V, exact_mesh.n_vertices if exact_mesh is not None else mesh.n_vertices
        result |= {"mesh": mesh_path.stem if mesh_path else "icosphere", "n": mesh.n_vertices}
        solver = timed("precomputation", lambda: HeatMethodSolver(mesh, backend=backend))
        result["backend"] = solver.diagnostics.backend
        distance = timed("first query", lambda: solver.distance(0))
        if later:
            timed("later query", lambda: solver.distance(n_first // 2))
            timed("last query", lambda: solver.distance(n_first // 3))
    result["peak_memory"] = peak.bytes
    if exact_mesh is None:
        return result | errors(distance, great_circles(V, 0))
    return result | errors(distance, exact_distance("", exact_mesh, 0))


def huge_mesh(n: int, path: Path | None) -> tuple[Mesh, Mesh | None]:
    """The icosphere nearest to `n` vertices; or a mesh subdivided to at least 0.8 n, and the mesh itself."""
    if path is None:
        return shapes.icosphere(max(0, round(np.log(n / 10) / np.log(4)))), None
    mesh = first = read_mesh(path)
    while mesh.n_vertices < 0.8 * n:
        mesh = subdivided(mesh)
    return mesh, first


# The report.


def _table(head: str, rows: Sequence[Sequence[tuple[Any, str]]]) -> list[str]:
    cells = [["-" if value is None else format(value, digits) for value, digits in row] for row in rows]
    return table(head.split(" | "), cells)


def markdown(result: dict[str, Any]) -> str:
    """The whole result."""
    return page(result, _all_tables(result))


def _all_tables(result: dict[str, Any]) -> str:
    return "\n\n".join(part for part in tables(result).values() if part)


def tables(result: dict[str, Any]) -> dict[str, str]:
    """The tables by name; docs/cost.md holds those that it has a place for."""
    rows = result["timings"]
    timings = [
        [
            (row["mesh"], ""),
            (row["method"], ""),
            (row["runs"], ""),
            (row["precomputation"] if row["method"] in HEAT else None, ".3f"),
            (row["query"], ".4f"),
            (row.get("later"), ".4f"),
            (row.get("batch"), ".4f"),
            (None if row["peak_memory"] is None else row["peak_memory"] / 1e6, ".0f"),
            (row["mean_error"], ".2f"),
            (row["max_error"], ".2f"),
        ]
        for row in rows
    ]
    head = f"mesh | method | runs | precomputation | first query | later query | each of {BATCH} | peak MB"
    found = {"timings": _table(f"{head} | mean error | largest error", timings)} if timings else {}
    ratios = [
        [(row["mesh"], ""), (peer, "")]
        + [(row[f"over {peer}"].get(key), ".2f") for key in ("precomputation", "later", "batch", "peak_memory")]
        for row in rows
        if row["method"] == "heat_igl"
        for peer in HEAT[1:]
        if f"over {peer}" in row
    ]
    if ratios:
        head = f"mesh | heat_igl over | precomputation | later query | each of {BATCH} | peak memory"
        found["ratios"] = _table(head, ratios)
    fitted = [[(m, ""), *((p.get(key), ".2f") for key in QUANTITIES)] for m, p in exponents(rows).items()]
    if fitted:
        found["exponents"] = _table(f"exponent of n | precomputation | later query | each of {BATCH} | memory", fitted)
    if "bandwidth" in result:
        cells = [
            [
                (row["mesh"], ""),
                (row["factor_bytes"] / 1e6, ".0f"),
                (1e3 * row["floor"], ".1f"),
                (1e3 * row["later"], ".1f"),
                (row["over_floor"], ".2f"),
            ]
            for row in floors(rows, result["bandwidth"])
        ]
        found["floor"] = [f"Copying runs at {result['bandwidth'] / 1e9:.1f} GB/s, read and written.", ""]
        if cells:
            found["floor"] += _table("mesh | factors MB | floor ms | later query ms | over floor", cells)
    moved = [
        [(row["mesh"], ""), (row["precomputation"], ".3f"), (row["moved"], ".3f")] for row in rows if row.get("moved")
    ]
    if moved:
        found["moved"] = _table("mesh | a new solver | with_vertices", moved)
    paid = [
        [(row["mesh"], ""), (row["method"], ""), (row["query"], ".3f"), (row["queries"], "")]
        for row in break_even(rows)
    ]
    if paid:
        found["break-even"] = _table("mesh | against | its query | heat_igl pays from query", paid)
    if result.get("import"):
        cells = [[(name, ""), (seconds, ".3f")] for name, seconds in result["import"].items()]
        found["import"] = _table("new interpreter | seconds", cells)
    if result.get("accuracy"):
        found["accuracy"] = _accuracy_table(result["accuracy"])
    if result.get("huge"):
        found["huge"] = _huge_table(result["huge"])
    return {name: "\n".join(lines) for name, lines in found.items()}


def _accuracy_table(rows: Sequence[dict[str, Any]]) -> list[str]:
    cells = [
        [
            (row["mesh"], ""),
            (row["method"], ""),
            (row["largest_distance"], ".6g"),
            (row["exact_largest"], ".6g"),
            (row["mean_error"], ".3f"),
            (row["max_error"], ".3f"),
            (row["precomputation"] + row["query"], ".2f"),
        ]
        for row in rows
    ]
    return _table("case | method | largest distance | exact | mean error | largest error | seconds", cells)


def _huge_table(row: dict[str, Any]) -> list[str]:
    names = ("precomputation", "first query", "later query", "last query")
    memory = None if row["peak_memory"] is None else row["peak_memory"] / 2**30
    cells = [(row["mesh"], ""), (row["n"], ""), (row["backend"], ""), *((row.get(name), ".1f") for name in names)]
    head = f"mesh | vertices | backend | {' | '.join(names)} | peak GiB | mean error | largest error"
    return _table(head, [[*cells, (memory, ".1f"), (row["mean_error"], ".3f"), (row["max_error"], ".3f")]])


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """A log-log picture of each quantity over the number of vertices, with the fitted exponents in the legend."""
    from matplotlib.figure import Figure

    fitted = exponents(rows)
    figure = Figure(figsize=(12, 9), layout="constrained")
    for axes, (key, label) in zip(figure.subplots(2, 2).flat, QUANTITIES.items(), strict=True):
        for color, method in enumerate(METHODS):
            for spheres in (True, False):
                points = sorted(
                    (row["n"], row[key])
                    for row in rows
                    if row["method"] == method and row["mesh"].startswith("sphere") == spheres and row.get(key)
                )
                if not points or (key == "precomputation" and method in SINGLE):
                    continue
                power = fitted.get(method, {}).get(key)
                name = method + (f", n^{power:.2f}" if power is not None else "") if spheres else None
                axes.loglog(*zip(*points, strict=True), "o-" if spheres else "x", color=f"C{color}", label=name)
        axes.set(xlabel="vertices", ylabel=label)
        axes.grid(alpha=0.3)
        axes.legend()
    figure.savefig(path, dpi=120)


def _parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = option_parser(__doc__)
    parser.add_argument("--size", type=int, action="append", help="number of vertices; may be repeated")
    parser.add_argument("--mesh", type=Path, action="append", help="real mesh; may be repeated; default: the bunny")
    parser.add_argument("--runs", type=int, default=5, help="most paired runs per mesh; large ones get fewer")
    add_seed(parser)
    parser.add_argument(
        "--quick", action="store_true", help="10k and 30k vertices, at most 2 runs, single queries at 10k only"
    )
    parser.add_argument("--large", action="store_true", help="add the icosphere with 655 362 vertices")
    parser.add_argument("--huge", type=int, help="one query on an icosphere of about so many vertices, or on --mesh")
    parser.add_argument("--backend", default="auto", help="of --huge")
    parser.add_argument("--single", action="store_true", help="no later queries after --huge's first")
    parser.add_argument("--docs", type=Path, help="page whose tables are to be written")
    parser.add_argument("--page", type=Path, help="page on the peers: they are measured, and nothing else is")
    parser.add_argument("--vtp", type=Path, help="the program of VTP, for --page")
    parser.add_argument("--out", type=Path, default=Path("benchmark-results"), help="directory of the results")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    return parser.parse_args(argv)


def _measured(arguments: argparse.Namespace) -> dict[str, Any]:
    rng = np.random.default_rng(arguments.seed)
    sizes = arguments.size or (SIZES[:2] if arguments.quick else SIZES)
    most_runs = 2 if arguments.quick else arguments.runs
    methods = [m for m in METHODS if _installed(m)]
    paths = arguments.mesh or [path for path in [sample_mesh()] if path is not None]
    result: dict[str, Any] = {"bandwidth": bandwidth(), "import": import_seconds(), "timings": []}
    for name, mesh, first in timed_meshes(sizes, paths, rng):
        print(name, file=sys.stderr)
        others = rng.choice(mesh.n_vertices, BATCH, replace=False)
        sources = np.concatenate([rng.choice(first.n_vertices, 1), others])
        exact = exact_distance(name, first, int(sources[0]))
        n = mesh.n_vertices
        chosen = [m for m in methods if n <= LARGEST.get(m, n) and not (arguments.quick and m in SINGLE and n > 15_000)]
        some_runs = next((count for size, count in RUNS.items() if n <= size), 1)
        result["timings"] += measure(name, mesh, chosen, min(some_runs, most_runs), sources, exact)
    reference.close()
    result["accuracy"] = accuracy([m for m in methods if m in HEAT], arguments.large)
    return result


def _installed(method: str) -> bool:
    return importlib.util.find_spec(NEEDS.get(method, "heat_igl")) is not None


def _against_peers(arguments: argparse.Namespace) -> list[dict[str, Any]]:
    if arguments.vtp is not None:
        os.environ[peers.VTP] = str(arguments.vtp.resolve())
    methods = [m for m in peers.LARGEST if _installed(m) and (m != "VTP" or arguments.vtp is not None)]
    paths = arguments.mesh or [path for path in [sample_mesh()] if path is not None]
    meshes = [(path.stem, read_mesh(path)) for path in paths]
    return peers.measured(measure, meshes, methods, 2 if arguments.quick else arguments.runs)


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print and write; see the module's docstring."""
    arguments = _parsed(argv)
    if arguments.child:
        _child(*arguments.child)
        return 0
    arguments.out.mkdir(parents=True, exist_ok=True)
    result: dict[str, Any] = {"environment": environment() | {"seed": str(arguments.seed)}, "timings": []}
    name = "benchmark"
    if arguments.huge:
        name = "huge"
        result["huge"] = huge(
            arguments.huge, arguments.mesh[0] if arguments.mesh else None, arguments.backend, not arguments.single
        )
        reference.close()
    elif arguments.page:
        name, result["peers"] = "peers", _against_peers(arguments)
        peers.write_page(arguments.page, result)
    else:
        result |= _measured(arguments)
        draw(result["timings"], arguments.out / "benchmark.png")
    text = peers.parts(result)["peers"] if arguments.page else _all_tables(result)
    publish(result, text, folder=arguments.out, name=name)
    if arguments.docs:
        write_parts(arguments.docs, tables(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
