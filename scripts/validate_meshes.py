"""Validate methods on many meshes: one JSON line per mesh as it is done, then a table and a figure.

    python scripts/validate_meshes.py FOLDER_OR_FILES... [--output DIRECTORY] [--sources 3] [--seed 0] ...

Started again with the same options, it goes on where it stopped. A mesh that cannot be read, or that the reference
cannot handle, is a row that says why. Exit status 1 if any mesh exceeds ``--fail-above``.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import heat_igl
from heat_igl import MeshError, SourceError
from heat_igl.errors import MissingExtraError, ReferenceSolverError
from heat_igl.validation import METHODS, draw_sources

from scaffold import add_seed, environment, environment_line, option_parser
from scaffold import table as markdown_table

# Percent; smaller errors are rounding.
_LEAST_SHOWN = 1e-4
SUFFIXES = {".off", ".obj", ".ply", ".stl", ".mesh", ".msh"}


def mesh_files(places: Iterable[Path]) -> list[Path]:
    """Files as given, folders by their mesh files; each once, by name."""
    found: dict[str, Path] = {}
    for place in places:
        inside = sorted(place.iterdir()) if place.is_dir() else [place]
        for path in inside:
            if path == place or path.suffix.lower() in SUFFIXES:
                found.setdefault(path.name, path)
    return list(found.values())


def records(path: Path) -> list[dict[str, Any]]:
    """The lines written so far; a last line that was cut off is dropped from the file."""
    if not path.exists():
        return []
    whole, _, rest = path.read_text().rpartition("\n")
    if rest:
        path.write_text(whole + "\n" if whole else "")
    return [json.loads(line) for line in whole.splitlines()]


def validated(path: Path, settings: dict[str, Any]) -> dict[str, Any]:
    """One record: a report, or the reason why there is none."""
    record: dict[str, Any] = {"file": path.name, "settings": settings}

    def show(method: str, done: int, total: int) -> None:
        if sys.stderr.isatty():
            print(f"\r{path.name}: {done}/{total} {method:20}", end="", file=sys.stderr, flush=True)

    try:
        mesh = heat_igl.read_mesh(path)
        record |= {"n_vertices": mesh.n_vertices, "n_faces": mesh.n_faces}
        sources = draw_sources(mesh, settings["sources"], settings["seed"])
        report = heat_igl.validate(
            mesh,
            sources,
            settings["methods"],
            settings["reference"],
            name=path.stem,
            timeout=settings["timeout"],
            progress=show,
        )
    except (MeshError, MissingExtraError, ReferenceSolverError, SourceError, OSError) as error:
        # Without the folder, which is nobody's business but this machine's.
        return record | {"failure": " ".join(str(error).replace(str(path), path.name).split())}
    return record | {"report": report.to_dict()}


def mean_error(record: dict[str, Any], method: str) -> float | None:
    """Mean relative error of a method, None where it has none."""
    for row in record.get("report", {}).get("rows", ()):
        if row["method"] == method and row["errors"] is not None:
            return float(row["errors"]["mean"])
    return None


def table(found: Sequence[dict[str, Any]], methods: Sequence[str], settings: dict[str, Any]) -> str:
    """Mean errors and times as Markdown, and every failure with its reason."""
    head = [
        f"Mean relative error in percent against {settings['reference']}, {settings['sources']} sources per mesh "
        f"drawn with seed {settings['seed']}; below it, seconds to prepare and milliseconds per solve.",
        "",
    ]
    errors, times, failures = [], [], []
    for record in found:
        start = Path(record["file"]).stem, str(record.get("n_vertices", "-"))
        if "failure" in record:
            failures.append(f"- {record['file']}: {record['failure']}")
        failed = record.get("report", {}).get("reference_failure")
        if failed:
            failures.append(f"- {record['file']}, reference {settings['reference']}: {failed}")
        rows = {row["method"]: row for row in record.get("report", {}).get("rows", ())}
        failures += [f"- {record['file']}, {m}: {row['failure']}" for m, row in rows.items() if row["failure"]]
        means = [mean_error(record, method) for method in methods]
        errors.append((*start, *("-" if mean is None else f"{100 * mean:.3g}" for mean in means)))
        times.append((*start, *(_times(rows.get(method)) for method in methods)))
    complete = [r for r in found if all(mean_error(r, m) is not None for m in methods)]
    if complete:
        middle = [_geometric_mean([mean_error(r, m) or 0.0 for r in complete]) for m in methods]
        errors.append((f"geometric mean of {len(complete)}", "", *(f"{100 * value:.3g}" for value in middle)))
    reasons = ["", "No number, because:", "", *failures] if failures else []
    columns = ("mesh", "vertices", *methods)
    lines = [*head, *markdown_table(columns, errors), "", *markdown_table(columns, times), *reasons]
    return "\n".join(lines) + "\n"


def _times(row: dict[str, Any] | None) -> str:
    if row is None or row["solve_seconds"] is None:
        return "-"
    return f"{row['precompute_seconds']:.2f} + {1e3 * row['solve_seconds']:.3g}"


def _geometric_mean(values: Sequence[float]) -> float:
    if min(values) <= 0:
        return 0.0
    return math.exp(sum(math.log(value) for value in values) / len(values))


def draw(found: Sequence[dict[str, Any]], methods: Sequence[str], path: Path) -> None:
    """Mean error of each method on each mesh as a dot, the methods one below the other; exact ones at the left edge."""
    from matplotlib.figure import Figure

    shown = [record for record in found if "report" in record]
    figure = Figure(figsize=(7, 0.45 * len(shown) + 1.5), layout="constrained")
    axes = figure.subplots()
    for k, method in enumerate(methods):
        below = 0.7 * ((k + 0.5) / len(methods) - 0.5)
        means = [(i, mean_error(record, method)) for i, record in enumerate(shown)]
        points = [(max(100 * m, _LEAST_SHOWN), i + below) for i, m in means if m is not None and m < math.inf]
        if points:
            axes.plot(*zip(*points, strict=True), "o", label=method, markersize=5)
    axes.set_yticks(range(len(shown)), [Path(record["file"]).stem for record in shown])
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="mean relative error, %")
    axes.grid(visible=True, axis="x", alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(path, dpi=150)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("places", nargs="+", type=Path, metavar="FOLDER_OR_FILE")
    parser.add_argument("--output", type=Path, default=Path("validation"), help="folder for results (%(default)s)")
    parser.add_argument("--sources", type=int, default=3, help="single sources per mesh (%(default)s)")
    add_seed(parser)
    parser.add_argument("--methods", default="heat,sweep,windows,meshlab,igl,potpourri3d", help="%(default)s")
    parser.add_argument("--reference", default="exact", help="%(default)s")
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds per native solve (%(default)s)")
    parser.add_argument("--fail-above", type=float, metavar="PERCENT", help="largest mean error of any method")
    options = parser.parse_args(argv)
    methods = options.methods.split(",")
    for method in (*methods, options.reference):
        if method not in METHODS:
            parser.error(f"{method!r} is unknown: choose from {', '.join(METHODS)}")
    for place in options.places:
        if not place.exists():
            parser.error(f"there is no {place}")
    files = mesh_files(options.places)
    if not files:
        parser.error("no mesh files there")
    settings = {
        "methods": methods,
        "reference": options.reference,
        "sources": options.sources,
        "seed": options.seed,
        "timeout": options.timeout,
    }
    around = environment()
    print(f"Environment: {environment_line(around)}")
    options.output.mkdir(parents=True, exist_ok=True)
    log = options.output / "cases.jsonl"
    done = {record["file"]: record for record in records(log) if record["settings"] == settings}
    for path in files:
        if path.name not in done:
            done[path.name] = validated(path, settings) | {"environment": around}
            with log.open("a") as stream:
                stream.write(json.dumps(done[path.name], allow_nan=False) + "\n")
            print(f"{path.name}: {done[path.name].get('failure', 'done')}", flush=True)
    found = [done[path.name] for path in files]
    (options.output / "table.md").write_text(table(found, methods, settings))
    draw(found, methods, options.output / "errors.png")
    if options.fail_above is None:
        return 0
    means = [mean_error(record, method) for record in found for method in methods]
    return int(any(mean is None or not 100 * mean <= options.fail_above for mean in means))


if __name__ == "__main__":
    sys.exit(main())
