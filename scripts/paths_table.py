"""Length of shortest paths against exact distance, and the time that they take.

    python scripts/paths_table.py bunny.obj cow.obj         # 200 targets on each, from one source
    python scripts/paths_table.py MESH --targets 1000 --output DIRECTORY    # where paths.json and paths.md go

Truth is pygeodesic's exact polyhedral distance (extra ``validate``). Paths are traced down the refined distance, and
down that of the heat alone. Needs the extra ``fast``.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import HeatMethodSolver, Mesh, reference, shapes, shortest_paths

from environment import environment


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
        "| mesh | vertices | down | paths | median | mean | 99th percentile | largest | smallest | seconds |",
        "|---|---:|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in result["paths"]:
        errors = " | ".join(
            f"{100 * row[key]:.2g}" for key in ("median", "mean", "99th percentile", "largest", "smallest")
        )
        lines.append(
            f"| {row['mesh']} | {row['n']} | {row['down']} | {row['targets']} | {errors} | {row['seconds']:.2f} |"
        )
    return "\n".join(lines) + "\n"


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", type=Path, nargs="+", help="triangle meshes")
    parser.add_argument("--targets", type=int, default=200, help="paths per mesh (default 200)")
    parser.add_argument("--seed", type=int, default=0, help="of the generator that draws them (default 0)")
    parser.add_argument("--output", type=Path, help="directory for paths.json and paths.md")
    arguments = parser.parse_args(argv)
    warm = shapes.grid(2)
    shortest_paths(warm, warm.V[:, 0], 8)  # compiles
    rows = [
        row
        for path in arguments.meshes
        for row in measured(heat_igl.read_mesh(path), path.stem, arguments.targets, arguments.seed)
    ]
    result = {"seed": arguments.seed, "environment": environment(), "paths": rows}
    text = markdown(result)
    print(text, end="")
    if arguments.output is not None:
        arguments.output.mkdir(parents=True, exist_ok=True)
        (arguments.output / "paths.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf8")
        (arguments.output / "paths.md").write_text(text, encoding="utf8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
