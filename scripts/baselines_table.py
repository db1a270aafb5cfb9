"""Mean error of the paper's other ways (`heat_igl.baselines`) beside the heat method.

    python scripts/baselines_table.py                       # generated shapes, grids, cow and bunny: about a minute
    python scripts/baselines_table.py --quick               # generated shapes and grids alone, coarse
    python scripts/baselines_table.py --output DIRECTORY    # where baselines.json and baselines.md go

Truth is a closed form on generated shapes, and pygeodesic's exact distance on the cow and the bunny of the pymeshlab
wheel (extra ``validate``; left out where it is missing). Fast marching needs the extra ``bench``.
"""

from __future__ import annotations

import importlib.util
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

import heat_igl
from heat_igl import Mesh, MissingExtraError, baselines, closed_forms, reference, shapes
from heat_igl.operators import Operators, operators

from measuring import mean_error
from scaffold import add_output, add_seed, environment, option_parser, publish, table, wheel_mesh

Truth = Callable[[Mesh, int], np.ndarray]

METHODS: dict[str, Callable[[Mesh, Operators, int], np.ndarray]] = {
    "heat method": lambda _, domain, s: heat_igl.HeatMethodSolver.from_operators(domain).distance(s),
    "Varadhan, backward Euler": lambda _, domain, s: baselines.varadhan(domain, s),
    "the same with the paper's 1/2": lambda _, domain, s: baselines.varadhan(domain, s) / 2,
    "BP": lambda _, domain, s: baselines.boundary_problem(domain, s),
    "Varadhan, heat kernel": lambda _, domain, s: baselines.varadhan(domain, s, form="heat-kernel"),
    "Schrodinger": lambda _, domain, s: baselines.schrodinger(domain, s),
    "fast marching": lambda mesh, _, s: baselines.fast_marching(mesh, s),
    "edges": lambda mesh, _, s: baselines.graph_distance(mesh, s),
}
GRID_METHODS: dict[str, Callable[[np.ndarray, float], np.ndarray]] = {
    "Schrodinger, convolution": baselines.schrodinger_grid,
    "fast marching, order 1": lambda mask, h: baselines.fast_marching_grid(mask, h, order=1),
    "fast marching, order 2": baselines.fast_marching_grid,
    "fast sweeping": baselines.fast_sweeping,
}


def meshes(quick: bool) -> Iterator[tuple[str, Mesh, Truth]]:
    """Name, mesh and truth of each test case."""
    k = 1 if quick else 2
    yield "square", shapes.grid(24 * k), closed_forms.plane
    yield "disk", shapes.disk(16 * k), closed_forms.plane
    yield "sphere", shapes.icosphere(2 + k), closed_forms.sphere
    yield "cylinder", shapes.cylinder(40 * k, 40 * k), closed_forms.cylinder
    if quick:
        return
    for name in ("cow", "bunny"):
        path = wheel_mesh(f"{name}.obj")
        if path is None or importlib.util.find_spec("pygeodesic") is None:
            print(f'{name} is left out: pip install "heat-igl[validate]"', file=sys.stderr)
        else:
            yield name, heat_igl.read_mesh(path), reference.exact


def mesh_rows(cases: Iterator[tuple[str, Mesh, Truth]], n_sources: int, seed: int) -> list[dict[str, Any]]:
    rows = []
    for name, mesh, truth in cases:
        domain = operators(mesh)
        sources = np.random.default_rng(seed).choice(np.flatnonzero(mesh.referenced), n_sources, replace=False)
        exact = [truth(mesh, int(source)) for source in sources]
        for method, distance_from in METHODS.items():
            start = time.perf_counter()
            try:
                errors = [
                    mean_error(distance_from(mesh, domain, int(s)), e) for s, e in zip(sources, exact, strict=True)
                ]
            except MissingExtraError as error:
                print(error, file=sys.stderr)
                continue
            seconds = (time.perf_counter() - start) / n_sources
            rows.append({"case": name, "n": mesh.n_vertices, "method": method, "error": errors, "seconds": seconds})
    return rows


def grid_rows(sizes: Sequence[int], n_sources: int, seed: int) -> list[dict[str, Any]]:
    """Distance from several points of a square at once."""
    rows = []
    for size in sizes:
        sources = np.random.default_rng(seed).integers(0, size + 1, (n_sources, 2))
        mask = np.zeros((size + 1, size + 1), bool)
        mask[tuple(sources.T)] = True
        place = np.indices(mask.shape) / size
        exact = np.min([np.hypot(*(place - s[:, None, None] / size)) for s in sources], axis=0)
        for method, distance_from in GRID_METHODS.items():
            start = time.perf_counter()
            try:
                error = mean_error(distance_from(mask, 1 / size), exact)
            except MissingExtraError as missing:
                print(missing, file=sys.stderr)
                continue
            seconds = time.perf_counter() - start
            rows.append(
                {"case": f"{size + 1}^2", "n": mask.size, "method": method, "error": [error], "seconds": seconds}
            )
    return rows


def limit_rows(subdivisions: int) -> list[dict[str, Any]]:
    """Theorem 3.1 on a sphere: how far log u / log t is from the number of edges."""
    mesh = shapes.icosphere(subdivisions)
    A = operators(mesh).L
    n = baselines.graph_distance(mesh, 0, count_edges=True)
    off = n > 0
    rows = []
    for decades in (3, 30, 300, 3000, 30000):
        limit = baselines.graph_limit(A, 0, -decades * np.log(10))
        rows.append({"t": f"1e-{decades}", "largest": float((np.abs(limit - n)[off] / n[off]).max())})
    return rows


def methods_by_case(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Methods down, cases across: mean error in percent, and seconds per set of sources."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    lines = []
    for method in dict.fromkeys(row["method"] for row in rows):
        found = {row["case"]: row for row in rows if row["method"] == method}
        cells = [f"{100 * np.mean(found[case]['error']):.3g} ({found[case]['seconds']:.2g} s)" for case in cases]
        lines.append((method, *cells))
    return table(["method", *cases], lines)


def markdown(result: dict[str, Any]) -> str:
    lines = [
        f"Mean relative error in percent, and seconds per solve from scratch; {result['sources']} sources per case, "
        f"seed {result['seed']}.",
        "",
        "On meshes, one source at a time:",
        "",
        *methods_by_case(result["meshes"]),
        "",
        "On grids, from all sources at once:",
        "",
        *methods_by_case(result["grids"]),
        "",
        "Theorem 3.1: largest relative difference of log u_t / log t from the number of edges, on a sphere.",
        "",
        *table(["t", "difference"], [(row["t"], f"{100 * row['largest']:.3g} %") for row in result["theorem 3.1"]]),
    ]
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--sources", type=int, default=3, help="sources per case (default 3)")
    add_seed(parser)
    parser.add_argument("--quick", action="store_true", help="coarse generated shapes alone")
    add_output(parser, "baselines")
    arguments = parser.parse_args(argv)
    result = {
        "sources": arguments.sources,
        "seed": arguments.seed,
        "environment": environment(),
        "meshes": mesh_rows(meshes(arguments.quick), arguments.sources, arguments.seed),
        "grids": grid_rows((32, 64) if arguments.quick else (64, 128, 256), arguments.sources, arguments.seed),
        "theorem 3.1": limit_rows(2 if arguments.quick else 3),
    }
    publish(result, markdown(result), folder=arguments.output, name="baselines")
    return 0


if __name__ == "__main__":
    sys.exit(main())
