"""Length of paths against exact distance and against flips of edges, and the time that they take.

    python scripts/paths_table.py bunny.obj cow.obj         # 200 targets on each, from one source
    python scripts/paths_table.py MESH --targets 0 --pairs 500    # against flips of edges
    python scripts/paths_table.py MESH --targets 1000 --output DIRECTORY    # where paths.json and paths.md go

Truth is pygeodesic's exact polyhedral distance (extra ``validate``). Paths are traced down the refined distance, and
down that of the heat alone. With ``--pairs``, `GeodesicPathSolver` is compared with potpourri3d's
`EdgeFlipGeodesicSolver` (extra ``bench``) on so many pairs of vertices, and on a tenth as many loops through four
vertices along edges, which both straighten. A mesh of 3000 vertices takes about a second.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse.csgraph as csgraph

import heat_igl
from heat_igl import Mesh, edge_curve, geodesic_distance, reference, shortest_paths
from heat_igl.curves import GeodesicPathSolver

from scaffold import add_output, add_seed, environment, option_parser, publish, table

# Lengths that differ by a smaller share are the same.
SAME = 1e-9


def measured(mesh: Mesh, name: str, n_targets: int, seed: int) -> list[dict[str, Any]]:
    rng = np.random.default_rng(seed)
    usable = np.flatnonzero(mesh.referenced & (mesh.components == mesh.components[mesh.F[0, 0]]))
    source, *drawn = rng.choice(usable, min(n_targets, len(usable) - 1) + 1, replace=False)
    targets = np.array(drawn)
    exact = reference.exact(mesh, int(source))[targets]
    rows = []
    for method in ("windows", "heat"):
        distance = geodesic_distance(mesh, int(source), method=method)
        start = time.perf_counter()
        paths = shortest_paths(mesh, targets, int(source), distance=distance)
        seconds = time.perf_counter() - start
        error = np.array([path.lengths(mesh).sum() for path in paths]) / exact - 1
        gap = max(float(np.abs(path.positions(mesh)[-1] - mesh.V[source]).max()) for path in paths)
        rows.append(
            {
                "mesh": name,
                "n": mesh.n_vertices,
                "down": method,
                "targets": len(targets),
                "median": float(np.median(error)),
                "mean": float(error.mean()),
                "99th percentile": float(np.quantile(error, 0.99)),
                "largest": float(error.max()),
                "smallest": float(error.min()),
                "from source": gap,
                "seconds": seconds,
            }
        )
    return rows


def compared(mesh: Mesh, name: str, n_pairs: int, seed: int) -> list[dict[str, Any]]:
    """Paths between pairs of vertices, and loops, by this package and by potpourri3d."""
    import potpourri3d

    rng = np.random.default_rng(seed)
    usable = np.flatnonzero(mesh.referenced & (mesh.components == mesh.components[mesh.F[0, 0]]))
    pairs = [rng.choice(usable, 2, replace=False) for _ in range(n_pairs)]
    loops = [edge_loop(mesh, rng.choice(usable, 4, replace=False).tolist()) for _ in range(n_pairs // 10)]
    begin = time.perf_counter()
    ours = GeodesicPathSolver(mesh)
    ours.path(pairs[0])
    made = time.perf_counter() - begin
    begin = time.perf_counter()
    flips = potpourri3d.EdgeFlipGeodesicSolver(mesh.V, mesh.F)
    flips.find_geodesic_path(*map(int, pairs[0]))
    flips_made = time.perf_counter() - begin
    curves = [edge_curve(mesh, loop, closed=True) for loop in loops]
    rows = []
    for kind, calls in (
        ("pairs", [(lambda p=p: ours.path(p), lambda p=p: flips.find_geodesic_path(*map(int, p))) for p in pairs]),
        (
            "loops",
            [
                (lambda c=c: ours.straighten(c), lambda v=v: flips.find_geodesic_loop(np.array(v)))
                for c, v in zip(curves, loops, strict=True)
            ],
        ),
    ):
        seconds, lengths = np.empty((len(calls), 2)), np.empty((len(calls), 2))
        for i, (one, other) in enumerate(calls):
            begin = time.perf_counter()
            curve = one()
            middle = time.perf_counter()
            polyline = other()
            seconds[i] = middle - begin, time.perf_counter() - middle
            steps = np.linalg.norm(np.diff(polyline, axis=0), axis=1)
            lengths[i] = curve.lengths(mesh).sum(), steps.sum()
        excess = (lengths[:, 0] - lengths[:, 1]) / lengths[:, 1].clip(mesh.edge_lengths.mean())
        rows.append(
            {
                "mesh": name,
                "n": mesh.n_vertices,
                "kind": kind,
                "count": len(calls),
                "shorter": int((excess < -SAME).sum()),
                "longer": int((excess > SAME).sum()),
                "most": float(excess.max()),
                "mean": float(excess.mean()),
                "time ratio": float(np.median(seconds[:, 0] / seconds[:, 1])),
                "total ratio": float(seconds[:, 0].sum() / seconds[:, 1].sum()),
                "setup ratio": made / flips_made,
            }
        )
        if kind == "pairs":
            exact = heat_igl.pair_distances(mesh, np.array(pairs))
            rows[-1]["not shortest"] = [int((each > exact * (1 + SAME)).sum()) for each in lengths.T]
            rows[-1]["excess"] = [float((each / exact - 1).mean()) for each in lengths.T]
    return rows


def edge_loop(mesh: Mesh, stops: list[int]) -> list[int]:
    """The vertices of the loop along shortest ways of edges through some vertices."""
    loop: list[int] = []
    for a, b in pairwise([*stops, stops[0]]):
        before = csgraph.dijkstra(mesh.edge_graph, directed=False, indices=b, return_predecessors=True)[1]
        while a != b:
            loop.append(int(a))
            a = int(before[a])
    return loop


def comparison_table(rows: list[dict[str, Any]]) -> list[str]:
    cells = []
    for row in rows:
        counts = (f"{row['count']}", f"{row['shorter']}", f"{row['longer']}")
        excess = (f"{100 * row['most']:.2g}", f"{100 * row['mean']:.2g}")
        ratios = (f"{row['time ratio']:.2f}", f"{row['total ratio']:.2f}", f"{row['setup ratio']:.2f}")
        shortest = " / ".join(map(str, row.get("not shortest", ["", ""])))
        cells.append((row["mesh"], f"{row['n']}", row["kind"], *counts, *excess, *ratios, shortest))
    head = (
        "mesh",
        "vertices",
        "kind",
        "count",
        "shorter",
        "longer",
        "most %",
        "mean %",
        "median time",
        "time",
        "setup",
    )
    text = (
        "Paths and loops of `GeodesicPathSolver` against those of flips of edges: how many are shorter and longer, by "
        "how much, the ratio of times (median of the ratios, of the sums, and for tables and the first path), and "
        "how many paths are longer than the exact distance, ours and theirs."
    )
    return [text, "", *table((*head, "not shortest"), cells, (0, 2))]


def markdown(result: dict[str, Any]) -> str:
    lines = [
        f"Length of a path over exact distance, less 1, in percent; to one source, seed {result['seed']}. Seconds are "
        "for all paths, tables of the mesh included and the distance not.",
        "",
    ]
    kinds = ("median", "mean", "99th percentile", "largest", "smallest")
    cells = []
    for row in result["paths"]:
        errors = (f"{100 * row[kind]:.2g}" for kind in kinds)
        cells.append((row["mesh"], f"{row['n']}", row["down"], f"{row['targets']}", *errors, f"{row['seconds']:.2f}"))
    head = ("mesh", "vertices", "down", "paths", *kinds, "seconds")
    parts = [*lines, *table(head, cells, (0, 2))] if cells else []
    if result["comparison"]:
        parts += ["", *comparison_table(result["comparison"])]
    return "\n".join(parts)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", type=Path, nargs="+", help="triangle meshes")
    parser.add_argument("--targets", type=int, default=200, help="paths to one source per mesh (default 200)")
    parser.add_argument("--pairs", type=int, default=0, help="pairs per mesh, compared with potpourri3d (default 0)")
    add_seed(parser)
    add_output(parser, "paths")
    arguments = parser.parse_args(argv)
    rows, pairs = [], []
    for path in arguments.meshes:
        mesh = heat_igl.read_mesh(path)
        if arguments.targets:
            rows += measured(mesh, path.stem, arguments.targets, arguments.seed)
        if arguments.pairs:
            pairs += compared(mesh, path.stem, arguments.pairs, arguments.seed)
    result = {"seed": arguments.seed, "environment": environment(), "paths": rows, "comparison": pairs}
    publish(result, markdown(result), folder=arguments.output, name="paths")
    return 0


if __name__ == "__main__":
    sys.exit(main())
