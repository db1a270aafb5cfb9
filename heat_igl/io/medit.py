"""MESH, the text format of Medit: tetrahedra or triangles.

meshio is not used, since it reads version 1 files in single precision (libigl writes them with all digits), accepts a
file that is truncated before the tetrahedra as a surface, treats index 0 as the last vertex, and fails if a count
follows the keyword on the same line.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.io.contents import Contents, check, integers, select
from heat_igl.io.text import Text, format_rows
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray

__all__ = ["read", "write"]

_CELLS = {
    "triangles": ("triangle", 3),
    "quadrilaterals": ("quad", 4),
    "tetrahedra": ("tetra", 4),
    "prisms": ("wedge", 6),
    "pyramids": ("pyramid", 5),
    "hexahedra": ("hexahedron", 8),
    "hexaedra": ("hexahedron", 8),
}
# Sections without vertices or cells, which are ignored. Any other keyword is an error: it may be a damaged keyword of
# a section with cells.
_WITHOUT_CELLS = (
    "edges corners ridges requiredvertices requirededges requiredtriangles requiredquadrilaterals requiredtetrahedra "
    "paralleledges paralleltriangles normals tangents normalatvertices normalattrianglevertices "
    "normalatquadrilateralvertices tangentatvertices tangentatedges vertexongeometricvertex vertexongeometricedge "
    "vertexongeometrictriangle vertexongeometricquadrilateral edgeongeometricedge triangleongeometrictriangle "
    "triangleongeometricquadrilateral quadrilateralongeometrictriangle quadrilateralongeometricquadrilateral "
    "geometry identifier subdomainfromgeom subdomainfrommesh boundingbox angleofcornerbound "
    "angleofcornerbounds incidentmesh"
)


class _Section:
    """A keyword and the tokens up to the next one."""

    def __init__(self, text: Text, line: int, end: int) -> None:
        self.text, self.line = text, line
        self.lines: IntArray = np.arange(line, end)

    def rows(self, width: int) -> FloatArray:
        """The rows of numbers; the first number of the section is the number of rows."""
        # The count may follow the keyword on the same line or on the next one.
        beside, _ = self.text.numbers(self.lines[:1], skip=1)
        below, _ = self.text.numbers(self.lines[1:])
        values = np.concatenate([beside, below])
        if not len(values):
            raise self.text.error(self.line, "the number of rows is missing behind the keyword")
        n = int(integers(values[:1], lambda _: self.text.where(self.line), "number of rows")[0])
        if n < 0 or n * width != len(values) - 1:
            raise self.text.error(
                self.line,
                f"{n} rows of {width} numbers are announced, but {len(values) - 1} numbers follow: the file is cut "
                "short or damaged here",
            )
        return values[1:].reshape(n, width)

    def number(self) -> int:
        """The single number of a section without rows."""
        beside, _ = self.text.numbers(self.lines[:1], skip=1)
        below, _ = self.text.numbers(self.lines[1:])
        values = integers(np.concatenate([beside, below]), lambda _: self.text.where(self.line), "number")
        if len(values) != 1:
            raise self.text.error(self.line, "expected one number behind the keyword")
        return int(values[0])


def _sections(text: Text) -> list[tuple[str, _Section]]:
    initial = text.words(1)
    begin = np.flatnonzero(((initial >= b"A") & (initial <= b"Z")) | ((initial >= b"a") & (initial <= b"z")))
    word = np.char.lower(text.words(40, begin))
    number = np.isin(word, [b"nan", b"inf", b"infinity"])
    begin, word = begin[~number], word[~number]
    if not len(begin) or begin[0] != 0 or word[0] != b"meshversionformatted":
        raise text.error(0, "a MESH file starts with MeshVersionFormatted")
    end = [*begin[1:].tolist(), len(text)]
    found = [
        (name.decode("latin-1"), _Section(text, i, j))
        for name, i, j in zip(word.tolist(), begin.tolist(), end, strict=True)
    ]
    known = {"meshversionformatted", "dimension", "vertices", "end", *_CELLS, *_WITHOUT_CELLS.split()}
    for name, section in found:
        if name not in known:
            raise text.error(section.line, "unknown keyword: repair it, or remove its section")
    if found[-1][0] != "end":
        raise text.error(
            len(text) - 1, "the file is cut short: the last line of a MESH file is End (append it if all is there)"
        )
    return found


def read(path: Path, data: bytes) -> Contents:
    """Parse a MESH file."""
    text = Text(path, data, comment="#")
    sections = _sections(text)
    names = [name for name, _ in sections]
    for name in ("dimension", "vertices"):
        if names.count(name) != 1:
            raise MeshError(
                f"{path}: expected the keyword {name.capitalize()} once, found it {names.count(name)} times"
            )
    dimension = sections[names.index("dimension")][1].number()
    if dimension not in (2, 3):
        raise text.error(sections[names.index("dimension")][1].line, "the dimension must be 2 or 3")
    vertices = sections[names.index("vertices")][1]
    V: FloatArray = np.zeros((len(rows := vertices.rows(dimension + 1)), 3))
    V[:, :dimension] = rows[:, :dimension]
    blocks: list[tuple[str, IntArray]] = []
    where: list[str] = []
    for name, section in sections:
        if name in _CELLS:
            kind, corners = _CELLS[name]
            rows = section.rows(corners + 1)[:, :corners]
            place = text.where(section.line)
            index = integers(rows.ravel(), lambda _, place=place: place).reshape(rows.shape) - 1  # type: ignore[misc]
            blocks.append((kind, index))
            where.append(place)
    cells = select(path, blocks)
    check(
        V,
        cells,
        lambda i: f"{text.where(vertices.line)}, vertex {i + 1} (counted from 1)",
        lambda i: f"{path}, {'tetrahedron' if cells.tetrahedra else 'face'} {i + 1} (counted from 1)",
        base=1,
    )
    return Contents(V, cells, {})


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles or tetrahedra as MESH, version 2 (double precision)."""
    keyword = "Tetrahedra" if mesh.is_tetrahedral else "Triangles"
    path.write_text(
        f"MeshVersionFormatted 2\nDimension 3\nVertices\n{mesh.n_vertices}\n"
        + format_rows("%r %r %r 0\n", mesh.V)
        + f"{keyword}\n{mesh.n_faces}\n"
        + format_rows("%d " * mesh.F.shape[1] + "0\n", mesh.F + 1)
        + "End\n"
    )
