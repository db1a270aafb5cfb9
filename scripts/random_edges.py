"""Random members of families that once had wrong directions, wrong signs or endless queries.

    python scripts/random_edges.py [log-maps] [--members 1000] [--first 0] [--json FILE]

A member is determined by its seed. `log-maps`: hulls stretched by up to 100, spiky spheres, tori, cylinders and rough
squares, from vertices, edges and faces, also from 1e-6 to 1e-3 of an edge beside vertices: the largest distance
between a vertex and `exp_map` of its log map, over the vertices whose shortest path is straight, as a share of the
largest distance.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from heat_igl import Mesh, SurfacePoints, exp_map, log_map, shapes
from heat_igl.operators import operators
from heat_igl.typing import FloatArray
from heat_igl.unfolding import ExactSurface

from scaffold import add_json, environment, option_parser, publish, table

# Larger figures are failures.
LARGEST = {"log-maps": 1e-8}


def hull(rng: np.random.Generator) -> Mesh:
    """The convex hull of points on a sphere."""
    P = rng.normal(size=(int(rng.integers(50, 500)), 3))
    P /= np.linalg.norm(P, axis=1, keepdims=True)
    F = ConvexHull(P).simplices
    return Mesh(P, np.where((np.linalg.det(P[F]) < 0)[:, None], F[:, ::-1], F))


def spikes(rng: np.random.Generator) -> Mesh:
    """A sphere with a random radius at each vertex."""
    mesh = shapes.icosphere(2)
    return Mesh(mesh.V * np.exp(rng.normal(size=(mesh.n_vertices, 1)) * rng.uniform(0, 0.4)), mesh.F)


def rough(shape: Mesh) -> Callable[[np.random.Generator], Mesh]:
    """A shape with its vertices moved."""
    return lambda rng: Mesh(shape.V + rng.normal(size=shape.V.shape) * rng.uniform(0, 0.05), shape.F)


BODIES = {
    "hull": hull,
    "spiky sphere": spikes,
    "torus": rough(shapes.torus(12, 24)),
    "cylinder": rough(shapes.cylinder(12, 12)),
    "square": rough(shapes.grid(10)),
}
PLACES: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "vertex": lambda rng: np.eye(3)[rng.integers(3)],
    "edge": lambda rng: np.append(rng.dirichlet([1, 1]), 0),
    "edge, near a vertex": lambda rng: np.array([1 - (share := 10 ** rng.uniform(-6, -3)), share, 0]),
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


FAMILIES: dict[str, Callable[[int], tuple[str, float]]] = {"log-maps": log_maps}


def main(argv: Sequence[str] | None = None) -> dict[str, Any]:
    parser = option_parser(__doc__)
    parser.add_argument("families", nargs="*", metavar="FAMILY", help=f"of {', '.join(FAMILIES)} (default all)")
    parser.add_argument("--members", type=int, default=1000, help="of each family (default 1000)")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="of the first member (default 0)")
    add_json(parser)
    options = parser.parse_args(argv)
    for name in options.families:
        if name not in FAMILIES:
            parser.error(f"there is no family {name!r}: choose from {', '.join(FAMILIES)}")
    cases = []
    for family in options.families or FAMILIES:
        figures: dict[str, list[tuple[float, int]]] = defaultdict(list)
        for seed in range(options.first, options.first + options.members):
            kind, figure = FAMILIES[family](seed)
            figures[kind].append((figure, seed))
        for kind, found in sorted(figures.items()):
            failed = [seed for figure, seed in found if not figure <= LARGEST[family]]
            cases.append(
                {"family": family, "kind": kind, "members": len(found), "largest": max(found)[0], "failed": failed}
            )
    rows = [
        [case["family"], case["kind"], str(case["members"]), f"{case['largest']:.1e}", f"{len(case['failed'])}"]
        for case in cases
    ]
    head = ["family", "kind", "members", "largest figure", "failures"]
    result = {"environment": environment(), "cases": cases}
    publish(result, "\n".join(table(head, rows, left=(0, 1))), json_file=options.json)
    return result


if __name__ == "__main__":
    sys.exit(any(case["failed"] for case in main()["cases"]))
