"""Distance on point clouds: error and time, beside potpourri3d's solver on the same points.

    python scripts/clouds_table.py [--sizes 5000 50000] [--noise 0 0.01] [--methods default] [--sources 6]
    python scripts/clouds_table.py --meshes bunny.obj ... [--sources 6] [--seed 0] [--json FILE]
    python scripts/clouds_table.py --log-maps bunny.obj ... [--sources 6] [--seed 0] [--json FILE]
    python scripts/clouds_table.py --clock 15 [--sizes 5000 50000] [--noise 0 0.01] [--seed 0] [--json FILE]

Random points on a sphere of radius 1, a torus of radii 1 and 0.4, a cylinder of radius 1 and height
3, and a square with sides of length 1. Prints, as a Markdown table, the mean of |d - exact| / exact over points and
sources in percent, seconds to make the solver, and seconds for one query. Seconds are those of all processors together,
which other programs disturb least; potpourri3d uses one, this package all that there are. Noise is Gaussian in all
coordinates, of the given standard deviation. With --meshes, points are the vertices of meshes, and exact is what
unfolding finds on the mesh. With --log-maps, logarithmic maps on the vertices are compared with the exact one of the
mesh: the median angle between them, and the mean of |v - exact| / |exact| for the vectors. With --clock, both solvers
take turns so many times, and the medians of the ratios of their times by the clock are printed: of the solver with the
first query, for which potpourri3d factors, of the solver alone, and of a later query. Needs the extra ``bench``;
docs/clouds.md shows the tables.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import (
    GeodesicSolver,
    HeatMethodSolver,
    PointCloud,
    VectorHeatSolver,
    log_map,
    read_mesh,
    shapes,
    tangent_frames,
)
from heat_igl.typing import FloatArray

from scaffold import add_json, add_seed, environment, option_parser, publish, table

Truth = Callable[[int], FloatArray]


def sphere(n: int, rng: np.random.Generator) -> tuple[FloatArray, Truth]:
    P = rng.standard_normal((n, 3))
    P /= np.linalg.norm(P, axis=1, keepdims=True)
    return P, lambda i: 2 * np.arcsin(np.clip(np.linalg.norm(P - P[i], axis=1) / 2, 0, 1))


def cylinder(n: int, rng: np.random.Generator) -> tuple[FloatArray, Truth]:
    angle, height = rng.random((2, n)) * [[2 * np.pi], [3]]

    def truth(i: int) -> FloatArray:
        turn = np.abs(angle - angle[i])
        return np.hypot(np.minimum(turn, 2 * np.pi - turn), height - height[i])

    return np.stack([np.cos(angle), np.sin(angle), height], axis=1), truth


def square(n: int, rng: np.random.Generator) -> tuple[FloatArray, Truth]:
    P = np.append(rng.random((n, 2)), np.zeros((n, 1)), axis=1)
    return P, lambda i: np.linalg.norm(P - P[i], axis=1)


def torus(n: int, rng: np.random.Generator) -> tuple[FloatArray, Truth]:
    """Random vertices of a fine mesh, on which distance is unfolded."""
    finer = int(np.ceil(np.sqrt(n / 144_000)))
    mesh = shapes.torus(240 * finer, 600 * finer)
    chosen = rng.choice(mesh.n_vertices, n, replace=False)
    solver = GeodesicSolver(mesh)
    return mesh.V[chosen], lambda i: solver.distance(int(chosen[i]))[chosen]


def vertices(file: str, _: np.random.Generator) -> tuple[FloatArray, Truth]:
    mesh = read_mesh(file)
    return mesh.V, GeodesicSolver(mesh).distance


SHAPES = {"sphere": sphere, "torus": torus, "cylinder": cylinder, "square": square}


def timed(
    make: Callable[[], Callable[[int], FloatArray]], sources: Sequence[int], truth: Truth
) -> tuple[float, float, float]:
    """Mean relative error in percent, and processor seconds of `make` and of a query; the first one is not counted."""
    start = time.process_time()
    query = make()
    made = time.process_time() - start
    query(sources[0])
    start = time.process_time()
    found = [query(i) for i in sources]
    asked = (time.process_time() - start) / len(sources)
    errors = []
    for i, distance in zip(sources, found, strict=True):
        exact = truth(i)
        away = (exact > 0) & np.isfinite(exact) & np.isfinite(distance)
        errors.append(np.mean(np.abs(distance - exact)[away] / exact[away]))
    return 100 * float(np.mean(errors)), made, asked


METHODS = ("heat", "default", "windows", "potpourri3d")


def measure(
    P: FloatArray, truth: Truth, methods: Sequence[str], k: int, rng: np.random.Generator
) -> dict[str, tuple[float, float, float]]:
    import potpourri3d

    sources = rng.choice(len(P), k, replace=False).tolist()
    make: dict[str, Callable[[], Callable[[int], FloatArray]]] = {
        "heat": lambda: HeatMethodSolver(PointCloud(P)).distance,
        "default": lambda: GeodesicSolver(PointCloud(P)).distance,
        "windows": lambda: GeodesicSolver(PointCloud(P), method="windows").distance,
        "potpourri3d": lambda: potpourri3d.PointCloudHeatSolver(P).compute_distance,
    }
    return {name: timed(make[name], sources, truth) for name in methods}


def clocked(P: FloatArray, repeats: int) -> tuple[float, ...]:
    """Median ratios of times by the clock to potpourri3d's: of solver and first query, solver, and later query."""
    import potpourri3d

    def seconds(make: Callable[[], Callable[[int], FloatArray]]) -> tuple[float, float, float]:
        start = time.perf_counter()
        query = make()
        made = time.perf_counter()
        query(0)
        asked = time.perf_counter()
        query(len(P) // 2)
        return asked - start, made - start, time.perf_counter() - asked

    pairs = [
        (
            seconds(lambda: HeatMethodSolver(PointCloud(P)).distance),
            seconds(lambda: potpourri3d.PointCloudHeatSolver(P).compute_distance),
        )
        for _ in range(repeats)
    ]
    ratios = [np.divide(*pair) for pair in pairs]
    return tuple(np.median(ratios, axis=0).tolist())


def clock_table(arguments: argparse.Namespace) -> None:
    rows = []
    for shape, n, noise in product(arguments.shapes, arguments.sizes, arguments.noise):
        rng = np.random.default_rng(arguments.seed)
        P = SHAPES[shape](n, rng)[0]
        found = clocked(P + noise * rng.standard_normal(P.shape), arguments.clock)
        rows.append((shape, str(n), f"{noise:g}", *(f"{ratio:.2f}" for ratio in found)))
        print(rows[-1], file=sys.stderr, flush=True)
    head = ["points on", "number", "noise", "solver and first query", "solver", "later query"]
    result = {"environment": environment(), "rows": rows}
    publish(result, "\n".join(table(head, rows)), json_file=arguments.json)


def log_maps(file: str, sources: int, rng: np.random.Generator) -> dict[str, tuple[float, float]]:
    """Median angle in degrees and mean error in percent of the vectors of each method, in the planes of the mesh."""
    import potpourri3d

    mesh = read_mesh(file)
    on_mesh = tangent_frames(mesh)
    heat, paths = (VectorHeatSolver(PointCloud(mesh.V), method=method) for method in ("heat", "windows"))
    peer = potpourri3d.PointCloudHeatSolver(mesh.V)
    of_peer = peer.get_tangent_frames()
    found: dict[str, list[tuple[float, float]]] = {"heat": [], "paths": [], "potpourri3d": []}
    for i in rng.choice(mesh.n_vertices, sources, replace=False).tolist():
        exact = log_map(mesh, i, method="exact")
        away = np.linalg.norm(exact, axis=1) > 0
        for name, solver in (("heat", heat), ("paths", paths)):
            vectors = solver.log_map(i) @ [solver.frames.x[i], solver.frames.y[i]]
            found[name].append(_apart(on_mesh.from_world(vectors, np.full(len(vectors), i))[away], exact[away]))
        vectors = peer.compute_log_map(i) @ np.stack([of_peer[0][i], of_peer[1][i]])
        in_plane = on_mesh.from_world(vectors, np.full(len(vectors), i))
        found["potpourri3d"].append(_apart(in_plane[away], exact[away]))
    return {name: tuple(np.mean(errors, axis=0).tolist()) for name, errors in found.items()}


def _apart(found: FloatArray, exact: FloatArray) -> tuple[float, float]:
    a, b = (vectors @ [1, 1j] for vectors in (found, exact))
    angle = np.abs(np.angle(a * b.conj()))[a != 0]
    return float(np.degrees(np.median(angle))), float(100 * np.mean(np.abs(a - b) / np.abs(b)))


def log_map_table(arguments: argparse.Namespace) -> None:
    rows: list[dict[str, Any]] = []
    for file in arguments.log_maps:
        found = log_maps(file, arguments.sources, np.random.default_rng(arguments.seed))
        rows.append({"vertices of": Path(file).stem, **found})
        print(rows[-1], file=sys.stderr, flush=True)
    methods = ("heat", "paths", "potpourri3d")
    head = ["vertices of", *(f"{m}, degrees, %" for m in methods)]
    cells = [(str(row["vertices of"]), *(f"{row[m][0]:.2g}, {row[m][1]:.2g}" for m in methods)) for row in rows]
    publish({"environment": environment(), "rows": rows}, "\n".join(table(head, cells)), json_file=arguments.json)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--shapes", nargs="+", choices=SHAPES, default=[*SHAPES], help="surfaces")
    parser.add_argument("--meshes", nargs="+", default=[], metavar="FILE", help="points are the vertices of these")
    parser.add_argument("--log-maps", nargs="+", default=[], metavar="FILE", help="logarithmic maps on their vertices")
    parser.add_argument("--sizes", nargs="+", type=int, default=[5000, 50000], help="numbers of points")
    parser.add_argument("--noise", nargs="+", type=float, default=[0.0, 0.01], help="standard deviations")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS, help="what is measured")
    parser.add_argument("--sources", type=int, default=6, help="per cloud (default 6)")
    parser.add_argument("--clock", type=int, metavar="N", help="compare times by the clock, N times")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    if arguments.clock or arguments.log_maps:
        (clock_table if arguments.clock else log_map_table)(arguments)
        return 0
    rows: list[dict[str, Any]] = []

    def add(shape: str, noise: float, points: Callable[[np.random.Generator], tuple[FloatArray, Truth]]) -> None:
        rng = np.random.default_rng(arguments.seed)
        P, truth = points(rng)
        if noise:
            P = P + noise * rng.standard_normal(P.shape)
        found = measure(P, truth, arguments.methods, arguments.sources, rng)
        rows.append({"shape": shape, "points": len(P), "noise": noise, **found})
        print(rows[-1], file=sys.stderr, flush=True)

    for file in arguments.meshes:
        add(Path(file).stem, 0.0, partial(vertices, file))
    if not arguments.meshes:
        for shape, n, noise in product(arguments.shapes, arguments.sizes, arguments.noise):
            add(shape, noise, partial(SHAPES[shape], n))
    methods = arguments.methods
    head = ["points on", "number", "noise", *(f"{m}, %" for m in methods), *(f"{m}, s + s" for m in methods)]
    cells = [
        (
            str(row["shape"]),
            str(row["points"]),
            f"{row['noise']:g}",
            *(f"{row[m][0]:.2g}" for m in methods),
            *(f"{row[m][1]:.2g} + {row[m][2]:.2g}" for m in methods),
        )
        for row in rows
    ]
    publish({"environment": environment(), "rows": rows}, "\n".join(table(head, cells)), json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
