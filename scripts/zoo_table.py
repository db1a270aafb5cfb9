"""Error of every method over the zoo: generated shapes, a third of which no default was tuned on.

    python scripts/zoo_table.py --methods heat potpourri3d --output results

Prints a Markdown table with the mean of |d - exact| / exact over the vertices, averaged over three seeded sources, and
in brackets the largest |d - exact| and the largest exact - d in percent of the largest distance; all in percent. ``w``
counts the answers with an accuracy warning. Shapes that are held out are marked with a star. Below the table are
geometric means over the shapes, and their ratios to potpourri3d, of both kinds apart. Exact distances are those of
`heat_igl.reference.exact`; shapes that it refuses, since surfaces meet in edges of three faces or in single points, are
left out. ``--exact-cache DIR`` keeps exact distances for the next run.
"""

from __future__ import annotations

import hashlib
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl.errors import AccuracyWarning, MeshError, ReferenceSolverError
from heat_igl.geodesic import DistanceMethod, SolverChoice
from heat_igl.typing import FloatArray, IntArray
from heat_igl.validation.zoo import SHAPES, Shape

from measuring import Query, errors, potpourri3d
from scaffold import add_json, add_output, environment, option_parser, publish, table

Row = dict[str, Any]
# Errors below this many percent count as this much in geometric means: rounding is no merit.
LEAST = 0.01
SEED, N_SOURCES = 7, 3


def ours(method: DistanceMethod) -> Callable[[heat_igl.Mesh], Query]:
    return lambda mesh: SolverChoice(method).on(mesh).distance


def libigl(mesh: heat_igl.Mesh) -> Query:
    return lambda source: heat_igl.reference.igl_heat(mesh, source)


METHODS: dict[str, Callable[[heat_igl.Mesh], Query]] = {
    "heat": ours("heat"),
    "sweep": ours("sweep"),
    "windows": ours("windows"),
    "potpourri3d": potpourri3d,
    "igl": libigl,
}


def seeded_sources(mesh: heat_igl.Mesh) -> IntArray:
    """Three vertices, or all of fewer; of several components the first two get one each."""
    sources = np.random.default_rng(SEED).choice(mesh.n_vertices, min(N_SOURCES, mesh.n_vertices), replace=False)
    _, first = np.unique(mesh.components, return_index=True)
    if len(first) > 1:
        sources[:2] = first[:2]
    return np.asarray(sources, np.int64)


def exact(mesh: heat_igl.Mesh, source: int, cache: Path | None) -> FloatArray:
    """Exact distance, kept in the folder `cache`."""
    key = hashlib.sha256(mesh.V.tobytes() + mesh.F.tobytes() + b"zoo" + str(source).encode()).hexdigest()[:24]
    kept = cache / f"{key}.npy" if cache else None
    if kept and kept.exists():
        return np.asarray(np.load(kept))
    distance = heat_igl.reference.exact(mesh, source)
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        np.save(kept, distance)
    return distance


def measure(shape: Shape, methods: list[str], cache: Path | None) -> list[Row]:
    """One row for each method that takes the shape; none if there is no exact distance."""
    mesh = shape.make()
    sources = seeded_sources(mesh)
    try:
        truths = [exact(mesh, int(source), cache) for source in sources]
    except (ReferenceSolverError, MeshError) as error:
        print(f"{shape.name} left out: {error}", file=sys.stderr)
        return []
    rows = []
    for method in methods:
        try:
            row = errors_of(METHODS[method], mesh, sources, truths)
        except (ImportError, RuntimeError, ValueError) as error:
            print(f"{method} on {shape.name} left out: {error}", file=sys.stderr)
            continue
        rows.append(
            {"shape": shape.name, "held_out": shape.held_out, "vertices": mesh.n_vertices, "method": method} | row
        )
    return rows


def errors_of(
    make: Callable[[heat_igl.Mesh], Query], mesh: heat_igl.Mesh, sources: IntArray, truths: list[FloatArray]
) -> Row:
    """Mean and largest error, the largest excess below exact, in percent, and the number of warned answers."""
    found, n_warned = [], 0
    query = make(mesh)
    for source, truth in zip(sources, truths, strict=True):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            distance = np.asarray(query(int(source)), np.float64)
        n_warned += any(issubclass(warning.category, AccuracyWarning) for warning in caught)
        reached = np.isfinite(truth) & (truth > 0)
        # A component of a single vertex has no error.
        if reached.any():
            below = 100 * float((truth[reached] - distance[reached]).max() / truth[reached].max())
            found.append((*errors(distance, truth), below))
    columns = np.array(found)
    return {
        "mean": float(columns[:, 0].mean()),
        "largest": float(columns[:, 2].max()),
        "below": max(float(columns[:, 3].max()), 0.0),
        "warned": n_warned,
    }


def markdown(rows: list[Row]) -> str:
    methods = list(dict.fromkeys(row["method"] for row in rows))
    by_shape: dict[str, dict[str, Row]] = {}
    for row in rows:
        by_shape.setdefault(row["shape"], {})[row["method"]] = row
    cells = []
    for shape, of_method in by_shape.items():
        first = next(iter(of_method.values()))
        name = f"{shape} *" if first["held_out"] else shape
        cells.append((name, f"{first['vertices']}", *(cell(of_method.get(method)) for method in methods)))
    parts = table(["shape", "vertices", *methods], cells)
    for held_out in (False, True):
        kind = "held out" if held_out else "not held out"
        parts += ["", f"Shapes {kind}:", "", *summary([row for row in rows if row["held_out"] == held_out], methods)]
    return "\n".join(parts)


def cell(row: Row | None) -> str:
    if row is None:
        return "-"
    warned = f" {row['warned']}w" if row["warned"] else ""
    return f"{row['mean']:.3g} ({row['largest']:.2g}, {row['below']:.2g}){warned}"


def summary(rows: list[Row], methods: list[str]) -> list[str]:
    """Geometric means, the worst shape, and the ratios to potpourri3d: geometric mean, and the largest."""
    lines = []
    means = {
        method: {row["shape"]: max(row["mean"], LEAST) for row in rows if row["method"] == method} for method in methods
    }
    other = means.get("potpourri3d", {})
    for method, of_shape in means.items():
        if not of_shape:
            continue
        worst = max(of_shape, key=lambda shape: of_shape[shape])
        mean = geometric(of_shape.values())
        line = f"- {method}: geometric mean {mean:.3g} %, at worst {of_shape[worst]:.3g} % ({worst})"
        ratio = {shape: of_shape[shape] / other[shape] for shape in of_shape if shape in other}
        if ratio and method != "potpourri3d":
            most = max(ratio, key=lambda shape: ratio[shape])
            line += f"; {geometric(ratio.values()):.3g} of potpourri3d, at most {ratio[most]:.3g} ({most})"
        lines.append(line)
    return lines


def geometric(values: Any) -> float:
    return float(np.exp(np.mean(np.log(list(values)))))


def main(argv: list[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--shapes", nargs="+", help="names, or parts of names; all if not given")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=list(METHODS))
    parser.add_argument("--exact-cache", type=Path, help="directory that keeps exact distances")
    add_json(parser)
    add_output(parser, "zoo_table")
    options = parser.parse_args(argv)
    rows: list[Row] = []
    for shape in SHAPES:
        if options.shapes is None or any(part in shape.name for part in options.shapes):
            rows += measure(shape, options.methods, options.exact_cache)
            print(f"{shape.name} done", file=sys.stderr, flush=True)
    result = {"environment": environment(), "seed": SEED, "rows": rows}
    publish(result, markdown(rows), folder=options.output, name="zoo_table", json_file=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
