"""Distance on point clouds: error and time, beside potpourri3d's solver on the same points.

    python scripts/clouds_table.py distances [MESH ...] [--sizes 5000 50000] [--noise 0 0.01] [--shapes torus]
    python scripts/clouds_table.py turns [MESH ...] [--repeats 15]   # errors, and times as ratios
    python scripts/clouds_table.py log-maps MESH ...
    python scripts/clouds_table.py scans [--sizes 1000 5000 20000] [--sources 3]   # noise, outliers, uneven density
    python scripts/clouds_table.py warnings [--sizes 600] [--seed 10000]   # of how many random clouds, right or wrong
    python scripts/clouds_table.py limits [--repeats 15]   # what is closed, connected or torn

Random points on a sphere of radius 1, a torus of radii 1 and 0.4, a cylinder of radius 1 and height 3, and a square
with sides of length 1, or the vertices of meshes; noise is Gaussian in all coordinates. distances: the mean of
|d - exact| / exact in percent, and seconds of all processors together to make the solver and for a query. turns: median
ratios of processor time in turns, of the solver, of the solver with the first query, for which potpourri3d factors, and
of a later query; mean errors, of meshes also that on the restricted Delaunay triangulation, which knows the surface;
the share of doubtful points, not counting folds, with a star where the cloud warned. log-maps: the median angle to the
exact one of the mesh in degrees, and the mean of |v - exact| / |exact| in percent. scans: mean errors in percent of
default / potpourri3d / the shortest path in the graph of 8 neighbours. warnings: of so many random points on random
surfaces, how many clouds are wrong by more than 5 % in the mean from one source, and silent, and how many are right
within 2 % and warn, other than of several parts. limits: the least and the most parts and boundaries of so many random
clouds, and how many warn. Needs ``bench``; see docs/clouds_theory.md.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from itertools import product

import numpy as np
from potpourri3d import PointCloudHeatSolver
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

import heat_igl
from heat_igl import GeodesicSolver, Mesh, PointCloud, VectorHeatSolver, log_map, shapes, tangent_frames
from heat_igl.typing import FloatArray, IntArray
from heat_igl.validation.construction import on_sphere
from heat_igl.validation.zoo import FAMILIES

from harness import Query, Row, Table, collected, drawn, errors, mean_error, named, parsed, publish, seconds, warned

Points = tuple[FloatArray, Query]
Scan = Callable[[FloatArray, np.random.Generator], tuple[FloatArray, IntArray]]


def sphere(n: int, rng: np.random.Generator) -> Points:
    P = on_sphere(n, rng)
    return P, lambda i: 2 * np.arcsin(np.clip(np.linalg.norm(P - P[i], axis=1) / 2, 0, 1))


def cylinder(n: int, rng: np.random.Generator) -> Points:
    angle, height = rng.random((2, n)) * [[2 * np.pi], [3]]
    P = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
    return P, lambda i: np.hypot(np.angle(np.exp(1j * (angle - angle[i]))), height - height[i])


def square(n: int, rng: np.random.Generator) -> Points:
    P = np.append(rng.random((n, 2)), np.zeros((n, 1)), axis=1)
    return P, lambda i: np.linalg.norm(P - P[i], axis=1)


def torus(n: int, rng: np.random.Generator) -> Points:
    """Random vertices of a fine mesh, on which distance is exact."""
    finer = int(np.ceil(np.sqrt(n / 144_000)))
    mesh = shapes.torus(240 * finer, 600 * finer)
    chosen = rng.choice(mesh.n_vertices, n, replace=False)
    solver = GeodesicSolver(mesh)
    return mesh.V[chosen], lambda i: solver.distance(int(chosen[i]))[chosen]


SHAPES = {"sphere": sphere, "torus": torus, "cylinder": cylinder, "square": square}


def _graph(P: FloatArray) -> Query:
    """The shortest way along edges to the 8 nearest points."""
    length, index = KDTree(P).query(P, 9)
    rows = np.repeat(np.arange(len(P)), 8)
    graph = csr_array((length[:, 1:].ravel(), (rows, index[:, 1:].ravel())), shape=(len(P), len(P)))
    return lambda i: np.asarray(dijkstra(graph, directed=False, indices=i))


def _surface(P: FloatArray) -> tuple[IntArray, str]:
    """The points of a cloud that may make it warn, and a star if it warned."""
    made, is_warned = warned(lambda: PointCloud(P)._made)
    return made[1], "*" * is_warned


def _restricted(mesh: Mesh, truth: Query) -> Query:
    """Distance on triangles dual to Voronoi cells of the vertices on the mesh, and exact where these reach no point."""
    fine, originals = mesh, PointCloud(mesh.V).originals
    while fine.n_faces < 1_500_000:
        fine = fine.halved()
    corners = np.sort(originals[KDTree(mesh.V).query(fine.V)[1]][fine.F], axis=1)
    distinct = (corners[:, :-1] < corners[:, 1:]).all(axis=1)
    solver = GeodesicSolver(Mesh(mesh.V, np.unique(corners[distinct], axis=0)))

    def distance(i: int) -> FloatArray:
        found = solver.distance(int(originals[i]))[originals]
        return np.where(np.isfinite(found), found, truth(i))

    return distance


METHODS: dict[str, Callable[[FloatArray], Query]] = {
    "heat": lambda P: heat_igl.HeatMethodSolver(PointCloud(P)).distance,
    "default": lambda P: GeodesicSolver(PointCloud(P)).distance,
    "windows": lambda P: GeodesicSolver(PointCloud(P), method="windows").distance,
    "potpourri3d": lambda P: PointCloudHeatSolver(P).compute_distance,
}


def noisy(share: float) -> Scan:
    """Gaussian noise in all coordinates, in shares of half the largest extent."""
    extent = lambda P: np.ptp(P, axis=0).max()  # noqa: E731
    return lambda P, rng: (P + share * extent(P) / 2 * rng.standard_normal(P.shape), np.arange(len(P)))


def with_outliers(P: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
    """2 % more points anywhere in the box around the others, a tenth larger on each side."""
    low, size = P.min(axis=0), np.ptp(P, axis=0).max()
    box = low - 0.1 * size + rng.random((len(P) // 50, 3)) * (np.ptp(P, axis=0) + 0.2 * size)
    return np.concatenate([P, box]), np.arange(len(P))


def graded(P: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
    """The points that are left if the density falls by a factor of 100 along the first axis."""
    chosen = np.flatnonzero(rng.random(len(P)) < 100.0 ** -((P[:, 0] - P[:, 0].min()) / np.ptp(P[:, 0])))
    return P[chosen], chosen


def with_copies(P: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
    """A tenth of the points twice."""
    return np.concatenate([P, P[rng.choice(len(P), len(P) // 10, replace=False)]]), np.arange(len(P))


def with_patches_missing(P: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
    """The points that are left if five balls of a twelfth of the extent, about points, were not scanned."""
    middles = P[rng.choice(len(P), 5, replace=False)]
    chosen = np.flatnonzero(KDTree(middles).query(P)[0] > np.ptp(P, axis=0).max() / 12)
    return P[chosen], chosen


# From points of a surface, a scan of them, and which of them its first points are.
SCANS: dict[str, Scan] = {
    "clean": noisy(0.0),
    "noise 1 %": noisy(0.01),
    "noise 3 %": noisy(0.03),
    "outliers 2 %": with_outliers,
    "density 1:100": graded,
    "copies 10 %": with_copies,
    "patches missing": with_patches_missing,
}


def scans(options: argparse.Namespace) -> Iterator[Row]:
    for (name, scan), n in product(SCANS.items(), options.sizes):
        row: Row = {"scan": name, "number": n}
        for shape in options.shapes:
            rng = np.random.default_rng(options.seed)
            # Of a falling density a fifth is left.
            P, truth = SHAPES[shape](5 * n if name.startswith("density") else n, rng)
            points, kept = scan(P, rng)
            sources = rng.choice(len(kept), options.sources, replace=False)
            row[shape] = {"warned": _surface(points)[1], "missing": 0}
            exact = {i: truth(int(kept[i]))[kept] for i in sources.tolist()}
            for method in ("default", "potpourri3d", "graph"):
                query, off = (_graph if method == "graph" else METHODS[method])(points), []
                for i in exact:
                    found = query(i)[: len(kept)]
                    off.append(errors(found, np.where(np.isfinite(found), exact[i], np.inf))["mean"])
                    row[shape]["missing"] = max(row[shape]["missing"], int((~np.isfinite(found)).sum()))
                row[shape][method] = float(np.mean(off))
        yield row


def _made(method: str, P: FloatArray) -> tuple[Query, float]:
    """The query of a method, and the time to make its solver."""
    start = time.process_time()
    return METHODS[method](P), time.process_time() - start


def clouds(options: argparse.Namespace) -> Iterator[tuple[Row, FloatArray, Query]]:
    """What it is, the points, and the distance between them."""
    for name, mesh in named(options.meshes).items():
        yield {"points on": name, "number": mesh.n_vertices, "mesh": mesh}, mesh.V, GeodesicSolver(mesh).distance
    for name, n, noise in product(options.shapes, options.sizes, options.noise) if not options.meshes else ():
        rng = np.random.default_rng(options.seed)
        P, truth = SHAPES[name](n, rng)
        yield {"points on": name, "number": n, "noise": noise}, P + noise * rng.standard_normal(P.shape), truth


def distances(options: argparse.Namespace) -> Iterator[Row]:
    for row, P, truth in clouds(options):
        sources = np.random.default_rng(options.seed).choice(len(P), options.sources, replace=False).tolist()
        for method in options.methods:
            query, made = _made(method, P)
            query(sources[0])
            asked = np.mean([seconds(lambda i=i, q=query: q(i)) for i in sources])
            row[method] = {"error": mean_error(query, sources, truth), "made": made, "asked": asked}
        yield row


def turns(options: argparse.Namespace) -> Iterator[Row]:
    """Errors, and median ratios of processor times to potpourri3d's."""

    def stages(method: str, P: FloatArray) -> tuple[float, float, float]:
        query, made = _made(method, P)
        return made, made + seconds(lambda: query(0)), seconds(lambda: query(len(P) // 2))

    for row, P, truth in clouds(options):
        doubtful, warned = _surface(P)
        row["doubtful"] = f"{100 * len(doubtful) / len(P):.2g}{warned}"
        sources = np.random.default_rng(options.seed).choice(len(P), options.sources, replace=False).tolist()
        row |= {method: mean_error(METHODS[method](P), sources, truth) for method in ("default", "potpourri3d")}
        if "mesh" in row:
            row["restricted"] = mean_error(_restricted(row.pop("mesh"), truth), sources, truth)
        ratios = [np.divide(stages("default", P), stages("potpourri3d", P)) for _ in range(options.repeats)]
        yield row | dict(zip(("solver", "both", "later"), np.median(ratios, axis=0), strict=True))


def on_random_surface(seed: int) -> tuple[str, FloatArray, FloatArray]:
    """A family of meshes, random points on the surface of a member, and exact distances from the first."""
    rng, name = np.random.default_rng(seed), list(FAMILIES)[seed % len(FAMILIES)]
    mesh = FAMILIES[name](seed)
    n, area = int(np.exp(rng.uniform(np.log(300), np.log(4000)))), mesh.measures
    r, s = np.sqrt(rng.random(n)), rng.random(n)
    at = heat_igl.SurfacePoints(
        rng.choice(len(area), n, p=area / area.sum()), np.stack([1 - r, r * (1 - s), r * s], axis=1)
    )
    first = heat_igl.SurfacePoints(at.faces[:1], at.barycentric[:1])
    return name, at.positions(mesh), heat_igl.geodesic_distance(mesh, first, targets=at)


def judged(options: argparse.Namespace) -> Iterator[Row]:
    """How many random clouds of each family are wrong and right, and how many of both warn."""
    counts = {name: np.zeros(4, int) for name in [*FAMILIES, "all"]}
    for seed in range(options.seed, options.seed + options.sizes[0]):
        name, P, truth = on_random_surface(seed)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = GeodesicSolver(PointCloud(P), method="exact").distance(0)
        # Between parts both are infinite; one alone is wrong by the whole distance.
        with np.errstate(invalid="ignore"):
            error = np.where(found == truth, 0, np.minimum(np.abs(found - truth) / np.minimum(found, truth), 1))
        parts = any("several parts" in str(warning.message) for warning in caught)
        wrong, right = np.nanmean(error) > 0.05, np.nanmean(error) < 0.02 and not parts
        for each in (name, "all"):
            counts[each] += [wrong, wrong and not caught, right, right and bool(caught)]
    for name, count in counts.items():
        yield {"family": name} | dict(zip(("wrong", "silent", "right", "said"), count.tolist(), strict=True))


# Points for a value and a generator, and the values.
LIMITS: dict[str, tuple[Callable[[float, np.random.Generator], FloatArray], Sequence[float]]] = {
    "spheres, spacings apart": (lambda gap, rng: on_sphere(6000, rng) * (
        1 + gap * np.sqrt(4 * np.pi / 3000) * (np.arange(6000) % 2)[:, None]), (1.5, 2, 2.5, 3)),
    "hole, spacings across": (lambda width, rng: (
        P := square(3000, rng)[0])[np.hypot(*P[:, :2].T - 0.5) > width / 2 / 3000**0.5], (5, 6, 7, 8)),
    "rows, spacings apart": (lambda apart, rng: square(3000, rng)[0] / 5 + np.stack(
        [(k := np.arange(3000)) % 100, apart * (k // 100), 0 * k], axis=1), (5, 10, 15, 20)),
    "density, jump": (lambda jump, rng: square(30_000, rng)[0] + np.outer(
        rng.random(30_000) < 1 / (1 + jump), [1, 0, 0]), (10, 50, 100)),
}  # fmt: skip


def limits(options: argparse.Namespace) -> Iterator[Row]:
    for name, value in ((name, value) for name, (_, values) in LIMITS.items() for value in values):
        found = []
        for seed in range(options.seed, options.seed + options.repeats):
            cloud = PointCloud(LIMITS[name][0](value, np.random.default_rng(seed)))
            report, is_warned = warned(cloud.report)
            found.append((report.n_components, report.n_boundary_loops, is_warned))
        parts, boundaries = (f"{min(each)} to {max(each)}" for each in list(zip(*found, strict=True))[:2])
        said = sum(is_warned for *_, is_warned in found)
        yield {"points": name, "number": value, "parts": parts, "boundaries": boundaries, "warned": said}


def log_maps(options: argparse.Namespace) -> Iterator[Row]:
    """Median angle and mean error of the vectors of each method, in the planes of the mesh."""
    for vertices, mesh in named(options.meshes).items():
        on_mesh, peer = tangent_frames(mesh), PointCloudHeatSolver(mesh.V)
        heat, paths = (VectorHeatSolver(PointCloud(mesh.V), method=method) for method in ("heat", "windows"))
        solvers = {"heat": (heat.log_map, heat.frames.x, heat.frames.y)}
        solvers["paths"] = (paths.log_map, paths.frames.x, paths.frames.y)
        solvers["potpourri3d"] = (peer.compute_log_map, *peer.get_tangent_frames()[:2])
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in solvers}
        for i in drawn(mesh, options.sources, options.seed):
            exact = log_map(mesh, i, method="exact")
            away = np.linalg.norm(exact, axis=1) > 0
            for name, (ask, x, y) in solvers.items():
                world = ask(i) @ np.stack([x[i], y[i]])
                a, b = (v[away] @ [1, 1j] for v in (on_mesh.from_world(world, np.full(len(world), i)), exact))
                angle = np.degrees(np.median(np.abs(np.angle(a * b.conj()))[a != 0]))
                found[name].append((float(angle), float(100 * np.mean(np.abs(a - b) / np.abs(b)))))
        yield {"vertices of": vertices} | {name: np.mean(each, axis=0).tolist() for name, each in found.items()}


ROWS = {"distances": distances, "turns": turns, "scans": scans, "warnings": judged, "limits": limits}
ROWS |= {"log-maps": log_maps}


def main(argv: Sequence[str] | None = None) -> None:
    several = {"shapes": [*SHAPES], "sizes": [5000, 50000], "noise": [0.0, 0.01], "methods": [*METHODS]}
    options = parsed(__doc__, argv, "*", ROWS, sources=6, repeats=15, **several)
    head = {"points on": "{points on}", "number": "{number}", "noise": "{noise:g}"}
    scan = "{{{0}[default]:.2g}} / {{{0}[potpourri3d]:.2g}} / {{{0}[graph]:.2g}}{{{0}[warned]}}"
    columns = {
        "distances": head
        | {f"{m}, %": f"{{{m}[error]:.2g}}" for m in options.methods}
        | {f"{m}, s + s": f"{{{m}[made]:.2g}} + {{{m}[asked]:.2g}}" for m in options.methods},
        "turns": head
        | {"doubtful, %": "{doubtful}", "default, %": "{default:.2g}", "restricted Delaunay, %": "{restricted:.2g}"}
        | {"potpourri3d, %": "{potpourri3d:.2g}", "solver": "{solver:.2f}"}
        | {"solver and first query": "{both:.2f}", "later query": "{later:.2f}"},
        "scans": {"scan": "{scan}", "number": "{number}"} | {shape: scan.format(shape) for shape in options.shapes},
        "warnings": {key: key for key in ("family", "wrong", "silent", "right", "said")},
        "limits": {key: key for key in ("points", "number", "parts", "boundaries", "warned")},
        "log-maps": {"vertices of": "{vertices of}"}
        | {f"{m}, degrees, %": f"{{{m}[0]:.2g}}, {{{m}[1]:.2g}}" for m in ("heat", "paths", "potpourri3d")},
    }
    publish(options, {options.table: Table(collected(ROWS[options.table](options)), columns[options.table])})


if __name__ == "__main__":
    main()
