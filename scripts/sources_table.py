"""Sources inside faces beside sources in vertices: the error of each, on real meshes.

    python scripts/sources_table.py MESH [MESH ...] [--sources 3] [--seed 0] [--json FILE]

For each mesh, points are drawn in faces, by area; the truth is the exact distance on the mesh with the point inserted
as a vertex, and compared with it the same for a corner of the same face. Prints the mean of |d - exact| / exact over
vertices and sources in percent as a Markdown table, and the largest error of the corners of the point's face as a share
of their distance. Needs the extras ``validate`` and ``fast``; docs/sources.md shows the table. A mesh of 5000 vertices
takes about a second.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from heat_igl import Mesh, SurfacePoints, reference
from heat_igl.geodesic import SolverChoice

from measuring import mean_error
from scaffold import add_json, add_seed, environment, option_parser, over_meshes, publish, table

METHODS = ("heat", "sweep")


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


def measure(mesh: Mesh, k: int, seed: int) -> dict[str, float]:
    found: dict[str, list[float]] = {}
    solvers = {method: SolverChoice(method).on(mesh) for method in METHODS}
    for point in drawn_points(mesh, k, seed):
        corners = mesh.F[point.faces[0]]
        truth = reference.exact(inserted(mesh, point), mesh.n_vertices)[:-1]
        of_vertex = reference.exact(mesh, int(corners[0]))
        straight = np.linalg.norm(mesh.V[corners] - point.positions(mesh), axis=1)
        for method, solver in solvers.items():
            name = method or "heat"
            distance = solver.distance(point)
            found.setdefault(f"{name}, face", []).append(100 * mean_error(distance, truth))
            found.setdefault(f"{name}, vertex", []).append(100 * mean_error(solver.distance(corners[:1]), of_vertex))
            found.setdefault(f"{name}, corners", []).append(float(np.abs(distance[corners] / straight - 1).max()))
    return {name: float(max(each) if "corners" in name else np.mean(each)) for name, each in found.items()}


def markdown(rows: dict[str, dict[str, float]]) -> str:
    names = list(next(iter(rows.values())))
    cells = [
        (mesh, *(f"{row[name]:.1e}" if "corners" in name else f"{row[name]:.3g}" for name in names))
        for mesh, row in rows.items()
    ]
    return "\n".join(table(["mesh", *names], cells))


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--sources", type=int, default=3, help="points per mesh (default 3)")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    rows = over_meshes(arguments.meshes, lambda mesh: measure(mesh, arguments.sources, arguments.seed))
    publish({"environment": environment(), "rows": rows}, markdown(rows), json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
