"""Break every engine on purpose, and see whether an answer that contradicts itself leaves the package.

    python scripts/broken_engines.py --members 3

A test double takes the place of an engine's last step and makes its answer wrong: one vertex without a distance, one
too far, one too near, all too short or too long, a source that is not 0. Over random members of the kinds of
`heat_igl.validation.zoo.FAMILIES`, the table counts what became of the answers: warned about, kept without a word since
bounds left the mean error within what the engine promises (`PROMISED`), or let through. ``contradictions`` counts those
of all answers that violate edges or straight lines when they leave.
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

import heat_igl
from heat_igl.errors import AccuracyWarning
from heat_igl.kernels.sweep import sweeping
from heat_igl.sources import source_set
from heat_igl.steps import PoissonProblem
from heat_igl.typing import FloatArray
from heat_igl.validation.zoo import FAMILIES
from heat_igl.windows import Invariants, WindowEngine

from harness import Table, parsed, publish

Break = Callable[[FloatArray, int], None]


def far_vertex(distance: FloatArray) -> int:
    return int(np.argmax(np.where(np.isfinite(distance), distance, -1)))


BREAKS: dict[str, Break] = {
    "no distance": lambda d, _: d.__setitem__(far_vertex(d), np.inf),
    "too far": lambda d, _: d.__setitem__(far_vertex(d), 1.5 * d[far_vertex(d)]),
    "too near": lambda d, _: d.__setitem__(far_vertex(d), 0.1 * d[far_vertex(d)]),
    "all short": lambda d, _: d.__imul__(0.5),
    "all long": lambda d, _: d.__imul__(1.5),
    "source": lambda d, source: d.__setitem__(source, 0.2 * d[far_vertex(d)]),
}


#: Mean relative error that an engine promises, or else a warning.
PROMISED = {"windows": 1e-5, "sweep": 0.02, "heat": 0.05}


@contextmanager
def broken(engine: str, wrong: Break, source: int) -> Iterator[None]:
    """The engine with a last step that makes its answer wrong."""
    owner: Any
    if engine == "windows":
        owner, name, old = WindowEngine, "distance", WindowEngine.distance

        def step(self: WindowEngine, *arguments: Any) -> FloatArray:
            distance = old(self, *arguments)
            wrong(distance, source)
            return distance
    elif engine == "sweep":
        owner, name, old = sweeping, "sweep", sweeping.sweep

        def step(spokes: Any, distance: FloatArray, *arguments: Any) -> Any:
            visits = old(spokes, distance, *arguments)
            wrong(distance, int(np.argmin(distance)))
            return visits
    else:
        owner, name, old = PoissonProblem, "solve", PoissonProblem.solve

        def step(self: PoissonProblem, b: FloatArray) -> FloatArray:
            phi = old(self, b)
            for column in phi.T:
                column -= column[source]
                wrong(column, source)
            return phi

    setattr(owner, name, step)
    try:
        yield
    finally:
        setattr(owner, name, old)


def fate(engine: str, mesh: heat_igl.Mesh, source: int, wrong: Break) -> tuple[str, bool]:
    """What became of a broken answer, and whether the one that left contradicts edges or lines."""
    truth = heat_igl.GeodesicSolver(mesh, method="exact").distance(source)
    with broken(engine, wrong, source), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        distance = heat_igl.geodesic_distance(mesh, source, method=engine)  # type: ignore[arg-type]
    there = np.isfinite(truth)
    far = there & (truth > 0)
    off = float(np.mean(np.abs(distance[far] - truth[far]) / truth[far]))
    # Heat may be steeper than an edge by 4 % of it.
    longest = np.linalg.norm(mesh.V[mesh.edges[:, 0]] - mesh.V[mesh.edges[:, 1]], axis=1).max()
    tolerance = 0.04 * longest / truth[there].max() if engine == "heat" else 1e-5
    sources = source_set(source, mesh.n_vertices, mesh.F)
    invariants = Invariants(mesh.F, mesh.components, mesh.V)
    contradicts = invariants.contradiction(distance, sources, tolerance=tolerance) is not None
    if any(issubclass(each.category, AccuracyWarning) for each in caught):
        return "warned", contradicts
    return "kept" if off <= PROMISED[engine] else "let through", contradicts


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, members=3)
    found: dict[tuple[str, str], Counter[str]] = {}
    for make in FAMILIES.values():
        for seed in range(options.members):
            mesh = make(seed)
            for engine in ("windows", "sweep", "heat"):
                for name, wrong in BREAKS.items():
                    became, contradicts = fate(engine, mesh, 7, wrong)
                    found.setdefault((engine, name), Counter()).update([became, *["contradictions"] * contradicts])
    heads = ("engine", "break", "warned", "kept", "let through", "contradictions")
    rows = [
        {"engine": engine, "break": name} | {h: counts[h] for h in heads[2:]}
        for (engine, name), counts in found.items()
    ]
    publish(options, {"broken": Table(rows, {head: head for head in heads})})


if __name__ == "__main__":
    sys.exit(main())
