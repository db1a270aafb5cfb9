"""What refinement keeps of its accuracy and speed off the beaten track.

    python scripts/refinement_table.py bunny.obj cow.obj --nonmanifold suzanne.obj --json refinement.json

For each mesh: the mean error with slivers inserted relative to that without, and at tolerance 0; that of heat with long
edges split; the time per source of 64 sources together relative to one alone; the time at tolerance 0; the time of
`unfolded_distance` relative to potpourri3d's factorization and one query, and the number of queries from which the
factored solver pays. Then an icosphere against the sphere, and surfaces with edges of more than two faces against
shortest paths in a graph with extra points on the edges. ``--icosphere 0`` leaves the sphere out; at 8 subdivisions
(655 362 vertices) it needs a minute and 2 GiB.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import HeatMethodSolver, Mesh, Refinement, shapes
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.reference.steiner import steiner_distance
from heat_igl.typing import FloatArray

from measuring import drawn_sources, errors, exact_distance, median_seconds, potpourri3d
from scaffold import add_json, environment, option_parser, publish

REFINED = ("sweep", "unfold")
# Longest edges, in mean edges; infinity is the mesh as it is.
SPLIT = (np.inf, 2.0, 1.0, 0.7)
Row = dict[str, Any]


def fan(n_faces: int) -> Mesh:
    """Triangles on one edge, undivided."""
    angle = 2 * np.pi * np.arange(n_faces) / n_faces
    tips = np.stack([np.cos(angle), np.sin(angle), 0.3 * np.arange(n_faces)], axis=1)
    F = np.stack([np.zeros(n_faces, int), np.ones(n_faces, int), np.arange(n_faces) + 2], axis=1)
    return Mesh(np.concatenate([[[0, 0, 0], [0, 0, 1]], tips]), F)


def lifted(mesh: Mesh, n: int, seed: int) -> Mesh:
    """Vertices from the n-th on moved by a third of a sliver: needles that are not flat, on another surface."""
    V = mesh.V.copy()
    V[n:] += 0.3e-4 * mesh.edge_lengths.mean() * np.random.default_rng(seed).standard_normal(V[n:].shape)
    return Mesh(V, mesh.F)


def bad_triangles(mesh: Mesh, sources: list[int], cache: Path | None) -> Row:
    """Mean error in percent at the vertices of the mesh: without slivers, with three choices of them; of heat alone."""
    row: Row = {}
    n = mesh.n_vertices
    bad = [shapes.with_slivers(mesh, seed) for seed in range(3)]
    exact = [exact_distance(mesh, source, cache)[0] for source in sources]
    off_plane = lifted(bad[0], n, 0)
    # Next to needles pygeodesic is now and then percents too long, or finds nothing; paths that were found bound it.
    other = Refinement(intrinsic_delaunay(intrinsic_triangulation(off_plane)))
    exact_off = []
    for source in sources:
        known = exact_distance(off_plane, source, cache)[0]
        exact_off.append(np.minimum(known, other.unfold(known, np.array([source]), 0.0))[:n])
    for refine in REFINED:

        def error(surface: Mesh, truth: list[FloatArray], refine: str = refine) -> float:
            solver = HeatMethodSolver(surface, refine=refine)
            return float(np.mean([errors(solver.distance(s)[:n], e)[0] for s, e in zip(sources, truth, strict=True)]))

        clean = row[f"{refine} clean %"] = error(mesh, exact)
        found = [error(surface, exact) for surface in bad]
        row[f"{refine} slivers %"] = float(np.mean(found))
        row[f"{refine} ratio"] = row[f"{refine} slivers %"] / clean
        row[f"{refine} largest ratio"] = max(found) / clean
        row[f"{refine} slivers off the plane %"] = error(off_plane, exact_off)
    whole = Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    to_the_end = [whole.unfold(d, np.array([source]), 0.0) for source, d in zip(sources, exact, strict=True)]
    row["tolerance 0 %"] = float(np.mean([errors(d, e)[0] for d, e in zip(to_the_end, exact, strict=True)]))
    agree = [np.isclose(d, e, rtol=1e-7, atol=0).mean() for d, e in zip(to_the_end, exact, strict=True)]
    row["tolerance 0, vertices exact to 1e-7 %"] = float(100 * np.mean(agree))
    for longest in SPLIT[:2]:
        row |= splitting(mesh, sources, exact, longest)
    return row


def speed(mesh: Mesh, source: int, repeats: int) -> Row:
    """Times in ratios: 64 sources, and the one query without a factorization."""
    row: Row = {}
    sources = np.random.default_rng(0).choice(np.unique(mesh.F), 64).tolist()
    setup = {}
    for refine in REFINED:
        setup[refine] = median_seconds(lambda refine=refine: HeatMethodSolver(mesh, refine=refine), 2)
        solver = HeatMethodSolver(mesh, refine=refine)
        query = median_seconds(lambda solver=solver: [solver.distance(s) for s in sources[:8]], repeats) / 8
        row[f"64 sources, {refine}"] = median_seconds(lambda solver=solver: solver.distances(sources), 3) / 64 / query
    refinement = Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    order, start = solver.distance(source), np.array([source])
    tight, usual = (
        median_seconds(lambda t=t: refinement.unfold(order, start, **t), repeats) for t in ({"tolerance": 0.0}, {})
    )
    row["tolerance 0, time of the default's"] = tight / usual
    once = median_seconds(lambda: heat_igl.unfolded_distance(mesh.V, mesh.F, source), repeats)
    other = median_seconds(lambda: potpourri3d(mesh)(source), repeats)
    row["unfolded_distance of potpourri3d"] = once / other
    row["solver pays from query"] = int(np.ceil(setup["unfold"] / (once - query))) if once > query else None
    return row


def sphere(subdivisions: int) -> Row:
    """Mean error in percent against the sphere; the order is that of the distance itself, to save the factorization."""
    mesh = shapes.icosphere(subdivisions)
    truth = np.arccos(np.clip(mesh.V @ mesh.V[0], -1, 1))
    refinement = Refinement(intrinsic_triangulation(mesh))
    row: Row = {"vertices": mesh.n_vertices}
    for refine in REFINED:
        distance: FloatArray = getattr(refinement, refine)(truth, np.array([0]))
        row[f"{refine} %"] = errors(distance, truth)[0]
    return row


def splitting(mesh: Mesh, sources: list[int], truth: list[FloatArray] | FloatArray, longest: float) -> Row:
    """Mean error of heat in percent, and vertices, with edges split to so many mean edges."""
    whole = not np.isfinite(longest)
    fine = mesh if whole else heat_igl.split_long_edges(mesh, longest * float(mesh.edge_lengths.mean()))
    name = "heat" if whole else f"heat, edges up to {longest:g} mean edges"
    row: Row = {f"{name}, vertices": fine.n_vertices}
    for t_coef in (0.5, 0.25):
        solver = HeatMethodSolver(fine, t_coef=t_coef)
        found = [errors(solver.distance(s)[: mesh.n_vertices], d)[0] for s, d in zip(sources, truth, strict=True)]
        row[f"{name}, t_coef {t_coef:g} %"] = float(np.mean(found))
    return row


def nonmanifold(mesh: Mesh, sources: list[int]) -> Row:
    """Mean error in percent against a graph with extra points on the edges."""
    truth = steiner_distance(mesh, sources)
    row: Row = {}
    for longest in SPLIT:
        row |= splitting(mesh, sources, truth, longest)
    for refine in REFINED:
        solver = HeatMethodSolver(mesh, refine=refine)
        found = [errors(solver.distance(s), d)[0] for s, d in zip(sources, truth, strict=True)]
        row[f"{refine} %"] = float(np.mean(found))
    return row


def markdown(rows: dict[str, Row]) -> str:
    lines = []
    for name, row in rows.items():
        cells = (f"{key}: {value:.4g}" if isinstance(value, float) else f"{key}: {value}" for key, value in row.items())
        lines.append(f"- **{name}** " + "; ".join(cells))
    return "\n".join(lines)


def main(argv: list[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", nargs="*")
    parser.add_argument("--nonmanifold", nargs="*", default=[], help="meshes with edges of more than two faces")
    parser.add_argument("--seeds", type=int, default=3, help="sources per mesh, one per seed")
    parser.add_argument("--first-seed", type=int, default=0, help="the first of these seeds")
    parser.add_argument("--no-times", action="store_true", help="errors only")
    parser.add_argument("--repeats", type=int, default=5, help="timed calls")
    parser.add_argument("--icosphere", type=int, default=8, help="subdivisions")
    parser.add_argument("--exact-cache", type=Path, help="directory that keeps exact distances")
    add_json(parser)
    options = parser.parse_args(argv)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    rows: dict[str, Row] = {}
    for path in options.meshes:
        mesh = heat_igl.read_mesh(path)
        row = rows[Path(path).stem] = bad_triangles(mesh, drawn_sources(mesh, seeds), options.exact_cache)
        if not options.no_times:
            row |= speed(mesh, drawn_sources(mesh, seeds)[0], options.repeats)
        print(f"{Path(path).stem} done", file=sys.stderr, flush=True)
    rows["fan of five"] = nonmanifold(fan(5), [2, 3, 4])
    for k in (8, 24):
        mesh = shapes.book(5, k)
        rows[f"five pages, {k} edges on the line"] = nonmanifold(mesh, [mesh.n_vertices - 1])
    for path in options.nonmanifold:
        mesh = heat_igl.read_mesh(path)
        rows[Path(path).stem] = nonmanifold(mesh, drawn_sources(mesh, seeds))
    if options.icosphere:
        rows["icosphere"] = sphere(options.icosphere)
    publish({"environment": environment(), "rows": rows}, markdown(rows), json_file=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
