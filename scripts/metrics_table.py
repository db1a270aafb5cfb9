"""Distance in a metric per face, at jumps of the speed, and through tetrahedra: errors and times beside heat alone.

    python scripts/metrics_table.py [--rows 48] [--points 20000] [--sources 3] [--seed 0] [--json FILE]

Every row has a closed form. Prints, as a Markdown table, the mean of |d - exact| / exact over vertices and sources in
percent for the default of `GeodesicSolver` and for other methods, "-" where a method does not apply. "heat" is the
paper's method, ``magnitude="unit"``. For tetrahedra, also by how much the worst value is below the straight line, and
seconds to make the solver and for a query. docs/metrics.md shows the tables.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from heat_igl import (
    AccuracyWarning,
    Mesh,
    geodesic_distance,
    metric_operators,
    shapes,
    speed_operators,
)
from heat_igl.geodesic import SolverChoice
from heat_igl.operators import Operators
from heat_igl.typing import BoolArray, FloatArray
from heat_igl.validation.domains.body_cases import around_the_edge, delaunay, without
from heat_igl.validation.domains.surface_cases import by_fermat, moved_inside, straight

from scaffold import add_json, add_seed, environment, option_parser, publish, table

Truth = Callable[[int], FloatArray]
METHODS: dict[str, dict[str, Any]] = {
    "default": {"method": "auto"},
    "heat": {"magnitude": "unit"},
    "sweep": {"method": "sweep"},
    "windows": {"method": "windows"},
}


def plane(rows: int, rng: np.random.Generator, border: float | None = None) -> Mesh:
    """The unit square, with vertices inside moved by a quarter of an edge; those at x = `border` stay there."""
    mesh = shapes.grid(rows)
    return moved_inside(mesh, rng, 0.25 / rows, None if border is None else mesh.V[:, 0] == border)


def linear_maps(rows: int, rng: np.random.Generator) -> Iterator[tuple[str, Operators, Truth]]:
    for ratio in (1.0, 10.0, 100.0):
        mesh = plane(rows, rng)
        turn = np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]])
        A = np.diag([ratio, 1, 1]) @ turn
        mapped = mesh.V @ A.T
        metric = np.tile(A.T @ A, (mesh.n_faces, 1, 1))
        yield (
            f"one tensor, 1 : {ratio:g}",
            metric_operators(mesh, metric),
            lambda i, mapped=mapped: straight(mapped, i),
        )


def exponential_speeds(rows: int, rng: np.random.Generator) -> Iterator[tuple[str, Operators, Truth]]:
    for contrast in (1e1, 1e3, 1e6):
        strip = shapes.strip(8 * rows // 2, rows // 2)
        mesh = moved_inside(strip, rng, 0.25)
        V = mesh.V
        k = np.log(contrast) / np.ptp(V[:, 0])
        unrolled = np.exp(-k * (V[:, 0] + 1j * (V[:, 1] - V[:, 1].mean()))) / k
        speed = np.exp(k * V[mesh.F][:, :, 0].mean(axis=1))
        yield (
            f"speed growing exponentially, 1 : {contrast:g}",
            speed_operators(mesh, speed),
            lambda i, unrolled=unrolled: np.abs(unrolled - unrolled[i]),
        )


def two_speeds(rows: int, rng: np.random.Generator) -> Iterator[tuple[str, Operators, Truth]]:
    for left, right in ((1.0, 2.0), (1.0, 1e3), (1e3, 1.0), (1.0, 1e6), (1e6, 1.0)):
        mesh = plane(rows, rng, border=0.5)
        speed = np.where(mesh.V[mesh.F][:, :, 0].mean(axis=1) < 0.5, left, right)
        yield (
            f"two speeds, {left:g} beside {right:g}",
            speed_operators(mesh, speed),
            lambda i, V=mesh.V, left=left, right=right: by_fermat(V, i, left, right),
        )


def bodies(points: int, rng: np.random.Generator) -> Iterator[tuple[str, Mesh, Truth]]:
    """Boxes of even tetrahedra, Delaunay tetrahedra of random points, a cube without a quarter, and a hand."""
    rows = round(points ** (1 / 3)) - 1
    scattered = rng.random((points, 3))
    ball = rng.random((2 * points, 3)) - 0.5
    ball = ball[np.linalg.norm(ball, axis=1) < 0.5][:points]
    for name, mesh in (
        ("cube, even tetrahedra", shapes.box(rows)),
        ("cube, Delaunay tetrahedra", delaunay(scattered)),
        ("ball, Delaunay tetrahedra", delaunay(ball)),
    ):
        yield name, mesh, lambda i, V=mesh.V: straight(V, i)
    # A cube without the quarter x, y > 1/2, as many vertices.
    quarter = without(2 * round((points / 6) ** (1 / 3)), lambda centre: (centre[:, :2] > 0.5).all(axis=1))
    yield "three quarters of a cube", quarter, lambda i: around_the_edge(quarter.V, i)
    cells = 9 * round((5 * points) ** (1 / 3) / 9)
    hand = without(cells, lambda centre: ~in_hand(centre) | (np.abs(centre[:, 2] - 0.5) > 1 / 6))
    yield "palm and five fingers", hand, lambda i: across_hand(hand.V, i, cells)


def in_hand(centre: FloatArray) -> BoolArray:
    """A palm below y = 4/9, and above it five fingers, one ninth wide."""
    return (centre[:, 1] < 4 / 9) | (np.floor(9 * centre[:, 0]).astype(int) % 2 == 0)


def across_hand(V: FloatArray, i: int, cells: int) -> FloatArray:
    """Distance in the hand, which is as thick everywhere: exact distance on its plan, and the height beside it."""
    plan = shapes.grid(cells)
    plan = Mesh(plan.V, plan.F[in_hand(plan.V[plan.F].mean(axis=1))])
    number = {place: k for k, place in enumerate(map(tuple, np.rint(cells * plan.V[:, :2]).astype(int).tolist()))}
    on_plan = np.array([number[x, y] for x, y in np.rint(cells * V[:, :2]).astype(int).tolist()])
    flat = geodesic_distance(plan, int(on_plan[i]), method="exact")[on_plan]
    return np.asarray(np.hypot(flat, V[:, 2] - V[i, 2]))


def mean_error(found: FloatArray, exact: FloatArray) -> float:
    away = exact > 0
    return 100 * float(np.mean(np.abs(found - exact)[away] / exact[away]))


def surfaces_table(rows: int, k: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    found = []
    for family in (linear_maps, exponential_speeds, two_speeds):
        for name, domain, truth in family(rows, rng):
            sources = rng.choice(domain.n_given, k, replace=False).tolist()
            row: dict[str, Any] = {"case": name}
            for method, options in METHODS.items():
                if method == "windows" and domain.surface is None:
                    continue
                solver = SolverChoice.of(**options).on(domain)
                row[method] = float(np.mean([mean_error(solver.distance(i), truth(i)) for i in sources]))
            found.append(row)
            print(row, file=sys.stderr, flush=True)
    return found


def bodies_table(points: int, k: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    found = []
    for name, mesh, truth in bodies(points, rng):
        sources = rng.choice(mesh.n_vertices, k, replace=False).tolist()
        row: dict[str, Any] = {"body": name, "vertices": mesh.n_vertices, "tetrahedra": mesh.n_faces}
        for method in ("default", "heat"):
            start = time.perf_counter()
            solver = SolverChoice.of(**METHODS[method]).on(mesh)
            made = time.perf_counter() - start
            start = time.perf_counter()
            distances = [solver.distance(i) for i in sources]
            asked = (time.perf_counter() - start) / k
            below = max(
                float((1 - d[line > 0] / line[line > 0]).max())
                for d, line in zip(
                    distances, (np.linalg.norm(mesh.V - mesh.V[i], axis=1) for i in sources), strict=True
                )
            )
            exact = [truth(i) for i in sources]
            error = float(np.mean([mean_error(d, one) for d, one in zip(distances, exact, strict=True)]))
            above = max(float((d[one > 0] / one[one > 0]).max()) - 1 for d, one in zip(distances, exact, strict=True))
            row[method] = {
                "error": error,
                "above": 100 * max(above, 0),
                "below": 100 * below,
                "made": made,
                "asked": asked,
            }
        found.append(row)
        print(row, file=sys.stderr, flush=True)
    return found


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--rows", type=int, default=48, help="cells along the unit square (default 48)")
    parser.add_argument("--points", type=int, default=20000, help="vertices of bodies (default 20000)")
    parser.add_argument("--sources", type=int, default=3, help="per case (default 3)")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    # That heat is wrong here is what the table shows.
    warnings.simplefilter("ignore", AccuracyWarning)
    rng = np.random.default_rng(arguments.seed)
    surfaces = surfaces_table(arguments.rows, arguments.sources, rng)
    solids = bodies_table(arguments.points, arguments.sources, rng)
    on_surfaces = table(
        ["metric", *(f"{method}, %" for method in METHODS)],
        [(row["case"], *(f"{row[m]:.2g}" if m in row else "-" for m in METHODS)) for row in surfaces],
    )
    in_bodies = table(
        [
            "body",
            "vertices",
            *(f"{m}, %" for m in ("default", "heat")),
            "too long at most, %",
            "below lines, %",
            "default, s + s",
            "heat, s + s",
        ],
        [
            (
                row["body"],
                str(row["vertices"]),
                *(f"{row[m]['error']:.2g}" for m in ("default", "heat")),
                " and ".join(f"{row[m]['above']:.2g}" for m in ("default", "heat")),
                " and ".join(f"{max(row[m]['below'], 0):.2g}" for m in ("default", "heat")),
                *(f"{row[m]['made']:.2g} + {row[m]['asked']:.2g}" for m in ("default", "heat")),
            )
            for row in solids
        ],
    )
    result = {"environment": environment(), "surfaces": surfaces, "bodies": solids}
    publish(result, "\n".join([*on_surfaces, "", *in_bodies]), json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
