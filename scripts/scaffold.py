"""What the scripts share: their options, the environment of their figures, Markdown tables, and where results go.

A script is one command for a table or a picture. Its ``main(argv)`` reads options, measures with seeded generators, and
hands the result to `publish`, which prints the environment and the Markdown and writes both files.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import platform
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import heat_igl
from heat_igl import Mesh, shapes

PACKAGES = (
    "numpy scipy libigl pyamg potpourri3d pygeodesic tvb-gdist pymeshlab meshio matplotlib scikit-fmm distributed zarr"
).split()


# The options.


def option_parser(description: str | None) -> argparse.ArgumentParser:
    """A parser whose help is the docstring of the script, line by line."""
    return argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)


def add_seed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seed", type=int, default=0, help="of the random generator (default 0)")


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the result goes as JSON")


def add_output(parser: argparse.ArgumentParser, name: str) -> None:
    parser.add_argument("--output", type=Path, metavar="DIRECTORY", help=f"where {name}.json and {name}.md go")


# The environment.


def environment() -> dict[str, str]:
    """Versions, system and number of processors, by name: what measured figures depend on."""
    found = {
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


def environment_line(found: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {value}" for name, value in found.items())


# The results.


def table(head: Sequence[str], rows: Iterable[Sequence[str]], left: Collection[int] = (0,)) -> list[str]:
    """The lines of a Markdown table; columns other than these are flushed right."""
    rule = ["---" if k in left else "---:" for k in range(len(head))]
    return [f"| {' | '.join(head)} |", f"|{'|'.join(rule)}|", *(f"| {' | '.join(row)} |" for row in rows)]


def fill_in(text: str, parts: Mapping[str, str]) -> str:
    """`text` with the text between ``<!-- name -->`` and ``<!-- /name -->`` replaced by the part of that name."""
    for name, part in parts.items():
        first, last = f"<!-- {name} -->", f"<!-- /{name} -->"
        if first in text:
            before, rest = text.split(first, 1)
            text = f"{before}{first}\n{part}\n{last}{rest.split(last, 1)[1]}"
    return text


def write_parts(path: Path, parts: Mapping[str, str]) -> None:
    """Replace the parts of a page in place, see `fill_in`."""
    path.write_text(fill_in(path.read_text(encoding="utf8"), parts), encoding="utf8")


def write_json(path: Path, result: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf8")


def page(result: Mapping[str, Any], text: str) -> str:
    """What is printed of a result: its environment, then the Markdown."""
    return f"Environment: {environment_line(result['environment'])}\n\n{text.rstrip()}\n"


def publish(
    result: Mapping[str, Any],
    text: str,
    *,
    folder: Path | None = None,
    name: str = "result",
    json_file: Path | None = None,
) -> str:
    """Print the environment and the Markdown, and write the result wherever an option asks for it.

    Parameters
    ----------
    result : mapping
        Plain data for JSON, its ``"environment"`` as `environment` returns it.
    text : str
        The result as Markdown.
    folder : Path, optional
        Directory for ``name.json`` and ``name.md``, made if necessary; the second is what is printed.
    name : str
        Of these files.
    json_file : Path, optional
        File for the JSON alone.

    Returns
    -------
    str
        What was printed.
    """
    whole = page(result, text)
    print(whole, end="", flush=True)
    if folder is not None:
        write_json(folder / f"{name}.json", result)
        (folder / f"{name}.md").write_text(whole, encoding="utf8")
    if json_file is not None:
        write_json(json_file, result)
    return whole


# Meshes.


def wheel_mesh(name: str) -> Path | None:
    """A sample mesh of the pymeshlab wheel, found without importing pymeshlab; None where there is none."""
    spec = importlib.util.find_spec("pymeshlab")
    if spec is None or spec.origin is None:
        return None
    return Path(spec.origin).parent / "tests" / "sample_meshes" / name


def sample(name: str) -> Mesh:
    """A sample mesh of the pymeshlab wheel, by its name without ``.obj``; a sphere where there is none."""
    path = wheel_mesh(f"{name}.obj")
    return shapes.icosphere(4) if path is None else heat_igl.read_mesh(path)


def over_meshes(
    paths: Iterable[Path], measure: Callable[[Mesh], Any], note: Callable[[Any], str] = lambda _: "done"
) -> dict[str, Any]:
    """What `measure` finds on each mesh, by the name of its file; a note for each goes to stderr as it is done."""
    found = {}
    for path in paths:
        found[path.stem] = measure(heat_igl.read_mesh(path))
        print(f"{path.stem}: {note(found[path.stem])}", file=sys.stderr, flush=True)
    return found
