"""The ways to run the heat method beside one another: field, time step, boundary, triangulation.

    python scripts/heat_variants.py MESH [MESH ...] [--sources 3] [--seed 0] [--json FILE]

Prints a Markdown table of the mean of |d - exact| / exact over vertices and sources, in percent, its geometric mean
over the meshes, and that relative to potpourri3d's default, in the mean and at worst. The defaults of
`HeatMethodSolver` are chosen by this table; docs/heat_path.md shows it. Needs the extras ``validate`` and ``bench``.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from heat_igl import HeatMethodSolver, Mesh, read_mesh, reference
from heat_igl.steps import PoissonProblem, damping, normalize
from heat_igl.typing import FloatArray
from heat_igl.validation import draw_sources

from environment import environment

Distance = Callable[[int], FloatArray]


def options(**kept: object) -> Callable[[Mesh], Distance]:
    return lambda mesh: HeatMethodSolver(mesh, **kept).distance


def field(of_log_u: bool = False, full_rate: float | None = None) -> Callable[[Mesh], Distance]:
    """X put together from the steps: along the gradient of u or of log u, damped with a given constant or not."""

    def prepare(mesh: Mesh) -> Distance:
        solver = HeatMethodSolver(mesh)
        domain = solver.operators
        poisson = PoissonProblem(domain)

        def distance(source: int) -> FloatArray:
            u = solver.solve(source).heat
            X = normalize(domain, u).reshape(domain.dimension, -1)
            if of_log_u:
                with np.errstate(divide="ignore", invalid="ignore"):
                    gradient = (domain.G @ np.log(u)).reshape(domain.dimension, -1)
                    along_log = -gradient / np.linalg.norm(gradient, axis=0)
                X = np.where(np.isfinite(along_log).all(axis=0), along_log, X)
            if full_rate is not None:
                X = X * damping(domain, u, solver.t, full_rate)
            phi = poisson.solve(domain.D @ X.ravel())
            return np.maximum(phi - phi[source], 0)

        return distance

    return prepare


def potpourri3d(mesh: Mesh) -> Distance:
    return lambda source: reference.potpourri3d_heat(mesh, source)


VARIANTS: dict[str, Callable[[Mesh], Distance]] = {
    "potpourri3d": potpourri3d,
    "default": options(),
    "unit field": options(magnitude="unit"),
    "unit, average boundary": options(magnitude="unit", boundary="average"),
    "default, average boundary": options(boundary="average"),
    "default, dirichlet boundary": options(boundary="dirichlet"),
    "default, t_coef 0.5": options(t_coef=0.5),
    "default, t_coef 2": options(t_coef=2),
    "unit, t_coef 0.5": options(magnitude="unit", t_coef=0.5),
    "unit, t_coef 2": options(magnitude="unit", t_coef=2),
    "cotan, the paper's": options(laplacian="cotan"),
    "cotan, damped": options(laplacian="cotan", magnitude="damped"),
    "damped from 0.8": field(full_rate=0.8),
    "damped from 0.85": field(full_rate=0.85),
    "damped from 0.95": field(full_rate=0.95),
    "damped from 1": field(full_rate=1.0),
    "gradient of log u": field(of_log_u=True),
    "gradient of log u, damped": field(of_log_u=True, full_rate=0.9),
}


def mean_errors(mesh: Mesh, n_sources: int, seed: int) -> dict[str, float]:
    sources = [source for (source,) in draw_sources(mesh, n_sources, seed)]
    exact = [reference.exact(mesh, source) for source in sources]
    found = {}
    for name, prepare in VARIANTS.items():
        distance = prepare(mesh)
        errors = []
        for source, truth in zip(sources, exact, strict=True):
            far = np.isfinite(truth) & (truth > 0)
            errors.append(100 * float((np.abs(distance(source) - truth)[far] / truth[far]).mean()))
        found[name] = float(np.mean(errors))
    return found


def markdown(rows: dict[str, dict[str, float]]) -> str:
    names = list(rows)
    lines = [
        f"| % | {' | '.join(names)} | geometric mean | of potpourri3d | at worst |",
        "|---" * (len(names) + 4) + "|",
    ]
    peer = np.array([rows[name]["potpourri3d"] for name in names])
    for variant in VARIANTS:
        errors = np.array([rows[name][variant] for name in names])
        ratio = errors / peer
        cells = [f"{error:.2f}" for error in errors]
        cells += [f"{np.exp(np.log(errors).mean()):.3f}", f"{np.exp(np.log(ratio).mean()):.3f}", f"{ratio.max():.3f}"]
        lines.append(f"| {variant} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--sources", type=int, default=3, help="per mesh (default 3)")
    parser.add_argument("--seed", type=int, default=0, help="of the generator that draws them (default 0)")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args(argv)
    rows = {}
    for path in arguments.meshes:
        rows[path.stem] = mean_errors(read_mesh(path), arguments.sources, arguments.seed)
        print(f"{path.stem}: {rows[path.stem]['default']:.2f} %", file=sys.stderr, flush=True)
    print(markdown(rows))
    if arguments.json is not None:
        text = json.dumps({"environment": environment(), "mean error in %": rows}, indent=1)
        arguments.json.write_text(text + "\n", encoding="utf8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
