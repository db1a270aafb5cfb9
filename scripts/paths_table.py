"""Length of shortest paths against exact distance, and the time that they take.

    python scripts/paths_table.py bunny.obj cow.obj         # 200 targets on each, from one source
    python scripts/paths_table.py MESH --targets 1000 --output DIRECTORY    # where paths.json and paths.md go

Truth is pygeodesic's exact polyhedral distance (extra ``validate``). Paths are traced down the refined distance, and
down that of the heat alone. Needs the extra ``fast``.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import HeatMethodSolver, Mesh, reference, shapes, shortest_paths

from scaffold import add_output, add_seed, environment, option_parser, publish, table


def measured(mesh: Mesh, name: str, n_targets: int, seed: int) -> list[dict[str, Any]]:
    rng = np.random.default_rng(seed)
    usable = np.flatnonzero(mesh.referenced & (mesh.components == mesh.components[mesh.F[0, 0]]))
    source, *drawn = rng.choice(usable, min(n_targets, len(usable) - 1) + 1, replace=False)
    targets = np.array(drawn)
    exact = reference.exact(mesh, int(source))[targets]
    rows = []
    for refine in ("unfold", None):
        distance = HeatMethodSolver(mesh, refine=refine).distance(int(source))
        start = time.perf_counter()
        paths = shortest_paths(mesh, distance, targets, int(source))
        seconds = time.perf_counter() - start
        error = np.array([path.lengths(mesh).sum() for path in paths]) / exact - 1
        gap = max(float(np.abs(path.positions(mesh)[-1] - mesh.V[source]).max()) for path in paths)
        rows.append(
            {
                "mesh": name,
                "n": mesh.n_vertices,
                "down": refine or "heat",
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
    return "\n".join([*lines, *table(head, cells, (0, 2))])


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", type=Path, nargs="+", help="triangle meshes")
    parser.add_argument("--targets", type=int, default=200, help="paths per mesh (default 200)")
    add_seed(parser)
    add_output(parser, "paths")
    arguments = parser.parse_args(argv)
    warm = shapes.grid(2)
    shortest_paths(warm, warm.V[:, 0], 8)  # compiles
    rows = [
        row
        for path in arguments.meshes
        for row in measured(heat_igl.read_mesh(path), path.stem, arguments.targets, arguments.seed)
    ]
    result = {"seed": arguments.seed, "environment": environment(), "paths": rows}
    publish(result, markdown(result), folder=arguments.output, name="paths")
    return 0


if __name__ == "__main__":
    sys.exit(main())
