"""Log maps, directions, traced geodesics and the vector heat method: errors and times, beside potpourri3d.

    python scripts/directions_table.py bunny.obj spot.obj              # two sources on each
    python scripts/directions_table.py MESH --sources 4 --pairs 16     # more sources, and more pairs of times
    python scripts/directions_table.py MESH --output DIRECTORY         # where directions.json and directions.md go

Truth is the exact shortest path from every vertex, followed back to the source on the faces of the mesh: the length,
and the direction in which it leaves the source. Peers need the extra ``bench``. Times are seconds of the processor,
and ratios medians over pairs of calls that follow one another.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import GeodesicSolver, Mesh, SurfacePoints, VectorHeatSolver, exp_map, log_map, tangent_frames
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

from scaffold import add_output, add_seed, environment, option_parser, over_meshes, publish, table

# The log map jumps over an edge if it changes by more than so many of the lengths of the edge.
JUMP = 4.0
STRATEGIES = ("VectorHeat", "AffineLocal", "AffineAdaptive")


# Truth.


def exact_log(mesh: Mesh, source: int) -> tuple[AnyArray, BoolArray]:
    """The log map as complex numbers (n,), by paths on the faces of the mesh; which paths (n,) pass no vertex."""
    targets = np.setdiff1d(np.flatnonzero(mesh.components == mesh.components[source]), source)
    paths = heat_igl.shortest_paths(mesh, targets, source)
    length = np.array([path.lengths(mesh).sum() for path in paths])
    faces = np.array([path.faces[-1] for path in paths])
    leaving = np.stack([path.start[-1] - path.end[-1] for path in paths])
    away = np.einsum("pc,pcx->px", leaving, mesh.V[mesh.F[faces]])
    corner = (mesh.F[faces] == source).argmax(axis=1)
    direction = tangent_frames(mesh).from_faces(faces, corner, away) @ [1, 1j]
    found, straight = np.zeros(mesh.n_vertices, complex), np.zeros(mesh.n_vertices, bool)
    found[targets] = length * direction / np.abs(direction)
    straight[targets] = [len(path) == 1 or path.start[1:].max() < 1 - 1e-9 for path in paths]
    return found, straight


def away_from_jumps(mesh: Mesh, log: AnyArray) -> BoolArray:
    """Mask (n,) of the vertices that no edge joins to one on the other side of the cut locus."""
    i, j = mesh.edges.T
    jumps = np.abs(log[i] - log[j]) > JUMP * mesh.edge_lengths
    away = np.ones(mesh.n_vertices, bool)
    away[mesh.edges[jumps]] = False
    return away


# Errors.


def errors(found: FloatArray, truth: AnyArray, away: BoolArray) -> dict[str, float]:
    """Mean vector errors in percent of the mean distance, and the median and the mean error of the angle in degrees."""
    off = 100 * np.abs(found @ [1, 1j] - truth) / np.abs(truth).mean()
    there = (truth != 0) & (np.abs(found).sum(axis=1) > 0)
    angle = np.degrees(np.abs(np.angle((found @ [1, 1j])[there] / truth[there])))
    return {
        "error": float(off.mean()),
        "away": float(off[away].mean()),
        "median angle": float(np.median(angle)),
        "mean angle": float(angle.mean()),
    }


def in_our_frame(mesh: Mesh, source: int, theirs: FloatArray, axes: Sequence[FloatArray]) -> FloatArray:
    """Components (n, 2) in our frame at the source, from those along the axes of a peer."""
    x, y, _ = axes
    world = theirs[:, :1] * x[source] + theirs[:, 1:] * y[source]
    return tangent_frames(mesh).from_world(world, np.full(len(world), source))


def log_maps(mesh: Mesh, sources: IntArray) -> list[dict[str, Any]]:
    """Errors of each way to the log map, and the largest |exp(log x) - x| at the ends of straight paths."""
    solver = GeodesicSolver(mesh)
    rows = []
    for source in sources.tolist():
        truth, straight = exact_log(mesh, source)
        away = away_from_jumps(mesh, truth)
        ways = {"log_map": log_map(mesh, source)}
        ways |= {"solver": log_map(solver, source), "directions": as_vectors(solver, source)}
        ways["vector-heat"] = log_map(mesh, source, method="vector-heat")
        ways |= {name: in_our_frame(mesh, source, *log) for name, log in peer_log_maps(mesh, source).items()}
        found = {name: errors(log, truth, away) for name, log in ways.items()}
        ends = exp_map(mesh, source, ways["log_map"]).positions(mesh)
        gap = np.linalg.norm(ends - mesh.V, axis=1)[straight] / np.abs(truth).max()
        rows.append(
            {"errors": found, "gap": float(gap.max()), "straight": float(straight.mean()), "away": float(away.mean())}
        )
    return rows


def as_vectors(solver: GeodesicSolver, source: int) -> FloatArray:
    found = solver.directions(source)
    return heat_igl.intrinsic.TangentFrames.from_angles(found.departure, found.distance)


def peer_log_maps(mesh: Mesh, source: int) -> dict[str, tuple[FloatArray, Any]]:
    try:
        import potpourri3d
    except ImportError:
        return {}
    solver = potpourri3d.MeshVectorHeatSolver(mesh.V, mesh.F)
    axes = solver.get_tangent_frames()
    return {strategy: (solver.compute_log_map(source, strategy), axes) for strategy in STRATEGIES}


def vector_heat(mesh: Mesh, sources: IntArray) -> dict[str, Any]:
    """Mean errors of values and directions from three sources, against those of the nearest one along the path."""
    import potpourri3d

    ours, near = VectorHeatSolver(mesh), VectorHeatSolver(mesh, method="windows")
    theirs = potpourri3d.MeshVectorHeatSolver(mesh.V, mesh.F)
    x, y, _ = theirs.get_tangent_frames()
    vectors = ours.frames.from_angles([0.0, 2.0, 4.0])
    world = ours.frames.to_world(vectors, sources)
    given = np.stack([np.einsum("kx,kx->k", world, axis[sources]) for axis in (x, y)], axis=1)
    there = theirs.transport_tangent_vectors(sources, given)
    there = ours.frames.from_world(there[:, :1] * x + there[:, 1:] * y)
    here, truth, values = ours.transport(sources, vectors), near.transport(sources, vectors), np.array([1.0, 2.0, 4.0])
    expected = near.extend(sources, values)

    def turned(found: FloatArray, other: FloatArray) -> FloatArray:
        return np.degrees(np.abs(np.angle((found @ [1, 1j]) * (other @ [1, -1j]))))

    def value_error(solver_values: FloatArray) -> float:
        return float(np.abs(solver_values - expected).mean())

    return {
        "between": float(np.median(turned(here, there))),
        "angle": [float(turned(found, truth).mean()) for found in (here, there)],
        "median angle": [float(np.median(turned(found, truth))) for found in (here, there)],
        "value": [value_error(ours.extend(sources, values)), value_error(theirs.extend_scalar(sources, values))],
    }


# Times.


def seconds(call: Callable[[], object]) -> float:
    begin = time.process_time()
    call()
    return time.process_time() - begin


def paired(one: Callable[[int], object], other: Callable[[int], object], arguments: Sequence[int]) -> list[float]:
    """Median seconds of both, and the median of the ratios."""
    found = np.array([[seconds(lambda a=a: one(a)), seconds(lambda a=a: other(a))] for a in [arguments[0], *arguments]])
    ratios = found[1:, 0] / found[1:, 1]
    return [*np.median(found[1:], axis=0).tolist(), statistics.median(ratios.tolist())]


def costs(mesh: Mesh, sources: IntArray) -> dict[str, list[float]]:
    """Seconds of `directions` and of `distance`, and their ratio, by refinement and kind of source."""
    rng, found = np.random.default_rng(0), {}
    faces = rng.integers(0, mesh.n_faces, len(sources))
    points = [SurfacePoints([face], [[0.2, 0.3, 0.5]]) for face in faces]
    curves = [heat_igl.shortest_paths(mesh, int(a), int(b))[0] for a, b in zip(sources, sources[::-1], strict=True)]
    solver = GeodesicSolver(mesh)
    for kind, all_of_kind in (("vertex", sources.tolist()), ("point", points), ("curve", curves)):
        turns = range(len(all_of_kind))
        found[kind] = paired(
            lambda i, a=all_of_kind: solver.directions(a[i]), lambda i, a=all_of_kind: solver.distance(a[i]), turns
        )
    return found


def log_map_times(mesh: Mesh, sources: IntArray) -> dict[str, list[float]]:
    """Seconds here and by potpourri3d's fastest way, and their ratio: from arrays, and of later sources."""
    import potpourri3d

    V, F = mesh.V, mesh.F
    theirs, ours = potpourri3d.MeshVectorHeatSolver(V, F), GeodesicSolver(mesh)
    return {
        "from arrays": paired(
            lambda v: log_map(Mesh(V, F), v),
            lambda v: potpourri3d.MeshVectorHeatSolver(V, F).compute_log_map(v, "VectorHeat"),
            sources.tolist(),
        ),
        "later": paired(
            lambda v: log_map(ours, v), lambda v: theirs.compute_log_map(v, "VectorHeat"), sources.tolist()
        ),
    }


def traces(mesh: Mesh, count: int, seed: int) -> dict[str, float]:
    """Seconds of one batch of geodesics a quarter as long as the mesh, and how far some end from potpourri3d's."""
    import potpourri3d

    rng = np.random.default_rng(seed)
    start = SurfacePoints(rng.integers(0, mesh.n_faces, count), rng.dirichlet([1, 1, 1], count))
    length = mesh.longest_distance / 4
    vectors = length * heat_igl.intrinsic.TangentFrames.from_angles(rng.uniform(0, 2 * np.pi, count))
    begin, ticks = time.perf_counter(), time.process_time()
    ends = exp_map(mesh, start, vectors).positions(mesh)
    took = [time.perf_counter() - begin, time.process_time() - ticks]
    corners, k = mesh.V[mesh.F[start.faces]], min(count, 200)
    x = corners[:, 1] - corners[:, 0]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    normal = np.cross(x, corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    world = vectors[:, :1] * x + vectors[:, 1:] * np.cross(normal, x)
    tracer = potpourri3d.GeodesicTracer(mesh.V, mesh.F)
    theirs = [
        tracer.trace_geodesic_from_face(int(start.faces[i]), start.barycentric[i], world[i])[-1] for i in range(k)
    ]
    gaps = np.linalg.norm(ends[:k] - theirs, axis=1) / length
    return {"count": count, "elapsed": took[0], "processor": took[1], "gap": float(gaps.max())}


# The tables.


def measured(mesh: Mesh, sources: int, pairs: int, traced: int, seed: int) -> dict[str, Any]:
    drawn = np.random.default_rng(seed).choice(np.unique(mesh.F), max(pairs, sources, 3), replace=False)
    found: dict[str, Any] = {"n": mesh.n_vertices, "log": log_maps(mesh, drawn[:sources])}
    found["vector heat"] = vector_heat(mesh, drawn[:3])
    if pairs:
        found |= {"cost": costs(mesh, drawn[:pairs]), "log time": log_map_times(mesh, drawn[:pairs])}
    if traced:
        found["traces"] = traces(mesh, traced, seed)
    return found


def error_table(meshes: dict[str, Any]) -> list[str]:
    cells = []
    for name, row in meshes.items():
        for way in row["log"][0]["errors"]:
            means = {k: np.mean([log["errors"][way][k] for log in row["log"]]) for k in row["log"][0]["errors"][way]}
            cells.append((name, f"{row['n']}", way, *(f"{value:.2g}" for value in means.values())))
        gap, straight = max(log["gap"] for log in row["log"]), np.mean([log["straight"] for log in row["log"]])
        cells.append((name, "", f"exp(log) {gap:.1g} off, {straight:.0%} of the paths straight", *[""] * 4))
    head = ("mesh", "vertices", "log map", "vector error %", "away from the cut locus %", "median angle", "mean angle")
    return table(head, cells, (0, 2))


def cost_table(meshes: dict[str, Any]) -> list[str]:
    rows = [
        (name, what, *(f"{value:.3g}" for value in ratio))
        for name, row in meshes.items()
        for what, ratio in [*row.get("cost", {}).items(), *row.get("log time", {}).items()]
    ]
    return table(
        ("mesh", "directions over distance; log map over potpourri3d's", "seconds", "other", "ratio"), rows, (0, 1)
    )


def vector_heat_table(meshes: dict[str, Any]) -> list[str]:
    rows = []
    for name, row in meshes.items():
        found = row["vector heat"]
        pairs = [
            f"{ours:.3g} / {theirs:.3g}" for ours, theirs in (found[k] for k in ("angle", "median angle", "value"))
        ]
        rows.append((name, f"{found['between']:.2g}", *pairs))
    head = ("mesh", "median angle between both", "mean angle off the path", "median angle", "mean error of values")
    return table(head, rows)


def markdown(result: dict[str, Any]) -> str:
    meshes = result["meshes"]
    lines = [*error_table(meshes), "", *vector_heat_table(meshes), "", *cost_table(meshes), ""]
    for name, row in meshes.items():
        if "traces" in row:
            t = row["traces"]
            lines.append(
                f"{name}: {t['count']} geodesics in {t['elapsed']:.2f} s, {t['processor']:.2f} s of processors; ends "
                f"differ from potpourri3d's by at most {t['gap']:.1g} of the length."
            )
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", type=Path, nargs="+", help="triangle meshes, manifold and oriented alike")
    parser.add_argument("--sources", type=int, default=2, help="sources of log maps on each mesh (default 2)")
    parser.add_argument("--pairs", type=int, default=0, help="sources whose times are compared (default 0)")
    parser.add_argument("--traces", type=int, default=0, help="geodesics that are traced together (default 0)")
    add_seed(parser)
    add_output(parser, "directions")
    arguments = parser.parse_args(argv)
    meshes = over_meshes(
        arguments.meshes,
        lambda mesh: measured(mesh, arguments.sources, arguments.pairs, arguments.traces, arguments.seed),
    )
    result = {"seed": arguments.seed, "environment": environment(), "meshes": meshes}
    publish(result, markdown(result), folder=arguments.output, name="directions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
