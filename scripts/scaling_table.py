"""Time and work on meshes with many vertices that no face uses, many components, and many faces twice.

    python scripts/scaling_table.py                                   # 10k, 100k and 1M vertices
    python scripts/scaling_table.py --sizes 10000 --output DIRECTORY  # where scaling.json and scaling.md go

Linear time means that microseconds per vertex do not grow with the number of vertices.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from heat_igl import HeatMethodSolver, Mesh, geodesic_distance, shapes
from heat_igl.linear import dissection

from scaffold import add_output, environment, option_parser, publish, table


def with_unused(n: int) -> Mesh:
    """A sphere of 2562 vertices, and as many that no face uses as there are to n."""
    sphere = shapes.icosphere(4)
    return Mesh(np.concatenate([sphere.V, np.random.default_rng(0).normal(size=(n - sphere.n_vertices, 3))]), sphere.F)


def of_components(n: int) -> Mesh:
    """Spheres of 42 vertices, n vertices altogether."""
    sphere = shapes.icosphere(1)
    copies = np.arange(n // sphere.n_vertices)[:, None, None]
    return Mesh((sphere.V + 3 * copies).reshape(-1, 3), (sphere.F + sphere.n_vertices * copies).reshape(-1, 3))


def with_duplicates(n: int) -> Mesh:
    """A square of about n vertices, every second face twice."""
    square = shapes.grid(int(np.sqrt(n)) - 1)
    return Mesh(square.V, np.concatenate([square.F, square.F[::2]]))


KINDS: dict[str, Callable[[int], Mesh]] = {
    "unused vertices": with_unused,
    "components": of_components,
    "duplicate faces": with_duplicates,
}


def dissection_work(n: int, unused: bool) -> int:
    """How often the dissection looks at a vertex while it splits off components, for about n vertices.

    It looks at all of a part for each component in it. The graph is that of a mesh with unused vertices, or of
    components of four vertices each, on a ring.
    """
    if unused:
        ends, neighbours = np.zeros(n + 1, np.int32), np.empty(0, np.int32)
    else:
        first, step = np.divmod(np.arange(n - n % 4), 4)
        neighbours = (4 * first[:, None] + (step[:, None] + [1, 3]) % 4).ravel().astype(np.int32)
        ends = np.arange(0, len(neighbours) + 1, 2, dtype=np.int32)
    parts = dissection._apart(ends, neighbours)
    size = 1 if unused else 4
    return sum((high - low) * ((high - low) // size) for _, low, high in parts)


def measured(kind: str, n: int) -> dict[str, Any]:
    mesh = KINDS[kind](n)
    row: dict[str, Any] = {"mesh": kind, "vertices": mesh.n_vertices}
    start = time.perf_counter()
    solver = HeatMethodSolver(mesh)
    row["solver"] = time.perf_counter() - start
    for name, ask in (
        ("distance", lambda: solver.distance(0)),
        ("unfolded", lambda: geodesic_distance(mesh, 0)),
        ("report", mesh.report),
    ):
        start = time.perf_counter()
        ask()
        row[name] = time.perf_counter() - start
    return row


def markdown(result: dict[str, Any]) -> str:
    steps = ("solver", "distance", "unfolded", "report")
    cells = [
        (row["mesh"], str(row["vertices"]), *(f"{1e6 * row[step] / row['vertices']:.2f}" for step in steps))
        for row in result["rows"]
    ]
    return "\n".join(["Microseconds per vertex.", "", *table(("mesh", "vertices", *steps), cells, (0,))])


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[10_000, 100_000, 1_000_000], help="vertices")
    add_output(parser, "scaling")
    arguments = parser.parse_args(argv)
    for make in KINDS.values():
        warm = make(3000)
        HeatMethodSolver(warm).distance(0)
        geodesic_distance(warm, 0)  # what is compiled or imported once
    rows = [measured(kind, n) for kind in KINDS for n in arguments.sizes]
    result = {"environment": environment(), "rows": rows}
    publish(result, markdown(result), folder=arguments.output, name="scaling")
    return 0


if __name__ == "__main__":
    sys.exit(main())
