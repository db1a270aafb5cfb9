"""The ways to run the heat method beside one another: field, time step, boundary, triangulation.

    python scripts/heat_variants.py MESH [MESH ...] [--sources 3] [--seed 0] [--json FILE]

Prints a Markdown table of the mean of |d - exact| / exact over vertices and sources, in percent, its geometric mean
over the meshes, and that relative to potpourri3d's default, in the mean and at worst. The defaults of
`HeatMethodSolver` are chosen by this table; docs/engines.md shows it. Needs the extras ``validate`` and ``bench``. A
mesh of 5000 vertices takes about a second.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from heat_igl import HeatMethodSolver, Mesh, reference
from heat_igl.operators import operators
from heat_igl.steps import HeatFlow, PoissonProblem, damping, normalize
from heat_igl.typing import FloatArray
from heat_igl.validation import draw_sources

from measuring import mean_error
from scaffold import add_json, add_seed, environment, option_parser, over_meshes, publish, table

Distance = Callable[[int], FloatArray]


def options(**kept: object) -> Callable[[Mesh], Distance]:
    return lambda mesh: HeatMethodSolver(mesh, **kept).distance


def field(
    fitted: bool = True, of_log: bool = True, full_rate: float | None = 0.95, t_coef: float = 0.5
) -> Callable[[Mesh], Distance]:
    """Put together from the steps: the flow, what X follows, the rate from which it has length 1, and the time step."""

    def prepare(mesh: Mesh) -> Distance:
        domain = operators(mesh)
        t = t_coef * domain.mean_edge_length**2
        flow, poisson = HeatFlow(domain, t, fitted=fitted), PoissonProblem(domain)

        def distance(source: int) -> FloatArray:
            initial = np.zeros(domain.n)
            initial[source] = 1e280
            u = flow.solve(initial)
            X = normalize(domain, u, of_log)
            if full_rate is not None:
                X *= np.tile(damping(domain, u, t, full_rate, fitted), domain.dimension)
            phi = poisson.solve(domain.D @ X)
            return np.maximum(phi - phi[source], 0)

        return distance

    return prepare


def potpourri3d(mesh: Mesh) -> Distance:
    return lambda source: reference.potpourri3d_heat(mesh, source)


VARIANTS: dict[str, Callable[[Mesh], Distance]] = {
    "potpourri3d": potpourri3d,
    "default": options(),
    "default, t_coef 0.25": options(t_coef=0.25),
    "default, t_coef 0.35": options(t_coef=0.35),
    "default, t_coef 0.7": options(t_coef=0.7),
    "default, t_coef 1": options(t_coef=1),
    "default, t_coef 2": options(t_coef=2),
    "default, average boundary": options(boundary="average"),
    "default, dirichlet boundary": options(boundary="dirichlet"),
    "unit field": options(magnitude="unit"),
    "unit, t_coef 0.5": options(magnitude="unit", t_coef=0.5),
    "unit, t_coef 2": options(magnitude="unit", t_coef=2),
    "unit, average boundary": options(magnitude="unit", boundary="average"),
    "cotan, the paper's": options(laplacian="cotan"),
    "cotan, damped": options(laplacian="cotan", magnitude="damped"),
    "steps of the default": field(),
    "damped from 0.9": field(full_rate=0.9),
    "damped from 1": field(full_rate=1.0),
    "not damped": field(full_rate=None),
    "along u": field(of_log=False),
    "not fitted": field(fitted=False, full_rate=0.9),
    "not fitted, along u": field(fitted=False, of_log=False, full_rate=0.9),
    "t_coef 1": field(t_coef=1.0),
    "t_coef 1, along u": field(of_log=False, t_coef=1.0),
    "t_coef 1, not fitted": field(fitted=False, full_rate=0.9, t_coef=1.0),
    "t_coef 1, not fitted, along u": field(fitted=False, of_log=False, full_rate=0.9, t_coef=1.0),
}


def mean_errors(mesh: Mesh, n_sources: int, seed: int) -> dict[str, float]:
    sources = [source for (source,) in draw_sources(mesh, n_sources, seed)]
    exact = [reference.exact(mesh, source) for source in sources]
    found = {}
    for name, prepare in VARIANTS.items():
        distance = prepare(mesh)
        errors = [mean_error(distance(source), truth) for source, truth in zip(sources, exact, strict=True)]
        found[name] = 100 * float(np.mean(errors))
    return found


def markdown(rows: dict[str, dict[str, float]]) -> str:
    names = list(rows)
    lines = []
    peer = np.array([rows[name]["potpourri3d"] for name in names])
    for variant in VARIANTS:
        errors = np.array([rows[name][variant] for name in names])
        ratio = errors / peer
        cells = [f"{error:.2f}" for error in errors]
        cells += [f"{np.exp(np.log(errors).mean()):.3f}", f"{np.exp(np.log(ratio).mean()):.3f}", f"{ratio.max():.3f}"]
        lines.append((variant, *cells))
    return "\n".join(table(["%", *names, "geometric mean", "of potpourri3d", "at worst"], lines))


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--sources", type=int, default=3, help="per mesh (default 3)")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    rows = over_meshes(
        arguments.meshes,
        lambda mesh: mean_errors(mesh, arguments.sources, arguments.seed),
        lambda row: f"{row['default']:.2f} %",
    )
    publish({"environment": environment(), "mean error in %": rows}, markdown(rows), json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
