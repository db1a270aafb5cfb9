"""Sources inside faces beside sources in vertices: the error of each, on real meshes.

    python scripts/sources_table.py MESH [MESH ...] [--sources 3] [--seed 0] [--json FILE]

For each mesh, points are drawn in faces, by area; the truth is the exact distance on the mesh with the point inserted
as a vertex, and compared with it the same for a corner of the same face. Prints the mean of |d - exact| / exact over
vertices and sources in percent as a Markdown table, and the largest error of the corners of the point's face as a share
of their distance. Needs the extras ``validate`` and ``fast``; docs/sources.md shows the table.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from heat_igl import HeatMethodSolver, Mesh, SurfacePoints, read_mesh, reference
from heat_igl.typing import FloatArray

from environment import environment

METHODS = (None, "sweep", "unfold")


def inserted(mesh: Mesh, point: SurfacePoints) -> Mesh:
    """The mesh with a point inside a face as its last vertex."""
    face, new = int(point.faces[0]), mesh.n_vertices
    fan = [np.where(np.arange(3) == corner, new, mesh.F[face]) for corner in range(3)]
    return Mesh(np.concatenate([mesh.V, point.positions(mesh)]), np.concatenate([np.delete(mesh.F, face, 0), fan]))


def drawn_points(mesh: Mesh, k: int, seed: int) -> list[SurfacePoints]:
    """Points inside faces, uniform by area, no coordinate below 0.01: exact solvers dislike slivers."""
    rng = np.random.default_rng(seed)
    faces = rng.choice(mesh.n_faces, k, p=mesh.measures / mesh.measures.sum())
    return [SurfacePoints([face], [0.97 * rng.dirichlet(np.ones(3)) + 0.01]) for face in faces]


def mean_error(distance: FloatArray, truth: FloatArray) -> float:
    far = np.isfinite(truth) & (truth > 0)
    return 100 * float((np.abs(distance - truth)[far] / truth[far]).mean())


def measure(mesh: Mesh, k: int, seed: int) -> dict[str, float]:
    found: dict[str, list[float]] = {}
    solvers = {method: HeatMethodSolver(mesh, refine=method) for method in METHODS}
    for point in drawn_points(mesh, k, seed):
        corners = mesh.F[point.faces[0]]
        truth = reference.exact(inserted(mesh, point), mesh.n_vertices)[:-1]
        of_vertex = reference.exact(mesh, int(corners[0]))
        straight = np.linalg.norm(mesh.V[corners] - point.positions(mesh), axis=1)
        for method, solver in solvers.items():
            name = method or "heat"
            distance = solver.distance(point)
            found.setdefault(f"{name}, face", []).append(mean_error(distance, truth))
            found.setdefault(f"{name}, vertex", []).append(mean_error(solver.distance(corners[:1]), of_vertex))
            found.setdefault(f"{name}, corners", []).append(float(np.abs(distance[corners] / straight - 1).max()))
    return {name: float(max(each) if "corners" in name else np.mean(each)) for name, each in found.items()}


def markdown(rows: dict[str, dict[str, float]]) -> str:
    names = list(next(iter(rows.values())))
    lines = [f"| mesh | {' | '.join(names)} |", "|---" * (len(names) + 1) + "|"]
    for mesh, row in rows.items():
        cells = [f"{row[name]:.1e}" if "corners" in name else f"{row[name]:.3g}" for name in names]
        lines.append(f"| {mesh} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--sources", type=int, default=3, help="points per mesh (default 3)")
    parser.add_argument("--seed", type=int, default=0, help="of the generator that draws them (default 0)")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args(argv)
    rows = {}
    for path in arguments.meshes:
        rows[path.stem] = measure(read_mesh(path), arguments.sources, arguments.seed)
        print(path.stem, file=sys.stderr, flush=True)
    print(markdown(rows))
    if arguments.json is not None:
        text = json.dumps({"environment": environment(), "rows": rows}, indent=1)
        arguments.json.write_text(text + "\n", encoding="utf8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
