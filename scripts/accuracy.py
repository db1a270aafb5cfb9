"""Error of every method over the zoo, generated shapes of which a third tuned no default, or on meshes of files.

    python scripts/accuracy.py --methods heat potpourri3d --output results     # the zoo, or parts: --shapes spike maze
    python scripts/accuracy.py FOLDER MESH --methods heat sweep meshlab        # meshes instead
    python scripts/accuracy.py --shapes none --members 10 --seed 1100           # random members of the zoo's kinds
    python scripts/accuracy.py MESH --variants                                 # the ways to run the heat method

Columns are the mean of |d - exact| / exact over the vertices, averaged over ``--sources`` seeded vertices, and in
brackets the largest |d - exact| and the largest exact - d as shares of the largest distance; all in percent. ``w``
counts answers with an accuracy warning. Shapes that are held out have a star. Then, for both kinds apart, geometric
means over the shapes, the worst, and ratios to potpourri3d. A mesh that exact distance refuses, and a method that
fails, are listed with the reason.

With ``--variants``, a row for each way, its geometric mean over the meshes, and that relative to potpourri3d's default,
in the mean and at worst: the defaults of `HeatMethodSolver` are chosen by this table (docs/engines_theory.md).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from heat_igl import Mesh, read_mesh, reference
from heat_igl.errors import MeshError, MissingExtraError, ReferenceSolverError
from heat_igl.heat.steps import HeatFlow, PoissonProblem, damping, normalize
from heat_igl.operators import operators
from heat_igl.typing import FloatArray
from heat_igl.validation.zoo import FAMILIES, SHAPES

from harness import Query, Row, Table, collected, drawn, errors, geometric_mean, ours, parsed, publish, warned

SUFFIXES = {".off", ".obj", ".ply", ".stl", ".mesh", ".msh"}
FAILURES = (MeshError, MissingExtraError, ReferenceSolverError, ImportError, RuntimeError, ValueError)
# Errors below this many percent count as this much in geometric means: rounding is no merit.
LEAST = 0.01
# An answer that is off by more percent in the mean has to be warned about, one that is off by less has not.
WRONG, RIGHT = 5, 2


def theirs(name: str) -> Callable[[Mesh], Query]:
    return lambda mesh: lambda source: reference.measured(name, mesh, source).distance


METHODS: dict[str, Callable[[Mesh], Query]] = {name: ours(name) for name in ("heat", "sweep", "windows")}
METHODS |= {name.removesuffix("_heat"): theirs(name) for name in ("meshlab", "igl_heat", "potpourri3d_heat")}
METHODS["meshlab_heat"] = theirs("meshlab_heat")


def field(
    fitted: bool = True, of_log: bool = True, full_rate: float | None = 0.95, t_coef: float = 0.5
) -> Callable[[Mesh], Query]:
    """Put together from the steps: the flow, what X follows, the rate from which it has length 1, and the time step."""

    def prepare(mesh: Mesh) -> Query:
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


VARIANTS: dict[str, Callable[[Mesh], Query]] = {
    "potpourri3d": METHODS["potpourri3d"],
    "default": ours("heat"),
    **{f"default, t_coef {t:g}": ours("heat", t_coef=t) for t in (0.25, 0.35, 0.5, 0.7, 1.0, 2.0)},
    "not refined, no cover": ours("heat", laplacian="intrinsic-delaunay"),
    "default, average boundary": ours("heat", boundary="average"),
    "default, dirichlet boundary": ours("heat", boundary="dirichlet"),
    "unit field": ours("heat", magnitude="unit"),
    "unit, t_coef 0.5": ours("heat", magnitude="unit", t_coef=0.5),
    "unit, t_coef 2": ours("heat", magnitude="unit", t_coef=2.0),
    "unit, average boundary": ours("heat", magnitude="unit", boundary="average"),
    "cotan, the paper's": ours("heat", laplacian="cotan"),
    "cotan, damped": ours("heat", laplacian="cotan", magnitude="damped"),
    "steps of the default": field(),
    "damped from 0.9": field(full_rate=0.9),
    "damped from 1": field(full_rate=1.0),
    "not damped": field(full_rate=None),
    "along u": field(of_log=False),
    "not fitted": field(fitted=False, full_rate=0.9),
    "t_coef 1": field(t_coef=1.0),
}


def seeded_sources(mesh: Mesh, count: int, seed: int) -> list[int]:
    """So many vertices, or all of fewer; of several components the first two get one each."""
    sources, usable = drawn(mesh, count, seed), np.unique(mesh.F)
    _, first = np.unique(mesh.components[usable], return_index=True)
    if len(first) > 1 < len(sources):
        sources[:2] = usable[first[:2]].tolist()
    return sources


def meshes(options: argparse.Namespace) -> Iterator[tuple[str, str, Callable[[], Mesh]]]:
    """Kind, name and maker of each mesh."""
    for place in options.meshes:
        for path in sorted(place.iterdir()) if place.is_dir() else [place]:
            if path == place or path.suffix.lower() in SUFFIXES:
                yield "meshes", path.stem, lambda path=path: read_mesh(path)
    for shape in SHAPES if not options.meshes else ():
        if any(part in shape.name for part in options.shapes):
            kind, star = ("held out", " *") if shape.held_out else ("not held out", "")
            yield kind, shape.name + star, shape.make
    for family, make in FAMILIES.items():
        for seed in range(options.seed, options.seed + options.members):
            yield "random members", f"{family} {seed}", lambda make=make, seed=seed: make(seed)


def measured(query: Query, sources: Sequence[int], truths: Sequence[FloatArray]) -> Row:
    """Mean and largest error, the largest excess below exact, and the number of warned answers."""
    found, n_warned, n_silent, n_in_vain = [], 0, 0, 0
    for source, truth in zip(sources, truths, strict=True):
        distance, is_warned = warned(lambda source=source: query(source))
        found.append(errors(np.asarray(distance, float), truth))
        n_warned += is_warned
        n_silent += not is_warned and found[-1]["mean"] > WRONG
        n_in_vain += is_warned and found[-1]["mean"] < RIGHT
    mean, largest, below = ([one[key] for one in found] for key in ("mean", "largest", "below"))
    row = {"mean": np.mean(mean), "largest": max(largest), "below": max(below)}
    return row | {"warned": f" {n_warned}w" if n_warned else "", "silent": n_silent, "in vain": n_in_vain}


def over_meshes(
    options: argparse.Namespace, methods: dict[str, Callable[[Mesh], Query]], reasons: list[str]
) -> Iterator[Row]:
    """A row for each mesh that has an exact distance; why others, or methods, have none goes to `reasons`."""
    for kind, name, make in meshes(options):
        try:
            mesh = make()
            sources = seeded_sources(mesh, options.sources, options.seed)
            truths = [reference.exact(mesh, source) for source in sources]
        except (*FAILURES, OSError) as error:
            reasons.append(f"- {name}: {error}")
            continue
        row: Row = {"mesh": name, "kind": kind, "vertices": mesh.n_vertices}
        for method, prepare in methods.items():
            try:
                row[method] = measured(prepare(mesh), sources, truths)
            except FAILURES as error:
                reasons.append(f"- {name}, {method}: {error}")
        yield row


def summary(rows: Sequence[Row], methods: Sequence[str]) -> Iterator[str]:
    """Geometric means, the worst shape, and the ratios to potpourri3d: geometric mean, and the largest."""
    for kind in dict.fromkeys(row["kind"] for row in rows):
        yield f"\nGeometric means, {kind}:\n"
        for method in methods:
            mean = {r["mesh"]: max(r[method]["mean"], LEAST) for r in rows if r["kind"] == kind and method in r}
            other = {r["mesh"]: max(r["potpourri3d"]["mean"], LEAST) for r in rows if "potpourri3d" in r}
            share = {mesh: mean[mesh] / other[mesh] for mesh in mean if mesh in other}
            if mean:
                worst = max(mean, key=lambda mesh: mean[mesh])
                line = f"- {method}: {geometric_mean(mean.values()):.3g} %, at worst {mean[worst]:.3g} % ({worst})"
                if share and method != "potpourri3d":
                    most = max(share, key=lambda mesh: share[mesh])
                    line += f"; {geometric_mean(share.values()):.3g} of potpourri3d, at most {share[most]:.3g} ({most})"
                own = [row[method] for row in rows if row["kind"] == kind and method in row]
                silent, in_vain = (sum(each[key] for each in own) for key in ("silent", "in vain"))
                yield f"{line}; above {WRONG} % without a warning {silent}, below {RIGHT} % with one {in_vain}"


def of_variants(rows: Sequence[Row]) -> list[Row]:
    """A row for each variant, a column for each mesh."""
    turned = []
    for variant in VARIANTS:
        error = {row["mesh"]: row[variant]["mean"] for row in rows if variant in row}
        both = [row for row in rows if {variant, "potpourri3d"} <= {*row}]
        share = [row[variant]["mean"] / row["potpourri3d"]["mean"] for row in both]
        means = {"mean": geometric_mean(error.values()), "share": geometric_mean(share), "worst": max(share)}
        turned.append({"variant": variant, "errors": error} | means)
    return turned


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", shapes=[""], members=0, methods=list(METHODS), sources=3, variants=False)
    reasons: list[str] = []
    methods = VARIANTS if options.variants else {name: METHODS[name] for name in options.methods}
    rows = collected(over_meshes(options, methods, reasons))
    if options.variants:
        columns = {"%": "{variant}"} | {row["mesh"]: f"{{errors[{row['mesh']}]:.2f}}" for row in rows}
        columns |= {"geometric mean": "{mean:.3f}", "of potpourri3d": "{share:.3f}", "at worst": "{worst:.3f}"}
        tables: dict[str, Table | str] = {"variants": Table(of_variants(rows), columns)}
    else:
        form = "{{{0}[mean]:.3g}} ({{{0}[largest]:.2g}}, {{{0}[below]:.2g}}){{{0}[warned]}}"
        columns = {"mesh": "{mesh}", "vertices": "{vertices}"} | {name: form.format(name) for name in methods}
        tables = {"errors": Table(rows, columns), "summary": "\n".join(summary(rows, list(methods)))}
    publish(options, tables | ({"reasons": "\n".join(reasons)} if reasons else {}))


if __name__ == "__main__":
    main()
