"""Derivatives of distance: against central differences, the identities that they satisfy, and what they cost.

    python scripts/derivatives_table.py [--directions 20]      # generated shapes, in so many random directions
    python scripts/derivatives_table.py bunny.obj cow.obj --docs docs/derivatives_theory.md

All vertices are moved by 0.01 edges first: in flat parts paths are equally long. Vertices at the cut locus are left
out (k), which show by a second difference, and those that `inexact` lists (i).
Differences and identities are the largest relative ones. Costs are processor time in queries, and the bytes per vertex
that a `pull_back` takes at most.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Sequence

import numpy as np

from heat_igl import GeodesicSolver, Mesh, shapes
from heat_igl.geodesic.derivatives import DistanceDerivative
from heat_igl.typing import FloatArray

from harness import Row, Table, collected, drawn, named, paired, parsed, publish

SHAPES: dict[str, Callable[[], Mesh]] = {
    "sphere": lambda: shapes.icosphere(4),
    "torus": lambda: shapes.torus(60, 30),
    "cone": lambda: shapes.cone(40, 30),
    "book of 3 pages": lambda: shapes.book(3, 24),
    "square": lambda: shapes.grid(40),
}
# Step of the differences in mean edge lengths: few kinks lie within it.
STEP = 1e-7
# A second difference above this share of a step is a kink, and not the curvature of a smooth function.
KINK = 1e-5


def moved(mesh: Mesh, edges: float, seed: int) -> Mesh:
    """All vertices moved at random by so many edges: no two paths are equally long, no four corners on a circle."""
    noise = np.random.default_rng(seed).uniform(-1, 1, mesh.V.shape) * mesh.edge_lengths.mean()
    return mesh.with_vertices(mesh.V - mesh.V.mean(axis=0) + edges * noise)


def measured(name: str, mesh: Mesh, n_directions: int, seed: int) -> Row:
    mesh, rng = moved(mesh, 0.01, seed), np.random.default_rng(seed)
    source = drawn(mesh, 1, seed)[0]
    solver = GeodesicSolver(mesh, method="exact")
    distance, pull_back = solver.distance_vjp(source)
    directions = np.random.default_rng(seed + 1).standard_normal((n_directions, *mesh.V.shape))
    return {
        "mesh": name,
        "n": mesh.n_vertices,
        **compared(solver, mesh, source, pull_back, directions),
        **identities(mesh, distance, pull_back, rng.standard_normal(mesh.n_vertices)),
        **costs(solver, source, pull_back, rng.standard_normal(mesh.n_vertices), directions[0]),
    }


def compared(
    solver: GeodesicSolver, mesh: Mesh, source: int, pull_back: DistanceDerivative, directions: FloatArray
) -> Row:
    """Relative difference from central differences in the norm over the vertices, and what was left out."""
    here, step = solver.distance(source), STEP * mesh.edge_lengths.mean()
    exact = np.isfinite(here)
    exact[pull_back.inexact] = False
    kinks, norms = np.zeros(len(here), bool), [0.0]
    for direction in directions:
        ahead, behind = (solver.with_vertices(mesh.V + sign * step * direction).distance(source) for sign in (1, -1))
        with np.errstate(invalid="ignore"):
            smooth = exact & (np.abs(ahead - 2 * here + behind) <= KINK * step + 1e-12 * here)
            expected = np.where(smooth, (ahead - behind) / (2 * step), 0.0)
        kinks |= exact & ~smooth
        change = np.where(smooth, pull_back.push_forward(direction), 0.0)
        norms.append(float(np.linalg.norm(change - expected) / np.linalg.norm(expected)))
    counts = {"k": int(kinks.sum()), "i": len(pull_back.inexact)}
    left_out = ", ".join(f"{count} {letter}" for letter, count in counts.items() if count)
    return {"norm": max(norms), "left out": f" ({left_out})" if left_out else ""}


IDENTITIES = ("translation", "rotation", "scaling", "both directions")


def identities(mesh: Mesh, distance: FloatArray, pull_back: DistanceDerivative, g: FloatArray) -> Row:
    """Translation and rotation change nothing, scaling gives the distance, and both directions agree; relative."""
    g = np.where(np.isfinite(distance), g, 0.0)
    g[pull_back.inexact] = 0.0
    dV = pull_back(g)
    length = np.linalg.norm(dV, axis=1)
    of_distance = np.where(np.isfinite(distance), distance, 0.0) * g
    direction = np.random.default_rng(3).standard_normal(mesh.V.shape)
    change = pull_back.push_forward(direction) * g
    turned = np.abs(np.cross(mesh.V, dV).sum(axis=0)).max() / (np.linalg.norm(mesh.V, axis=1) * length).sum()
    found = (
        np.abs(dV.sum(axis=0)).max() / length.sum(),
        turned,
        abs((dV * mesh.V).sum() - of_distance.sum()) / np.abs(of_distance).sum(),
        abs((dV * direction).sum() - change.sum()) / np.abs(change).sum(),
    )
    return dict(zip(IDENTITIES, map(float, found), strict=True))


def costs(
    solver: GeodesicSolver, source: int, pull_back: DistanceDerivative, g: FloatArray, direction: FloatArray
) -> Row:
    """Processor time of both directions in queries, medians of alternating calls; bytes per vertex at most."""
    calls = {"query": lambda: solver.distance(source), "back": lambda: pull_back(g)}
    calls["forth"] = lambda: pull_back.push_forward(direction)
    taken = {key: np.median(times) for key, times in paired(calls, 5).items()}
    tracemalloc.start()
    pull_back(g)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return {key: taken[key] / taken["query"] for key in ("back", "forth")} | {"bytes": peak / len(g)}


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", directions=20)
    meshes = named(options.meshes) or {name: moved(shape(), 0.1, 7) for name, shape in SHAPES.items()}
    rows = collected(measured(name, mesh, options.directions, options.seed) for name, mesh in meshes.items())
    mesh = {"mesh": "{mesh}", "vertices": "{n}"}
    ways = {way: f"{{{way}:.1f}}" for way in ("back", "forth")}
    tables = {
        "differences": Table(rows, mesh | {"exact": "{norm:.1e}{left out}"}),
        "identities": Table(rows, mesh | {key: f"{{{key}:.0e}}" for key in IDENTITIES}),
        "costs": Table(rows, mesh | ways | {"bytes": "{bytes:.0f}"}),
    }
    publish(options, tables)


if __name__ == "__main__":
    main()
