"""The heat method on polygons: triangles of the polygons, and triangles around virtual vertices.

    python scripts/polygons_table.py cow.obj spot.obj --docs docs/metrics_theory.md    # on the duals of these meshes

The dual of a triangle mesh has a polygon around each vertex inside, its corners in the middles of the faces, which in
general is not planar. Polygons in a file are taken as they are. Prints the mean of |d - exact| / exact in percent, with
the exact distance on the same surface: that of the virtual vertices for the second column.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence

import numpy as np

from heat_igl import AccuracyWarning, HeatMethodSolver, Mesh, PolygonMesh, geodesic_distance, read_polygon_mesh, shapes
from heat_igl.mesh import PolygonFans

from harness import Row, Table, collected, mean_error, parsed, publish


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


def measured(name: str, mesh: PolygonMesh, sources: list[int]) -> Row:
    """Mean errors in percent of both ways."""
    fans, n = PolygonFans.of(mesh).mesh, mesh.n_vertices
    ways = {
        "triangles": (HeatMethodSolver(mesh.triangles), mesh.triangles),
        "virtual": (HeatMethodSolver(mesh), fans),
    }
    return {"mesh": name} | {
        key: mean_error(solver.distance, sources, lambda i, s=surface: geodesic_distance(s, i, method="exact")[:n])
        for key, (solver, surface) in ways.items()
    }


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", sources=8)
    warnings.simplefilter("ignore", AccuracyWarning)
    rng = np.random.default_rng(options.seed)
    domains = {"sphere, 642 polygons": dual(shapes.icosphere(3))}
    for path in options.meshes:
        mesh = read_polygon_mesh(path)
        domains[path.stem] = dual(mesh.triangles) if (mesh.degree == 3).all() else mesh
    sources = {name: rng.choice(mesh.n_vertices, options.sources, replace=False) for name, mesh in domains.items()}
    rows = collected(measured(name, mesh, sources[name].tolist()) for name, mesh in domains.items())
    columns = {"triangles without virtual vertices, %": "triangles", "with virtual vertices (default), %": "virtual"}
    publish(options, {"polygons": Table(rows, {"": "{mesh}"} | {h: f"{{{key}:.2g}}" for h, key in columns.items()})})


if __name__ == "__main__":
    sys.exit(main())
