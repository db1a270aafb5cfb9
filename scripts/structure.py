"""How the package is built: its rooms and the arrows between them, long bodies, repeated passages; and their bounds.

    python scripts/structure.py                     # the report; exit status 1 where a bound is exceeded
    python scripts/structure.py --write             # also the table of rooms in ARCHITECTURE.md
    python scripts/structure.py --json FILE --most 40

A *room* is a module or a folder at the top of ``heat_igl``. An *arrow* leads from a room to one that it imports, inside
functions too; imports under ``if TYPE_CHECKING`` are listed apart. A room stands on *floor* 0 if it imports no other,
else one above the highest that it imports. A *back-arrow* leads from a room to one that follows it in the table of
ARCHITECTURE.md: no other list of the order exists, tests/test_architecture.py checks the imports against it, and its
sentences are the first ones of the rooms' docstrings. A *body* is what a function does, without its docstring, comments
and blank lines; those of compiled loops are counted apart. A *repeated passage* is a run of six or more lines that
stands in two places, in the package, the tests or the scripts; white space, comments, imports, blank lines, lines of
brackets alone and the decorators of compiled functions do not count. Takes two seconds.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csgraph

from scaffold import add_json, add_output, environment, option_parser, publish, table, write_parts

ROOT = Path(__file__).resolve().parents[1]
NAME = "heat_igl"
BOUNDS = {
    "rooms": 25,
    "arrows": 170,
    "back-arrows": 0,
    "circles": 0,
    "rooms, heat_igl/__init__.py and scripts": 27,
    "arrows, theirs and those for types too": 210,
    "longest bodies": 60,
    "longest bodies of kernels": 60,
    "longest classes": 300,
    "repeated passages": 20,
}
PASSAGE = 6
SOURCES = (".py", ".pyx", ".pxd")

Arrows = dict[str, set[str]]


# Rooms and arrows.


def room_files(package: Path) -> dict[str, list[Path]]:
    """The source files of each room, by the name of the room."""
    rooms = {path.stem: [path] for path in package.glob("*.py") if path.stem != "__init__"}
    rooms |= {path.parent.name: sorted(path.parent.rglob("*.py")) for path in package.glob("*/__init__.py")}
    return dict(sorted(rooms.items()))


def first_sentence(path: Path) -> str:
    """The first sentence of a module's docstring, in one line."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf8"))) or ""
    paragraph = " ".join(text.split("\n\n")[0].split())
    return re.split(r"(?<=\.)\s", paragraph)[0].removesuffix(".")


def sentences(package: Path) -> dict[str, str]:
    """What each room is responsible for."""
    return {
        room: first_sentence(files[0] if len(files) == 1 else package / room / "__init__.py")
        for room, files in room_files(package).items()
    }


class _Imports(ast.NodeVisitor):
    """The rooms that one file names, those under ``if TYPE_CHECKING`` apart."""

    def __init__(self, rooms: Sequence[str], home_of: Mapping[str, str], package: Sequence[str]) -> None:
        self.rooms, self.home_of, self.package = set(rooms), home_of, package
        self.found: dict[bool, set[str]] = {False: set(), True: set()}
        self.for_types = False

    def visit_If(self, node: ast.If) -> None:
        outside = self.for_types
        self.for_types = outside or "TYPE_CHECKING" in ast.unparse(node.test)
        for child in node.body:
            self.visit(child)
        self.for_types = outside
        for child in node.orelse:
            self.visit(child)

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            self._add(alias.name.split("."))

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        base = list(self.package[: len(self.package) - node.level + 1]) if node.level else []
        place = base + (node.module.split(".") if node.module else [])
        if place == [NAME]:
            for alias in node.names:
                self._add([NAME, alias.name])
        else:
            self._add(place)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if isinstance(node.value, ast.Name) and node.value.id == NAME:
            self._add([NAME, node.attr])
        self.generic_visit(node)

    def _add(self, place: Sequence[str]) -> None:
        if len(place) > 1 and place[0] == NAME:
            room = place[1] if place[1] in self.rooms else self.home_of.get(place[1])
            if room is not None:
                self.found[self.for_types].add(room)


def _homes(package: Path) -> dict[str, str]:
    """The room of each name that ``heat_igl/__init__.py`` hands on."""
    tree = ast.parse((package / "__init__.py").read_text(encoding="utf8"))
    return {
        alias.asname or alias.name: node.module.split(".")[1]
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{NAME}.")
        for alias in node.names
    }


def _visited(paths: Iterable[Path], rooms: Sequence[str], package: Path) -> dict[bool, set[str]]:
    """The rooms that files import, and under True those that they import for type checkers."""
    homes = _homes(package)
    found: dict[bool, set[str]] = {False: set(), True: set()}
    for path in paths:
        inside = path.relative_to(package).parts[:-1] if package in path.parents else ()
        visitor = _Imports(rooms, homes, [NAME, *inside])
        visitor.visit(ast.parse(path.read_text(encoding="utf8")))
        found = {kind: names | visitor.found[kind] for kind, names in found.items()}
    return found


def arrows(package: Path) -> tuple[Arrows, Arrows]:
    """The rooms that each room imports; and those that it needs for type checkers alone."""
    rooms = room_files(package)
    found = {room: _visited(files, list(rooms), package) for room, files in rooms.items()}
    real = {room: names[False] - {room} for room, names in found.items()}
    return real, {room: names[True] - names[False] - {room} for room, names in found.items()}


def circles(imports: Arrows) -> list[list[str]]:
    """Rooms that import each other, directly or over others: the strongly connected components of the arrows."""
    rooms = list(imports)
    matrix = np.array([[other in imports[room] for other in rooms] for room in rooms])
    _, labels = csgraph.connected_components(matrix, connection="strong")
    groups = [[room for room, label in zip(rooms, labels, strict=True) if label == k] for k in np.unique(labels)]
    return [group for group in groups if len(group) > 1]


def floors(imports: Arrows) -> list[list[str]]:
    """The rooms of each floor, from the ground up; what a circle holds, or stands on one, has none."""
    placed: list[list[str]] = []
    below: set[str] = set()
    while ready := [room for room in imports if room not in below and imports[room] <= below]:
        placed.append(ready)
        below |= set(ready)
    return placed


def table_order(page: str) -> list[str]:
    """The rooms in the order of the table in ARCHITECTURE.md, the lowest first."""
    inside = page.partition("<!-- rooms -->")[2].partition("<!-- /rooms -->")[0]
    return re.findall(r"^\| `(\w+)` \|", inside, re.MULTILINE)


def back_arrows(imports: Arrows, order: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of a room and one that it imports although it does not stand below it in the order."""
    place = {room: k for k, room in enumerate(order)}
    return [
        (room, other)
        for room, others in imports.items()
        for other in sorted(others)
        if place.get(other, len(place)) >= place.get(room, -1)
    ]


def room_table(package: Path, order: Sequence[str]) -> str:
    """The table of rooms: in this order, rooms that it lacks at the end."""
    found = sentences(package)
    rooms = [room for room in order if room in found] + [room for room in found if room not in order]
    return "\n".join(table(["room", "responsible for"], [(f"`{room}`", found[room]) for room in rooms], (0, 1)))


# Lengths.


@dataclass(frozen=True)
class Length:
    """A function or class and its lines of code."""

    path: str
    line: int
    name: str
    lines: int


def _code_lines(text: str) -> list[bool]:
    """Whether each line holds more than a comment."""
    return [bool(line.strip()) and not line.lstrip().startswith("#") for line in text.splitlines()]


def _docstring_lines(tree: ast.AST) -> set[int]:
    held = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    found: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, held) and ast.get_docstring(node, clean=False) is not None:
            found |= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return found


class Lengths(NamedTuple):
    """Bodies of functions, those in kernels, which cannot be parted freely, apart; and classes; the longest first."""

    bodies: list[Length]
    kernels: list[Length]
    classes: list[Length]


def lengths(package: Path) -> Lengths:
    """The lengths of all functions and classes."""
    found = Lengths([], [], [])
    for path in sorted(package.rglob("*.py")):
        text = path.read_text(encoding="utf8")
        tree = ast.parse(text)
        is_code, skipped = _code_lines(text), _docstring_lines(tree)
        place = str(path.relative_to(package.parent))
        bodies = found.kernels if "kernels" in path.parts else found.bodies
        for node in ast.walk(tree):
            if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                continue
            is_class = isinstance(node, ast.ClassDef)
            first = node.lineno if is_class else node.body[0].lineno
            span = range(first, (node.end_lineno or first) + 1)
            n = sum(is_code[line - 1] and line not in skipped for line in span)
            (found.classes if is_class else bodies).append(Length(place, node.lineno, node.name, n))
    for each in found:
        each.sort(key=lambda length: -length.lines)
    return found


# Repeated passages.


@dataclass(frozen=True)
class Passage:
    """Two places that hold the same lines."""

    first: str
    second: str
    lines: int


def passage_lines(text: str) -> list[tuple[int, str]]:
    """Number and content of the lines that can make a repeated passage."""
    found = []
    in_import = False
    for number, line in enumerate(text.splitlines(), 1):
        content = " ".join(re.sub(r"(^|\s{2,})#.*$", "", line).split())
        if in_import or re.match(r"(from \S+ )?c?import\b", content):
            in_import = "(" in content or (in_import and ")" not in content)
            in_import &= ")" not in content
        elif re.search(r"\w", content) and not content.startswith("@cython."):
            found.append((number, content))
    return found


def repeated(files: Mapping[str, str], least: int = PASSAGE) -> list[Passage]:
    """Pairs of places that share `least` or more lines, each run as long as it can be, the longest first."""
    lines = {name: passage_lines(text) for name, text in files.items()}
    places: dict[tuple[str, ...], list[tuple[str, int]]] = defaultdict(list)
    for name, content in lines.items():
        for k in range(len(content) - least + 1):
            places[tuple(each for _, each in content[k : k + least])].append((name, k))
    diagonals: dict[tuple[str, str, int], list[int]] = defaultdict(list)
    for where in places.values():
        for (a, i), (b, j) in combinations(where, 2):
            if a != b or j - i >= least:  # a run does not repeat itself
                diagonals[a, b, j - i].append(i)
    return sorted(
        (
            _passage(lines, a, b, run, shift, least)
            for (a, b, shift), starts in diagonals.items()
            for run in _runs(starts)
        ),
        key=lambda each: (-each.lines, each.first),
    )


def _runs(starts: Sequence[int]) -> Iterator[tuple[int, int]]:
    """First and last of each run of consecutive numbers."""
    ordered = sorted(starts)
    breaks = [k for k, (a, b) in enumerate(pairwise(ordered), 1) if b != a + 1]
    for first, last in zip([0, *breaks], [*breaks, len(ordered)], strict=True):
        yield ordered[first], ordered[last - 1]


def _passage(
    lines: Mapping[str, list[tuple[int, str]]], a: str, b: str, run: tuple[int, int], shift: int, least: int
) -> Passage:
    first, last = run[0], run[1] + least - 1
    places = (f"{name}:{lines[name][i][0]}-{lines[name][j][0]}" for name, i, j in (
        (a, first, last), (b, first + shift, last + shift)
    ))  # fmt: skip
    return Passage(*places, lines=last - first + 1)


def source_texts(root: Path) -> dict[str, str]:
    """The sources of package, tests and scripts, by path."""
    paths = [path for folder in (NAME, "tests", "scripts") for path in sorted((root / folder).rglob("*"))]
    return {str(path.relative_to(root)): path.read_text(encoding="utf8") for path in paths if path.suffix in SOURCES}


# The report.


def measured(root: Path, most: int) -> dict[str, Any]:
    """Everything that the report shows."""
    package = root / NAME
    order = table_order((root / "ARCHITECTURE.md").read_text(encoding="utf8"))
    real, for_types = arrows(package)
    outside = [[package / "__init__.py"], sorted((root / "scripts").glob("*.py"))]
    around = [set().union(*_visited(paths, list(real), package).values()) for paths in outside]
    longest = {
        name: [asdict(each) for each in found[:most]]
        for name, found in zip(
            ("longest bodies", "longest bodies of kernels", "longest classes"), lengths(package), strict=True
        )
    }
    passages = repeated(source_texts(root))
    return {
        "rooms": sentences(package),
        "arrows": {room: sorted(others) for room, others in real.items()},
        "arrows for types": {room: sorted(others) for room, others in for_types.items() if others},
        "floors": floors(real),
        "back-arrows": back_arrows(real, order),
        "circles": circles(real),
        **longest,
        "repeated passages": [asdict(each) for each in passages],
        "counts": {
            "rooms": len(real),
            "arrows": sum(map(len, real.values())),
            "back-arrows": len(back_arrows(real, order)),
            "circles": len(circles(real)),
            **{name: found[0]["lines"] if found else 0 for name, found in longest.items()},
            "repeated passages": len(passages),
            "rooms, heat_igl/__init__.py and scripts": len(real) + len(around),
            "arrows, theirs and those for types too": sum(map(len, [*real.values(), *for_types.values(), *around])),
        },
    }


def markdown(result: Mapping[str, Any], most: int) -> str:
    counts = [(name, str(found), str(BOUNDS.get(name, "-"))) for name, found in result["counts"].items()]
    rooms = [(room, " ".join(others) or "-") for room, others in result["arrows"].items()]
    parts = [
        table(["", "found", "at most"], counts),
        ["Rooms and what they import:", "", *table(["room", "imports"], rooms, (0, 1))],
        ["Floors, from the ground up:", "", *(f"{k}. {' '.join(floor)}" for k, floor in enumerate(result["floors"]))],
    ]
    if result["arrows for types"]:
        parts.append(["For type checkers alone:", ""])
        parts[-1] += [f"- {room}: {' '.join(others)}" for room, others in result["arrows for types"].items()]
    for title, name in (("Arrows against the order", "back-arrows"), ("Circles", "circles")):
        if result[name]:
            parts.append([f"{title}:", "", *(f"- {' '.join(each)}" for each in result[name])])
    for name in ("longest bodies", "longest bodies of kernels", "longest classes"):
        rows = [(f"{each['path']}:{each['line']}", each["name"], str(each["lines"])) for each in result[name]]
        parts.append([f"{name.capitalize()}:", "", *table(["place", "name", "lines"], rows, (0, 1))])
    rows = [(each["first"], each["second"], str(each["lines"])) for each in result["repeated passages"][:most]]
    parts.append(["Repeated passages:", "", *table(["place", "the same", "lines"], rows, (0, 1))])
    return "\n\n".join("\n".join(lines) for lines in parts)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(inspect.getdoc(sys.modules[__name__]))
    parser.add_argument("--root", type=Path, default=ROOT, help="the tree to look at (default: this one)")
    parser.add_argument("--most", type=int, default=20, help="rows of the lists (default 20)")
    parser.add_argument("--write", action="store_true", help="write the table of rooms into ARCHITECTURE.md")
    add_json(parser)
    add_output(parser, "structure")
    options = parser.parse_args(argv)
    page = options.root / "ARCHITECTURE.md"
    if options.write:
        order = table_order(page.read_text(encoding="utf8"))
        write_parts(page, {"rooms": room_table(options.root / NAME, order)})
    result = {"environment": environment(), **measured(options.root, options.most)}
    publish(result, markdown(result, options.most), folder=options.output, name="structure", json_file=options.json)
    exceeded = [name for name, bound in BOUNDS.items() if result["counts"][name] > bound]
    for name in exceeded:
        print(f"{name}: {result['counts'][name]}, more than {BOUNDS[name]}", file=sys.stderr)
    return int(bool(exceeded))


if __name__ == "__main__":
    sys.exit(main())
