"""Log maps, directions, traced geodesics, paths and the vector heat method: errors and times, beside potpourri3d.

    python scripts/directions_table.py bunny.obj spot.obj [--sources 2] [--pairs 16] [--traces 1000]
    python scripts/directions_table.py bunny.obj cow.obj --sources 0 --paths 500 --docs docs/paths_theory.md

Truth is the exact shortest path from every vertex, followed back to the source on the faces of the mesh: the length,
and the direction in which it leaves the source. Vectors are off by their mean error in percent of the mean distance, at
all vertices and away from the cut locus, and by angles in degrees; "exp(log)" is the largest |exp(log x) - x| at the
ends of straight paths, in largest distances. The vector heat method is measured from three sources against the nearest
one along the path. Times are seconds of the processor of ``--pairs`` calls that take turns. Manifold meshes, oriented
alike; needs the extra ``bench``. docs/directions_theory.md shows the tables.

paths: `GeodesicPathSolver` and potpourri3d's `EdgeFlipGeodesicSolver` join so many pairs of vertices by paths, and
straighten a tenth as many loops through four vertices along edges. Counted are results of ours that are shorter and
longer by more than 1e-9, and paths that are longer than the exact distance. Ratios of processor times, ours to theirs,
are the median over the calls, and that of the sums.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np
import potpourri3d
from scipy.sparse import csgraph

import heat_igl
from heat_igl import Mesh, SurfacePoints, VectorHeatSolver, exp_map, log_map, shortest_paths, tangent_frames
from heat_igl.curves import GeodesicPathSolver
from heat_igl.intrinsic import TangentFrames
from heat_igl.typing import AnyArray, BoolArray, FloatArray

from harness import Row, Table, as_they_are, collected, drawn, named, parsed, publish, ratio, seconds

# The log map jumps over an edge if it changes by more than so many of the lengths of the edge.
JUMP = 4.0
# Lengths that differ by a smaller share are the same.
SAME = 1e-9
STRATEGIES = ("VectorHeat", "AffineLocal", "AffineAdaptive")


def exact_log(mesh: Mesh, source: int) -> tuple[AnyArray, BoolArray]:
    """The log map as complex numbers (n,), by paths on the faces of the mesh; which paths (n,) pass no vertex."""
    targets = np.setdiff1d(np.flatnonzero(mesh.components == mesh.components[source]), source)
    paths = shortest_paths(mesh, targets, source)
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


def errors(found: FloatArray, truth: AnyArray, away: BoolArray) -> dict[str, float]:
    """Mean vector errors in percent of the mean distance, and the median and the mean error of the angle in degrees."""
    off = 100 * np.abs(found @ [1, 1j] - truth) / np.abs(truth).mean()
    there = (truth != 0) & (np.abs(found).sum(axis=1) > 0)
    angle = np.degrees(np.abs(np.angle((found @ [1, 1j])[there] / truth[there])))
    vectors = {"vector error %": float(off.mean()), "away from the cut locus %": float(off[away].mean())}
    return vectors | {"median angle": float(np.median(angle)), "mean angle": float(angle.mean())}


def log_maps(name: str, mesh: Mesh, sources: Sequence[int]) -> Iterator[Row]:
    """Errors of each way to the log map, means over the sources."""
    solver, peer = heat_igl.GeodesicSolver(mesh), potpourri3d.MeshVectorHeatSolver(mesh.V, mesh.F)
    x, y, _ = peer.get_tangent_frames()
    found: dict[str, list[dict[str, float]]] = {}
    gaps = []
    for source in sources:
        truth, straight = exact_log(mesh, source)
        angles, away = solver.directions(source), np.ones(mesh.n_vertices, bool)
        # Vertices that an edge joins to one on the other side of the cut locus are not away from it.
        away[mesh.edges[np.abs(np.diff(truth[mesh.edges])[:, 0]) > JUMP * mesh.edge_lengths]] = False
        ways = {"log_map": log_map(mesh, source), "vector-heat": log_map(mesh, source, method="vector-heat")}
        ways["directions"] = TangentFrames.from_angles(angles.departure, angles.distance)
        for strategy in STRATEGIES:
            world = peer.compute_log_map(source, strategy) @ np.stack([x[source], y[source]])
            ways[strategy] = tangent_frames(mesh).from_world(world, np.full(len(world), source))
        for way, log in ways.items():
            found.setdefault(way, []).append(errors(log, truth, away))
        ends = exp_map(mesh, source, ways["log_map"]).positions(mesh)
        gaps.append(np.linalg.norm(ends - mesh.V, axis=1)[straight].max() / np.abs(truth).max())
    for way, each in found.items():
        means = {head: float(np.mean([one[head] for one in each])) for head in each[0]}
        yield {"mesh": name, "log map": way} | means | {"exp(log)": max(gaps) if way == "log_map" else ""}


def vector_heat(name: str, mesh: Mesh, sources: Sequence[int]) -> Row:
    """Mean errors of values and directions from three sources, ours and potpourri3d's."""
    ours, near = VectorHeatSolver(mesh), VectorHeatSolver(mesh, method="windows")
    theirs = potpourri3d.MeshVectorHeatSolver(mesh.V, mesh.F)
    x, y, _ = theirs.get_tangent_frames()
    vectors, values = ours.frames.from_angles([0.0, 2.0, 4.0]), np.array([1.0, 2.0, 4.0])
    world = ours.frames.to_world(vectors, sources)
    given = np.stack([np.einsum("kx,kx->k", world, axis[sources]) for axis in (x, y)], axis=1)
    there = theirs.transport_tangent_vectors(sources, given)
    there = ours.frames.from_world(there[:, :1] * x + there[:, 1:] * y)
    here, truth = (solver.transport(sources, vectors) for solver in (ours, near))
    expected = near.extend(sources, values)

    def turned(found: FloatArray, other: FloatArray) -> FloatArray:
        return np.degrees(np.abs(np.angle((found @ [1, 1j]) * (other @ [1, -1j]))))

    angles = [turned(found, truth) for found in (here, there)]
    off = [np.abs(s - expected).mean() for s in (ours.extend(sources, values), theirs.extend_scalar(sources, values))]
    return {
        "mesh": name,
        "median angle between both": float(np.median(turned(here, there))),
        "mean angle off the path": " / ".join(f"{angle.mean():.3g}" for angle in angles),
        "median angle": " / ".join(f"{np.median(angle):.3g}" for angle in angles),
        "mean error of values": " / ".join(f"{error:.3g}" for error in off),
    }


def times(name: str, mesh: Mesh, sources: Sequence[int]) -> Iterator[Row]:
    """Directions as a share of distance, by kind of source; log maps as a share of potpourri3d's fastest way."""
    V, F, rng = mesh.V, mesh.F, np.random.default_rng(0)
    solver, peer = heat_igl.GeodesicSolver(mesh), potpourri3d.MeshVectorHeatSolver(V, F)
    points = [SurfacePoints([face], [[0.2, 0.3, 0.5]]) for face in rng.integers(0, mesh.n_faces, len(sources))]
    curves = [shortest_paths(mesh, a, b)[0] for a, b in pairwise(sources)]

    def from_arrays(source: int) -> FloatArray:
        return np.asarray(potpourri3d.MeshVectorHeatSolver(V, F).compute_log_map(source, "VectorHeat"))

    calls: dict[str, tuple[Callable[..., object], Callable[..., object], Sequence[object]]] = {
        "directions over distance, vertex": (solver.directions, solver.distance, sources),
        "directions over distance, point": (solver.directions, solver.distance, points),
        "directions over distance, curve": (solver.directions, solver.distance, curves),
        "log map from arrays over potpourri3d's": (lambda v: log_map(Mesh(V, F), v), from_arrays, sources),
        "later log map over potpourri3d's": (
            lambda v: log_map(solver, v),
            lambda v: peer.compute_log_map(v, "VectorHeat"),
            sources,
        ),
    }
    for what, (one, other, each) in calls.items():
        turns = [each[0], *each]
        found = np.array([[seconds(lambda f=f, a=a: f(a)) for f in (one, other)] for a in turns])[1:].T
        medians = np.median(found, axis=1)
        yield {"mesh": name, "what": what, "seconds": medians[0], "other": medians[1], "ratio": ratio(*found)}


def traces(name: str, mesh: Mesh, count: int, seed: int) -> Row:
    """Seconds of one batch of geodesics a quarter as long as the mesh, and how far some end from potpourri3d's."""
    rng = np.random.default_rng(seed)
    start = SurfacePoints(rng.integers(0, mesh.n_faces, count), rng.dirichlet([1, 1, 1], count))
    length = mesh.longest_distance / 4
    vectors = length * TangentFrames.from_angles(rng.uniform(0, 2 * np.pi, count))
    begin, ticks = time.perf_counter(), time.process_time()
    ends = exp_map(mesh, start, vectors).positions(mesh)
    took = {"elapsed, s": time.perf_counter() - begin, "processors, s": time.process_time() - ticks}
    corners, k = mesh.V[mesh.F[start.faces]], min(count, 200)
    x = corners[:, 1] - corners[:, 0]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    normal = np.cross(x, corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    world = vectors[:, :1] * x + vectors[:, 1:] * np.cross(normal, x)
    trace = potpourri3d.GeodesicTracer(mesh.V, mesh.F).trace_geodesic_from_face
    theirs = [trace(int(start.faces[i]), start.barycentric[i], world[i])[-1] for i in range(k)]
    gap = float(np.linalg.norm(ends[:k] - theirs, axis=1).max() / length)
    return {"mesh": name, "geodesics": count} | took | {"ends differ by at most": gap}


def edge_loop(mesh: Mesh, stops: list[int]) -> list[int]:
    """The vertices of the loop along shortest ways of edges through some vertices."""
    loop: list[int] = []
    for a, b in pairwise([*stops, stops[0]]):
        before = csgraph.dijkstra(mesh.edge_graph, directed=False, indices=b, return_predecessors=True)[1]
        while a != b:
            loop.append(int(a))
            a = int(before[a])
    return loop


def paths(name: str, mesh: Mesh, n_pairs: int, seed: int) -> Iterator[Row]:
    """A row for paths and one for loops."""
    rng = np.random.default_rng(seed)
    usable = np.flatnonzero(mesh.components == mesh.components[mesh.F[0, 0]])
    pairs = [rng.choice(usable, 2, replace=False).tolist() for _ in range(n_pairs)]
    loops = [edge_loop(mesh, rng.choice(usable, 4, replace=False).tolist()) for _ in range(max(n_pairs // 10, 1))]
    curves = [heat_igl.edge_curve(mesh, loop, closed=True) for loop in loops]
    ours, theirs = GeodesicPathSolver(mesh), potpourri3d.EdgeFlipGeodesicSolver(mesh.V, mesh.F)
    found: dict[str, list[tuple[float, float, float, float]]] = {"paths": [], "loops": []}

    def take(kind: str, one: Callable[[], object], other: Callable[[], FloatArray]) -> None:
        kept: list[object] = []
        times = seconds(lambda: kept.append(one())), seconds(lambda: kept.append(other()))
        length = np.linalg.norm(np.diff(kept[1], axis=0), axis=1).sum()  # type: ignore[call-overload]
        found[kind].append((*times, kept[0].lengths(mesh).sum(), length))  # type: ignore[attr-defined]

    for pair in [pairs[0], *pairs]:
        take("paths", lambda p=pair: ours.path(p), lambda p=pair: theirs.find_geodesic_path(*p))
    del found["paths"][0]
    for curve, loop in zip(curves, loops, strict=True):
        take("loops", lambda c=curve: ours.straighten(c), lambda v=loop: theirs.find_geodesic_loop(np.array(v)))
    for kind, values in found.items():
        time, peer_time, length, other = np.array(values).T
        excess = (length - other) / other.clip(mesh.edge_lengths.mean())
        row = {"mesh": name, "n": mesh.n_vertices, "kind": kind, "count": len(values), "most": 100 * excess.max()}
        row |= {"shorter": int((excess < -SAME).sum()), "longer": int((excess > SAME).sum())}
        row |= {"median time": np.median(time / peer_time), "time": time.sum() / peer_time.sum()}
        if kind == "paths":
            exact = heat_igl.pair_distances(mesh, np.array(pairs))
            row["not shortest"] = [int((each > exact * (1 + SAME)).sum()) for each in (length, other)]
        yield row


PATHS = {
    "mesh": "mesh", "vertices": "{n}", "kind": "{kind}", "count": "{count}",
    "shorter / longer": "{shorter} / {longer}", "longer by at most, %": "{most:.2g}",
    "time": "{median time:.2f}, {time:.2f}",
    "not the shortest: here / flips": "{not shortest[0]} / {not shortest[1]}",
}  # fmt: skip


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", sources=2, pairs=0, traces=0, paths=0)
    parts: dict[str, list[Row]] = {"log maps": [], "vector heat": [], "times": [], "traces": [], "paths": []}
    for name, mesh in (named(options.meshes) or {"bunny": heat_igl.sample_mesh()}).items():
        vertices = drawn(mesh, max(options.pairs, options.sources, 3), options.seed)
        if options.sources:
            parts["log maps"] += collected(log_maps(name, mesh, vertices[: options.sources]))
            parts["vector heat"] += collected([vector_heat(name, mesh, vertices[:3])])
        if options.pairs:
            parts["times"] += collected(times(name, mesh, vertices[: options.pairs]))
        if options.traces:
            parts["traces"] += collected([traces(name, mesh, options.traces, options.seed)])
        if options.paths:
            parts["paths"] += collected(paths(name, mesh, options.paths, options.seed))
    tables: dict[str, Table] = {part: as_they_are(rows) for part, rows in parts.items() if rows}
    if parts["paths"]:
        tables["paths"] = Table(parts["paths"], PATHS)
    publish(options, tables)


if __name__ == "__main__":
    main()
