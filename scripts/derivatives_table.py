"""Derivatives of distance: against central differences, the identities that they satisfy, and what they cost.

    python scripts/derivatives_table.py                                # generated shapes
    python scripts/derivatives_table.py bunny.obj cow.obj              # 20 random directions on each
    python scripts/derivatives_table.py MESH --directions 4 --output DIRECTORY

All vertices are moved by 0.01 edges first: in flat parts paths are equally long, and in flat squares any motion flips
faces. Vertices at kinks are left out, which show by a second difference, and those that `inexact` lists. A kink of a
path is the cut locus; one of the heat method is a face that begins to be damped there. Directions in which a flip falls
between the two ends of a difference are left out for the heat method. All of these are counted. Costs are processor
time on all threads, in queries.
"""

from __future__ import annotations

import sys
import time
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import Mesh, shapes
from heat_igl.geodesic import Solver, SolverChoice
from heat_igl.heat_method.derivatives import DistanceDerivative
from heat_igl.typing import FloatArray

from scaffold import add_output, add_seed, environment, option_parser, over_meshes, publish, table

METHODS: dict[str, dict[str, Any]] = {
    "exact": {"method": "exact"},
    "heat": {"laplacian": "intrinsic-delaunay"},
}
SHAPES: dict[str, Callable[[], Mesh]] = {
    "sphere": lambda: shapes.icosphere(4),
    "torus": lambda: shapes.torus(60, 30),
    "cone": lambda: shapes.cone(40, 30),
    "book of 3 pages": lambda: shapes.book(3, 24),
    "square": lambda: shapes.grid(40),
}
# All vertices are moved by this many edges at random.
_MOVED = 0.01
# Step of the differences in mean edge lengths: few kinks lie within it, and rounding is 1e-6 for heat.
_STEP = 1e-7
# A second difference above this share of a step is a kink, and not the curvature of a smooth function.
_KINK = {"exact": 1e-5, "heat": 1e-4}
_CALLS = 5


def measured(mesh: Mesh, n_directions: int, seed: int) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    # Random parts of the positions: no two paths are equally long then, and no four corners of faces on a circle.
    noise = rng.uniform(-1, 1, mesh.V.shape) * mesh.edge_lengths.mean()
    V = mesh.V - mesh.V.mean(axis=0)
    moved = mesh.with_vertices(V + _MOVED * noise)
    source = int(rng.choice(np.unique(mesh.F)))
    row: dict[str, Any] = {"n": mesh.n_vertices}
    for name, options in METHODS.items():
        solver = SolverChoice.of(**options).on(moved)
        distance, pull_back = solver.distance_vjp(source)
        directions = np.random.default_rng(seed + 1).standard_normal((n_directions, *V.shape))
        row[name] = {
            **compared(solver, moved, source, pull_back, directions, name),
            **identities(moved, distance, pull_back, rng.standard_normal(len(V))),
            **costs(solver, source, pull_back, rng.standard_normal(len(V)), directions[0]),
        }
    return row


def roughened(mesh: Mesh) -> Mesh:
    """All vertices moved by up to a tenth of an edge, so that no two paths are equally long."""
    noise = np.random.default_rng(7).uniform(-1, 1, mesh.V.shape)
    return mesh.with_vertices(mesh.V + 0.1 * mesh.edge_lengths.mean() * noise)


def compared(
    solver: Solver,
    mesh: Mesh,
    source: int,
    pull_back: DistanceDerivative,
    directions: FloatArray,
    name: str,
) -> dict[str, Any]:
    """Relative differences from central differences, of the sum over vertices and in the norm; what was left out."""
    rng, here, step = np.random.default_rng(0), solver.distance(source), _STEP * mesh.edge_lengths.mean()
    exact = np.isfinite(here)
    exact[pull_back.inexact] = False
    kinks, flipped = np.zeros(len(here), bool), 0
    of_sums, of_norms = [], []
    for direction in directions:
        two = [solver.with_vertices(mesh.V + sign * step * direction) for sign in (1, -1)]
        # A flip changes no path.
        if name == "heat" and len({one.operators.surface.triangulation.F.tobytes() for one in two}) > 1:
            flipped += 1
            continue
        ahead, behind = (one.distance(source) for one in two)
        with np.errstate(invalid="ignore"):
            smooth = exact & (np.abs(ahead - 2 * here + behind) <= _KINK[name] * step + 1e-12 * here)
            slope = (ahead - behind) / (2 * step)
        kinks |= exact & ~smooth
        expected = np.where(smooth, slope, 0.0)
        g = np.where(smooth, rng.standard_normal(len(here)), 0.0)
        rate = float((pull_back(g) * direction).sum())
        of_sums.append(abs(rate - float(g @ expected)) / float(np.linalg.norm(g * expected)))
        change = np.where(smooth, pull_back.push_forward(direction), 0.0)
        of_norms.append(float(np.linalg.norm(change - expected) / np.linalg.norm(expected)))
    return {
        "sums": max(of_sums, default=0.0),
        "norms": max(of_norms, default=0.0),
        "kinks": int(kinks.sum()),
        "inexact": len(pull_back.inexact),
        "flipped": flipped,
    }


def identities(mesh: Mesh, distance: FloatArray, pull_back: DistanceDerivative, g: FloatArray) -> dict[str, float]:
    """Translation and rotation change nothing, scaling gives the distance, and both directions agree; relative."""
    g = np.where(np.isfinite(distance), g, 0.0)
    g[pull_back.inexact] = 0.0
    dV = pull_back(g)
    length = np.linalg.norm(dV, axis=1)
    of_distance = np.where(np.isfinite(distance), distance, 0.0) * g
    direction = np.random.default_rng(3).standard_normal(mesh.V.shape)
    change = pull_back.push_forward(direction) * g
    return {
        "translation": float(np.abs(dV.sum(axis=0)).max() / length.sum()),
        "rotation": float(
            np.abs(np.cross(mesh.V, dV).sum(axis=0)).max() / (np.linalg.norm(mesh.V, axis=1) * length).sum()
        ),
        "scaling": float(abs((dV * mesh.V).sum() - of_distance.sum()) / np.abs(of_distance).sum()),
        "transposed": float(abs((dV * direction).sum() - change.sum()) / np.abs(change).sum()),
    }


def costs(
    solver: Solver, source: int, pull_back: DistanceDerivative, g: FloatArray, direction: FloatArray
) -> dict[str, float]:
    """Processor time of both directions in queries, medians of alternating calls; bytes per vertex at most."""
    calls = (lambda: solver.distance(source), lambda: pull_back(g), lambda: pull_back.push_forward(direction))
    taken = np.zeros((_CALLS, len(calls)))
    for row in taken:
        for k, call in enumerate(calls):
            begin = time.process_time()
            call()
            row[k] = time.process_time() - begin
    query, back, forth = np.median(taken, axis=0)
    tracemalloc.start()
    pull_back(g)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return {"query": query, "pull_back": back / query, "push_forward": forth / query, "bytes": peak / len(g)}


def markdown(result: dict[str, Any]) -> str:
    rows, exact, cost = [], [], []
    for name, row in result["meshes"].items():
        found = [row[method] for method in METHODS]
        cells = [f"{one['norms']:.1e}" + left_out(one) for one in found]
        rows.append((name, f"{row['n']}", *cells))
        exact.append((name, *(f"{max(one[key] for one in found):.0e}" for key in IDENTITIES)))
        ratios = (f"{one[key]:.1f}" for key in ("pull_back", "push_forward") for one in found)
        cost.append((name, f"{row['n']}", *ratios, f"{max(one['bytes'] for one in found):.0f}"))
    directions = [f"{way}, {method}" for way in ("back", "forth") for method in METHODS]
    return "\n".join(
        [
            "Largest relative difference from central differences over the directions, in the norm over the vertices "
            "(left out: k at kinks, i inexact, f directions with a flip):",
            "",
            *table(("mesh", "vertices", *METHODS), rows),
            "",
            "Largest relative deviation from the identities, over the three methods:",
            "",
            *table(("mesh", *IDENTITIES.values()), exact),
            "",
            "Cost in queries of the method, and bytes per vertex that a `pull_back` takes at most:",
            "",
            *table(("mesh", "vertices", *directions, "bytes"), cost),
        ]
    )


IDENTITIES = {
    "translation": "translation",
    "rotation": "rotation",
    "scaling": "scaling",
    "transposed": "both directions",
}


def left_out(found: dict[str, Any]) -> str:
    """How many vertices and directions are left out, in brackets."""
    counts = [f"{found[key]} {key[0]}" for key in ("kinks", "inexact", "flipped") if found[key]]
    return f" ({', '.join(counts)})" if counts else ""


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", type=Path, nargs="*", help="triangle meshes (default: generated shapes)")
    parser.add_argument("--directions", type=int, default=20, help="random directions on each mesh (default 20)")
    add_seed(parser)
    add_output(parser, "derivatives")
    arguments = parser.parse_args(argv)

    def measure(mesh: Mesh) -> dict[str, Any]:
        return measured(mesh, arguments.directions, arguments.seed)

    if arguments.meshes:
        found = over_meshes(arguments.meshes, measure)
    else:
        found = {name: measure(roughened(shape())) for name, shape in SHAPES.items()}
    result = {"environment": environment(), "meshes": found}
    publish(result, markdown(result), folder=arguments.output, name="derivatives")
    return 0


if __name__ == "__main__":
    sys.exit(main())
