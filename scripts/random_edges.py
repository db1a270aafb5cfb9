"""Random members of families that once had wrong directions, wrong signs or endless queries.

    python scripts/random_edges.py log-maps [--members 1000] [--first 0]
    python scripts/random_edges.py signed [--members 1000] [--first 0]

A member is determined by its seed. `log-maps`: hulls stretched by up to 100, spiky spheres, tori, cylinders and rough
squares, from vertices, edges and faces, also from 1e-6 to 1e-3 of an edge beside vertices: the largest distance
between a vertex and `exp_map` of its log map, over the vertices whose shortest path is straight, as a share of the
largest distance.

`signed`: Delaunay triangulations of 2000 unevenly spread points in the plane, and discs of their faces with faces taken
out and others put in at random: how far the size is from the exact distance, as a share of the largest distance; 1 for
a wrong sign, where all faces of a vertex are inside, or none.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import Delaunay

from heat_igl import Mesh, SignedHeatSolver, SurfacePoints, exp_map, geodesic_distance, log_map, shapes
from heat_igl.mesh import region_boundary
from heat_igl.operators import operators
from heat_igl.typing import FloatArray
from heat_igl.validation.zoo.registry import hull
from heat_igl.windows import ExactSurface

from harness import Row, Table, on_sphere, parsed, publish

# Larger figures are failures.
LARGEST = {"log-maps": 1e-8, "signed": 1e-12}


def spikes(rng: np.random.Generator) -> Mesh:
    """A sphere with a random radius at each vertex."""
    mesh = shapes.icosphere(2)
    return Mesh(mesh.V * np.exp(rng.normal(size=(mesh.n_vertices, 1)) * rng.uniform(0, 0.4)), mesh.F)


def rough(shape: Mesh) -> Callable[[np.random.Generator], Mesh]:
    """A shape with its vertices moved."""
    return lambda rng: Mesh(shape.V + rng.normal(size=shape.V.shape) * rng.uniform(0, 0.05), shape.F)


BODIES = {
    "hull": lambda rng: hull(on_sphere(int(rng.integers(50, 500)), rng)),
    "spiky sphere": spikes,
    "torus": rough(shapes.torus(12, 24)),
    "cylinder": rough(shapes.cylinder(12, 12)),
    "square": rough(shapes.grid(10)),
}
PLACES: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "vertex": lambda rng: np.eye(3)[rng.integers(3)],
    "edge": lambda rng: np.append(rng.dirichlet([1, 1]), 0),
    "edge, near a vertex": lambda rng: np.array([1 - (share := 10 ** rng.uniform(-12, -3)), share, 0]),
    "face": lambda rng: rng.dirichlet([1, 1, 1]),
}


def log_maps(seed: int) -> tuple[str, float]:
    """Body and place of a member, and its figure."""
    rng = np.random.default_rng(seed)
    body, place = rng.choice(list(BODIES)), rng.choice(list(PLACES))
    made = BODIES[body](rng)
    mesh = Mesh(made.V * 10 ** rng.uniform(0, 2, 3), made.F)
    start = SurfacePoints([int(rng.integers(mesh.n_faces))], [rng.permutation(PLACES[place](rng))])
    log = log_map(mesh, start, method="exact")
    surface = operators(mesh).surface
    if surface is None:
        raise RuntimeError("triangles have a surface")
    exact = ExactSurface(surface.unfolding)
    if place == "vertex":
        source = mesh.F[start.faces[0], start.barycentric[0].argmax()]
        is_straight = exact.solve(np.array([source])).origin.root == source
    else:
        is_straight = exact.solve(points=start).origin.root == mesh.n_vertices
    gap = np.linalg.norm(exp_map(mesh, start, log).positions(mesh) - mesh.V, axis=1)
    return f"{body}, {place}", float(gap[is_straight].max() / np.hypot(*log.T).max())


def powers(rng: np.random.Generator) -> FloatArray:
    """Dense towards two sides of a square."""
    return rng.random((2000, 2)) ** rng.uniform(1, 4)


def clusters(rng: np.random.Generator) -> FloatArray:
    """Six clusters, each point at a distance of its own order."""
    return rng.random((6, 2))[rng.integers(6, size=2000)] + around(rng)


def around(rng: np.random.Generator) -> FloatArray:
    """Dense towards the middle."""
    return rng.normal(size=(2000, 2)) * 10 ** rng.uniform(-3, -0.5, (2000, 1))


SPREADS: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "powers": powers,
    "clusters": clusters,
    "around a point": around,
}


def signed(seed: int) -> tuple[str, float]:
    """Spread of the points and share of exchanged faces of a member, and its figure."""
    rng = np.random.default_rng(seed)
    spread, exchanged = rng.choice(list(SPREADS)), rng.choice([0.0, 0.1, 0.3])
    P = np.pad(SPREADS[spread](rng), ((0, 0), (0, 1)))
    F = Delaunay(P[:, :2]).simplices
    upward = np.cross(P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]])[:, 2] > 0
    mesh = Mesh(P, np.where(upward[:, None], F, F[:, ::-1]))
    centres = mesh.V[mesh.F].mean(axis=1)
    radius = np.linalg.norm(centres - centres[rng.integers(len(centres))], axis=1)
    region = (radius < np.quantile(radius, rng.uniform(0.05, 0.6))) ^ (rng.random(len(radius)) < exchanged)
    distance = SignedHeatSolver(mesh).distance(region)
    n_faces, n_inside = (np.bincount(f.ravel(), minlength=mesh.n_vertices) for f in (mesh.F, mesh.F[region]))
    is_wrong = (distance >= 0) & (n_inside == n_faces) | (distance <= 0) & (n_inside == 0)
    exact = geodesic_distance(mesh, region_boundary(mesh, faces=region), method="exact")
    off = 1.0 if is_wrong[n_faces > 0].any() else float(np.abs(np.abs(distance) - exact).max() / exact.max())
    return f"{spread}, {100 * exchanged:.0f} % exchanged", off


FAMILIES: dict[str, Callable[[int], tuple[str, float]]] = {"log-maps": log_maps, "signed": signed}


def main(argv: Sequence[str] | None = None) -> bool:
    options = parsed(__doc__, argv, tables=FAMILIES, members=1000, first=0)
    figures: dict[str, list[tuple[float, int]]] = defaultdict(list)
    for seed in range(options.first, options.first + options.members):
        kind, figure = FAMILIES[options.table](seed)
        figures[kind].append((figure, seed))
    rows: list[Row] = []
    for kind, found in sorted(figures.items()):
        failed = [seed for figure, seed in found if not figure <= LARGEST[options.table]]
        rows.append({"kind": kind, "members": len(found), "largest": max(found)[0], "failed": failed})
    columns = {"kind": "kind", "members": "members", "largest figure": "{largest:.1e}", "seeds of failures": "failed"}
    publish(options, {options.table: Table(rows, columns)})
    return any(row["failed"] for row in rows)


if __name__ == "__main__":
    sys.exit(main())
