"""The harness of the scripts: options, meshes, methods, errors, paired times, and tables as data.

A script measures rows, which are dictionaries. A `Table` gives them columns: a head, and the format of a row below it.
`publish` prints the environment and all tables as Markdown, and writes them where the options say that all scripts
have: ``--output DIRECTORY`` gets NAME.md and NAME.json, and ``--docs PAGE`` the parts of a page between
``<!-- name -->`` and ``<!-- /name -->``, with the revision that they were made at. ``--seed`` is that of the random
generators.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import igl
import numpy as np

import heat_igl
from heat_igl import Mesh, read_mesh, write_mesh
from heat_igl.geodesic import SolverChoice
from heat_igl.typing import FloatArray
from heat_igl.validation import metrics

Row = dict[str, Any]
Query = Callable[[int], FloatArray]
PACKAGES = (
    "numpy scipy libigl pyamg potpourri3d pygeodesic tvb-gdist pymeshlab meshio matplotlib scikit-fmm distributed zarr"
).split()
ROOT = Path(__file__).resolve().parent.parent


# Options.


def parsed(
    doc: str | None, argv: Sequence[str] | None, meshes: str = "", tables: Iterable[str] = (), **defaults: Any
) -> argparse.Namespace:
    """The options of a script, whose docstring `doc` describes them; `argv` stands in for the command line.

    `meshes` says how many files it takes ("", "*" or "+"). One of the `tables` is named first on the command line.
    Other options come by name with a default that says the type: a list for several values, a type for None, False for
    a switch.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if tables:
        parser.add_argument("table", choices=tuple(tables))
    if meshes:
        parser.add_argument("meshes", nargs=meshes, type=Path)
    for name, default in ({"seed": 0, "output": Path, "docs": Path} | defaults).items():
        flag = f"--{name.replace('_', '-')}"
        if default is False:
            parser.add_argument(flag, action="store_true")
        elif isinstance(default, list):
            parser.add_argument(flag, nargs="+", type=type(default[0]), default=default)
        elif isinstance(default, type):
            parser.add_argument(flag, type=default)
        else:
            parser.add_argument(flag, type=Path if isinstance(default, Path) else type(default), default=default)
    return parser.parse_args(argv)


# Tables.


@dataclass(frozen=True)
class Table:
    """Rows, columns, and a sentence above them.

    A column has a head and the format of a row, as ``"{mean:.2f} and {largest:.2f}"``, or the name of a value that is
    shown as it is. A cell of which a value is missing or None is "-".
    """

    rows: Sequence[Row]
    columns: Mapping[str, str]
    text: str = ""

    def markdown(self) -> str:
        """The sentence and the table; columns of words are flushed left, those without a value are left out."""
        columns = {
            head: form
            for head, form in self.columns.items()
            if not self.rows or any(_cell(form, row) != "-" for row in self.rows)
        }
        cells = [[_cell(form, row) for form in columns.values()] for row in self.rows]
        words = [any(re.match("[a-zA-Z`]", cell) for cell in column) for column in zip(*cells, strict=True)]
        rule = ["---" if k == 0 or is_word else "---:" for k, is_word in enumerate(words or columns)]
        lines = [f"| {' | '.join(columns)} |", f"|{'|'.join(rule)}|", *(f"| {' | '.join(row)} |" for row in cells)]
        return "\n".join([self.text, ""] * bool(self.text) + lines)


def _cell(form: str, row: Row) -> str:
    if "{" not in form:
        return str(row.get(form, "-"))
    try:
        return form.format_map({name: value for name, value in row.items() if value is not None})
    except (KeyError, TypeError):
        return "-"


def environment() -> dict[str, str]:
    """What measured figures depend on, by name: the revision, versions, system and number of processors."""
    git = ["git", "-C", str(ROOT), "describe", "--always", "--dirty"]
    found = {
        "revision": subprocess.run(git, capture_output=True, text=True, check=False).stdout.strip() or "unknown",
        "python": platform.python_version(),
        "system": platform.system(),
        "machine": platform.machine(),
        "cores": str(os.cpu_count()),
        "heat-igl": heat_igl.__version__,
    }
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "-"
    return found


def as_they_are(rows: Sequence[Row], text: str = "", form: str = ".3g") -> Table:
    """A column for each value of the first row; floats with three digits, lists with commas."""

    def cell(value: Any) -> str:
        if isinstance(value, list):
            return ", ".join(map(str, value)) or "-"
        return f"{value:{form}}" if isinstance(value, float) else str(value).replace("|", r"\|")

    return Table(
        [{cell(key): cell(v) for key, v in row.items()} for row in rows], {cell(k): cell(k) for k in rows[0]}, text
    )


def fill_in(text: str, parts: Mapping[str, str]) -> str:
    """`text` with the text between ``<!-- name -->`` and ``<!-- /name -->`` replaced by the part of that name."""
    for name, part in parts.items():
        first, last = f"<!-- {name} -->", f"<!-- /{name} -->"
        if first in text:
            before, rest = text.split(first, 1)
            text = f"{before}{first}\n{part}\n{last}{rest.split(last, 1)[1]}"
    return text


def publish(options: argparse.Namespace, tables: Mapping[str, Table | str]) -> None:
    """Print the environment and the tables, and write them wherever the options say.

    Tables, or paragraphs, have the name of the part of a page.
    """
    around, name = environment(), Path(sys.argv[0]).stem
    parts = {part: each if isinstance(each, str) else each.markdown() for part, each in tables.items()}
    text = "\n\n".join(
        [f"Environment: {', '.join(f'{key} {value}' for key, value in around.items())}", *parts.values()]
    )
    print(text, flush=True)
    if options.output is not None:
        rows = {part: each.rows for part, each in tables.items() if isinstance(each, Table)}
        result: dict[str, Any] = {"environment": around, "seed": options.seed} | rows
        options.output.mkdir(parents=True, exist_ok=True)
        (options.output / f"{name}.md").write_text(text + "\n", encoding="utf8")
        (options.output / f"{name}.json").write_text(json.dumps(result, indent=1, default=_plain), encoding="utf8")
    if options.docs is not None:
        dated = {part: f"{each}\n\nRevision {around['revision']}." for part, each in parts.items()}
        dated["environment"] = text.partition("\n")[0]
        options.docs.write_text(fill_in(options.docs.read_text(encoding="utf8"), dated), encoding="utf8")


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)


def collected(rows: Iterable[Row]) -> list[Row]:
    """All rows; each goes to stderr as it is there."""
    found = []
    for row in rows:
        found.append(row)
        print(", ".join(f"{name} {value}" for name, value in row.items())[:160], file=sys.stderr, flush=True)
    return found


# Meshes.


def named(paths: Iterable[Path]) -> dict[str, Mesh]:
    """Meshes of files, by the names of the files."""
    return {path.stem: read_mesh(path) for path in paths}


def moved_inside(mesh: Mesh, rng: np.random.Generator, most: float, fixed: FloatArray | bool = False) -> Mesh:
    """The mesh with vertices moved by up to `most` in x and y, except on the boundary and where `fixed` is true."""
    V, inner = mesh.V.copy(), ~mesh.boundary & ~np.asarray(fixed)
    V[inner, :2] += rng.uniform(-most, most, (int(inner.sum()), 2))
    return Mesh(V, mesh.F)


def drawn(mesh: Mesh, count: int, seed: int = 0) -> list[int]:
    """Different vertices of faces."""
    usable = np.unique(mesh.F)
    found: list[int] = np.random.default_rng(seed).choice(usable, min(count, len(usable)), replace=False).tolist()
    return found


# Methods: each takes a mesh and returns a query. What a query does not use again is not prepared.


def ours(method: str | None = None, **options: Any) -> Callable[[Any], Query]:
    """A method of this package, or the heat method with options."""
    return lambda mesh: SolverChoice.of(method, **options).on(mesh).distance


def _potpourri3d(mesh: Mesh) -> Query:
    import potpourri3d

    solver = potpourri3d.MeshHeatMethodDistanceSolver(mesh.V, mesh.F)
    return lambda source: solver.compute_distance(int(source))


def _libigl_heat(mesh: Mesh) -> Query:
    data = igl.HeatGeodesicsData()
    igl.heat_geodesics_precompute(mesh.V, mesh.F, data)
    return lambda source: np.asarray(igl.heat_geodesics_solve(data, np.array([source])))


def _native(name: str) -> Callable[[Any], Query]:
    """A function of `heat_igl.reference.native` that prepares nothing, in this process."""

    def prepare(mesh: Mesh) -> Query:
        from heat_igl.reference import native

        solve = getattr(native, name)
        return lambda source: solve(mesh.V, mesh.F, np.array([source]))["distance"]

    return prepare


def _fast_marching(mesh: Mesh) -> Query:
    import potpourri3d

    solver = potpourri3d.MeshFastMarchingDistanceSolver(mesh.V, mesh.F)
    return lambda source: np.asarray(solver.compute_distance([[(int(source), [])]]))


def vtp(mesh: Mesh, source: int) -> tuple[float, FloatArray]:
    """Seconds of the propagation of VTP (Qin et al. 2016), and its distances; inf where it leaves none.

    The program that the variable HEAT_IGL_VTP names is called with ``-m FILE -s VERTEX -o DISTANCES``.
    """
    # It merges vertices in one place, and counts them in the order in which they come first.
    _, first, place = np.unique(mesh.V, axis=0, return_index=True, return_inverse=True)
    merged = np.argsort(np.argsort(first))[place.ravel()]
    with tempfile.TemporaryDirectory() as folder:
        path, found = Path(folder, "mesh.obj"), Path(folder, "distance.txt")
        write_mesh(path, mesh)
        command = [os.environ["HEAT_IGL_VTP"], "-m", str(path), "-s", str(merged[source]), "-o", str(found)]
        printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        distance = np.loadtxt(found)
    seconds = float(re.findall(r"propagation step took (\S+) seconds", printed)[0])
    return seconds, np.where(distance < 1e99, distance, np.inf)[merged]


@dataclass(frozen=True)
class Method:
    """A method, what it needs, and where it is left out.

    Above `most` vertices it takes minutes or gigabytes. It `needs` a module, or a variable of the environment, and
    `prepares` something that queries share.
    """

    prepare: Callable[[Any], Query]
    most: int = 5_000_000
    needs: str = "heat_igl"
    prepares: bool = True

    @property
    def is_there(self) -> bool:
        """Whether what it needs is installed."""
        return self.needs in os.environ or importlib.util.find_spec(self.needs) is not None


METHODS = {
    "heat": Method(ours("heat")),
    "sweep": Method(ours("sweep")),
    "windows": Method(ours("windows")),
    "exact": Method(ours("exact"), 1_000_000),
    "potpourri3d": Method(_potpourri3d, 1_250_000, "potpourri3d"),
    "libigl heat": Method(_libigl_heat, 1_250_000),
    "MeshLab's front": Method(_native("meshlab_front"), 125_000, "pymeshlab", prepares=False),
    "potpourri3d fast marching": Method(_fast_marching, 500_000, "potpourri3d"),
    "VTP": Method(lambda mesh: lambda source: vtp(mesh, source)[1], 500_000, "HEAT_IGL_VTP", prepares=False),
    "pygeodesic": Method(_native("pygeodesic_exact"), 50_000, "pygeodesic", prepares=False),
    "libigl exact": Method(_native("igl_exact"), 30_000, prepares=False),
    "gdist": Method(_native("gdist_exact"), 50_000, "gdist", prepares=False),
}


# Errors.


def errors(found: FloatArray, truth: FloatArray) -> dict[str, float]:
    """In percent: mean and 99th percentile of |d - truth| / truth, and the largest differences in largest distances.

    Over the vertices at a positive finite distance; "largest" is |d - truth|, "below" truth - d.
    """
    there = np.isfinite(truth) & (truth > 0)
    if not there.any():
        return {"mean": 0.0, "p99": 0.0, "largest": 0.0, "below": 0.0}
    relative, most = 100 * metrics.relative_error(found, truth)[there], truth[there].max()
    off = 100 * (found[there] - truth[there]) / most
    return {
        "mean": float(relative.mean()),
        "p99": float(np.percentile(relative, 99)),
        "largest": float(np.abs(off).max()),
        "below": max(0.0, float(-off.min())),
    }


def mean_error(query: Callable[[Any], FloatArray], sources: Iterable[Any], truth: Callable[[Any], FloatArray]) -> float:
    """Mean of |d - truth| / truth over vertices and sources, in percent."""
    return float(np.mean([errors(query(source), truth(source))["mean"] for source in sources]))


def warned(call: Callable[[], Any]) -> tuple[Any, bool]:
    """What a call returns, and whether it warned of its accuracy."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = call()
    return found, any(issubclass(each.category, heat_igl.AccuracyWarning) for each in caught)


def geometric_mean(values: Iterable[float]) -> float:
    return float(np.exp(np.mean(np.log(list(values)))))


# Times.


def seconds(call: Callable[[], object], clock: Callable[[], float] = time.process_time) -> float:
    """Of one call: processor time of all threads, which other programs disturb least, or by another clock."""
    start = clock()
    call()
    return clock() - start


def paired(
    calls: Mapping[str, Callable[[], object]], repeats: int, clock: Callable[[], float] = time.process_time
) -> dict[str, FloatArray]:
    """Seconds (repeats,) of each call; they take turns, after one round that warms up."""
    rounds = [[seconds(call, clock) for call in calls.values()] for _ in range(repeats + 1)][1:]
    return dict(zip(calls, np.array(rounds).T, strict=True))


def ratio(one: FloatArray, other: FloatArray) -> float:
    """The median of the ratios of paired times."""
    return float(np.median(one / other))
