"""The heat method on polygons: vertices of the polygons alone, triangles of the polygons, and virtual vertices.

    python scripts/polygons_table.py cow.obj spot.obj                # on the duals of these meshes
    python scripts/polygons_table.py MESH --sources 8 --json FILE

The dual of a closed triangle mesh has a polygon around each vertex, its corners in the middles of the faces, which in
general is not planar. Polygons in a file are taken as they are. Prints the mean of |d - exact| / exact in percent, with
the exact distance on the same surface: that of the virtual vertices for the first and the third column.
docs/metrics.md shows the table.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence

import numpy as np

from heat_igl import AccuracyWarning, HeatMethodSolver, Mesh, PolygonMesh, geodesic_distance, read_polygon_mesh, shapes
from heat_igl.mesh import PolygonFans
from heat_igl.operators import polygon_operators
from heat_igl.typing import FloatArray

from scaffold import add_json, add_seed, environment, option_parser, publish, table


def dual(mesh: Mesh) -> PolygonMesh:
    """A polygon around each vertex that lies inside, corners in the middles of the faces."""
    beyond = {(a, b): f for f, (x, y, z) in enumerate(mesh.F.tolist()) for a, b in ((x, y), (y, z), (z, x))}
    third = {(f, v): row[(row.index(v) + 2) % 3] for f, row in enumerate(mesh.F.tolist()) for v in row}
    polygons = []
    for v, f in dict(zip(mesh.F.ravel().tolist(), np.repeat(np.arange(mesh.n_faces), 3).tolist(), strict=True)).items():
        ring: list[int] = []
        at: int | None = f
        while at is not None and at not in ring:
            ring.append(at)
            at = beyond.get((v, third[at, v]))
        if at == f and len(ring) > 2:
            polygons.append(ring)
    used, corners = np.unique(np.concatenate(polygons), return_inverse=True)
    ends = np.cumsum([len(ring) for ring in polygons])[:-1]
    return PolygonMesh(mesh.V[mesh.F[used]].mean(axis=1), np.split(corners.ravel(), ends))


def errors(mesh: PolygonMesh, sources: Sequence[int]) -> list[float]:
    """Mean errors in percent of the three ways."""
    fans, n = PolygonFans.of(mesh).mesh, mesh.n_vertices
    solvers = (
        (HeatMethodSolver(polygon_operators(mesh)), fans),
        (HeatMethodSolver(mesh.triangles), mesh.triangles),
        (HeatMethodSolver(mesh), fans),
    )
    found = []
    for solver, surface in solvers:
        exact = np.stack([geodesic_distance(surface, i, method="exact")[:n] for i in sources])
        found.append(mean_error(solver.distances([[i] for i in sources]), exact))
    return found


def mean_error(found: FloatArray, exact: FloatArray) -> float:
    away = (exact > 0) & np.isfinite(exact)
    return 100 * float(np.mean(np.abs(found[away] / exact[away] - 1)))


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", nargs="*", help="files of triangles or polygons")
    parser.add_argument("--sources", type=int, default=8, help="on each mesh (default 8)")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    warnings.simplefilter("ignore", AccuracyWarning)
    rng = np.random.default_rng(arguments.seed)
    domains = {"sphere, 642 polygons": dual(shapes.icosphere(3))}
    for path in arguments.meshes:
        mesh = read_polygon_mesh(path)
        domains[path] = dual(mesh.triangles) if (mesh.degree == 3).all() else mesh
    rows = {}
    for name, mesh in domains.items():
        rows[name] = errors(mesh, rng.choice(mesh.n_vertices, arguments.sources, replace=False).tolist())
    head = ["", "polygons alone, %", "triangles without virtual vertices, %", "with virtual vertices (default), %"]
    text = table(head, [(name, *(f"{value:.2g}" for value in row)) for name, row in rows.items()])
    publish({"environment": environment(), "errors": rows}, "\n".join(text), json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
