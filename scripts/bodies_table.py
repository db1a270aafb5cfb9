"""Distance through bodies whose walls are concave: errors against finer tetrahedra, and times beside heat alone.

    python scripts/bodies_table.py [--sources 4] [--seed 0] [--json FILE]
    python scripts/bodies_table.py --meshes octopus.mesh --sources 22     # these bodies of tetrahedra instead

Bodies are cut out of even or random tetrahedra; walls that follow no face are jagged. "Finer" is the same solver on
tetrahedra halved twice (cut into 64), or once on more than 3000 vertices: an upper bound, nearer unless it misses a
way. Prints, as a Markdown table over all vertices and sources: the number of edges around which paths bend; the mean
of |d - finer| / finer, and by how much d is longer and shorter at most, in percent; by how much the worst is below the
straight line; where the solver itself halves tetrahedra once (up to 1000 vertices), the mean and the longest without;
milliseconds for a query (without that), and their ratio to those with ``magnitude="unit"``, medians by the clock.
docs/metrics.md shows the table.
"""

from __future__ import annotations

import statistics
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import AccuracyWarning, HeatMethodSolver, Mesh, read_mesh, shapes
from heat_igl.operators import MetricSimplices
from heat_igl.sources import source_set
from heat_igl.typing import BoolArray, FloatArray
from heat_igl.unfolding import FrontSolver
from heat_igl.unfolding.reflex_edges import reflex_edges
from heat_igl.validation.domains.body_cases import delaunay, without

from scaffold import add_json, add_seed, environment, option_parser, publish, table

Cut = Callable[[FloatArray], BoolArray]
# A body of more vertices is halved once for its reference.
_MANY = 3000


def random(n: int, cut: Cut, rng: np.random.Generator) -> Mesh:
    """`without`, but of Delaunay tetrahedra whose vertices are moved by up to 0.4 cells along each axis."""
    cube = delaunay(moved(shapes.box(n).V, 0.4 / n, rng))
    return part(cube, ~cut(cube.V[cube.F].mean(axis=1)))


def moved(V: FloatArray, most: float, rng: np.random.Generator) -> FloatArray:
    """Points away from a grid or a sphere, where Delaunay tetrahedra are not unique and Qhull leaves slits."""
    return V + rng.uniform(-most, most, V.shape)


def part(mesh: Mesh, kept: BoolArray) -> Mesh:
    used, F = np.unique(mesh.F[kept], return_inverse=True)
    return Mesh(mesh.V[used], F.reshape(-1, 4))


def shell(hollow: float, points: int, rng: np.random.Generator) -> Mesh:
    """A ball of radius 1 with a concentric hollow, 642 vertices on each wall, and random points between."""
    sphere = shapes.icosphere(3).V
    P = rng.uniform(-1, 1, (20 * points, 3))
    radius = np.linalg.norm(P, axis=1)
    between = P[(radius > hollow + 0.05) & (radius < 0.95)][:points]
    walls = moved(np.concatenate([hollow * sphere, sphere]), 1e-3, rng)
    ball = delaunay(np.concatenate([walls, between]))
    return part(ball, ball.F.max(axis=1) >= len(sphere))


def ring(around: int, along: int, points: int, rng: np.random.Generator) -> Mesh:
    """The inside of a torus of these vertices, and random points in it."""
    P = rng.uniform(-1.4, 1.4, (20 * points, 3)) * [1, 1, 2 / 7]
    wall = moved(shapes.torus(around, along, 0.4).V, 1e-3, rng)
    hull = delaunay(np.concatenate([wall, P[in_tube(P, 0.34)][:points]]))
    return part(hull, in_tube(hull.V[hull.F].mean(axis=1), 0.4))


def in_tube(P: FloatArray, radius: float) -> BoolArray:
    return np.asarray(np.hypot(np.hypot(P[:, 0], P[:, 1]) - 1, P[:, 2]) < radius)


def in_box(P: FloatArray, low: float | list[float], high: float | list[float]) -> BoolArray:
    return np.asarray(((np.asarray(low) < P) & (np.asarray(high) > P)).all(axis=1))


def in_ball(P: FloatArray, middle: list[float], radius: float) -> BoolArray:
    return np.asarray(np.linalg.norm(P - np.asarray(middle), axis=1) < radius)


def holes(P: FloatArray) -> BoolArray:
    return np.asarray((np.floor(5 * P[:, :2]).astype(int) % 2 == 1).all(axis=1))


def beyond_union(P: FloatArray) -> BoolArray:
    two = in_ball(P, [0.25, 0.25, 0.25], 0.25) | in_ball(P, [0.7, 0.4, 0.65], 0.3)
    return ~(two | in_box(P, [0.2, 0.2, 0.15], [0.8, 0.4, 0.4]))


def two_balls(P: FloatArray) -> BoolArray:
    return in_ball(P, [0.3, 0.3, 0.5], 0.3) | in_ball(P, [0.9, 0.8, 0.5], 0.4)


def bodies(rng: np.random.Generator) -> Iterator[tuple[str, Mesh]]:
    yield "cube, even", shapes.box(15)
    yield "U, random", random(9, lambda P: in_box(P, [1 / 3, 1 / 3, -1], [2 / 3, 2, 2]), rng)
    yield "block with a cavity, even", without(8, lambda P: in_box(P, 0.25, 0.75))
    yield "block with a cavity, random", random(10, lambda P: in_box(P, 0.25, 0.75), rng)
    yield "block with four holes, even", without(10, holes)
    yield "block with four holes, random", random(15, holes, rng)
    yield "frame of rods, even", without(10, lambda P: (np.abs(P - 0.5) < 0.3).sum(axis=1) > 1)
    yield "shell", shell(0.5, 2000, rng)
    yield "thin shell without a vertex inside", shell(0.8, 0, rng)
    yield "torus", ring(16, 40, 400, rng)
    yield "torus without a vertex inside", ring(10, 25, 0, rng)
    yield "union of balls and a box, random", random(14, beyond_union, rng)
    yield "cube without two balls, random", random(10, two_balls, rng)
    yield "cube without two balls, random", random(20, two_balls, rng)


def reference(mesh: Mesh) -> Callable[[int], FloatArray]:
    """Distance at the vertices on tetrahedra halved twice, or once."""
    finer = MetricSimplices.in_space(mesh).halved()
    if mesh.n_vertices <= _MANY:
        finer = finer.halved()
    # Of two sources, each vertex first looks for the nearer in space: the other is far away, in no tetrahedron.
    far = mesh.V.max(axis=0) + 10 * np.ptp(mesh.V, axis=0)
    solver = HeatMethodSolver(Mesh(np.vstack([finer.V, far]), finer.corners))
    return lambda i: solver.distance([i, finer.n])[: mesh.n_vertices]


def excess(found: FloatArray, other: FloatArray) -> FloatArray:
    """By how much distances are longer than others that are neither 0 nor infinite, in percent of these."""
    away = (other > 0) & np.isfinite(other)
    return 100 * (found[away] / other[away] - 1)


def timed(query: Callable[[int], FloatArray], sources: Sequence[int]) -> tuple[list[FloatArray], float]:
    """Distances from each source, and milliseconds for one, the median; the first query prepares."""
    query(sources[0])
    found, seconds = [], []
    for i in sources:
        start = time.perf_counter()
        found.append(query(i))
        seconds.append(time.perf_counter() - start)
    return found, 1000 * statistics.median(seconds)


def measured(name: str, mesh: Mesh, sources: Sequence[int]) -> dict[str, Any]:
    n = mesh.n_vertices
    found, asked = timed(HeatMethodSolver(mesh).distance, sources)
    _, asked_heat = timed(HeatMethodSolver(mesh, magnitude="unit").distance, sources)
    as_it_is = FrontSolver(MetricSimplices.in_space(mesh), is_halved=True)
    given, asked_given = timed(lambda i: as_it_is.distances([source_set(i, n, None)], np.empty((n, 1)))[0], sources)
    shortest = reference(mesh)
    finer = [shortest(i) for i in sources]
    lines = [np.linalg.norm(mesh.V - mesh.V[i], axis=1) for i in sources]
    row: dict[str, Any] = {"body": name, "vertices": n, "edges": len(reflex_edges(mesh.F, mesh.V)[0])}
    # Halved tetrahedra are taken where they give less.
    row["is_halved"] = any((d < one).any() for d, one in zip(found, given, strict=True))
    for key, distances in (("default", found), ("given", given)):
        error = np.concatenate([excess(d, one) for d, one in zip(distances, finer, strict=True)])
        row[key] = {"mean": float(np.abs(error).mean()), "longer": float(error.max()), "shorter": -float(error.min())}
    row["below"] = -min(float(excess(d, line).min()) for d, line in zip(found, lines, strict=True))
    return row | {"asked": asked, "asked_given": asked_given, "ratio": asked / asked_heat}


def cells(row: dict[str, Any]) -> list[str]:
    """Percents below 1e-4 are rounded to 0."""
    default, given = row["default"], row["given"]
    percents = (*default.values(), row["below"], given["mean"], given["longer"])
    *errors, mean, longer = (f"{value if value > 1e-4 else 0:.2g}" for value in percents)
    unhalved = f"{mean} and {longer}" if row["is_halved"] else "-"
    asked = f"{row['asked']:.0f}" + (f" ({row['asked_given']:.0f})" if row["is_halved"] else "")
    return [row["body"], str(row["vertices"]), str(row["edges"]), *errors, unhalved, asked, f"{row['ratio']:.0f}"]


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--meshes", type=Path, nargs="+", default=[], metavar="MESH", help="files of tetrahedra")
    parser.add_argument("--sources", type=int, default=4, help="per body (default 4)")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    # Times of heat are asked for, not its errors.
    warnings.simplefilter("ignore", AccuracyWarning)
    rng = np.random.default_rng(arguments.seed)
    rows = []
    for name, mesh in [(path.stem, read_mesh(path)) for path in arguments.meshes] or bodies(rng):
        sources = rng.choice(np.unique(mesh.F), arguments.sources, replace=False).tolist()
        rows.append(measured(name, mesh, sources))
        print(rows[-1], file=sys.stderr, flush=True)
    result = {"environment": environment(), "bodies": rows}
    head = "body|vertices|edges|mean, %|longer, %|shorter, %|below lines, %|not halved, %|ms|ratio to heat".split("|")
    publish(result, "\n".join(table(head, map(cells, rows))), json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
