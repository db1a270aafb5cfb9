"""MSH, the format of Gmsh: versions 2 and 4.1, text and binary.

meshio is not used, since it treats node 0 as the last node, accepts a truncated file with a printed warning, and needs
memory in proportion to the largest node number: 1.5 GB for four nodes with numbers up to 4e8.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from heat_igl.errors import MeshError
from heat_igl.io.contents import Contents, check, integers, select
from heat_igl.io.text import Text, format_rows
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["read", "write"]

# Kind and number of nodes of each element type of Gmsh.
_ELEMENTS = {
    1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8), 6: ("wedge", 6),
    7: ("pyramid", 5), 8: ("line3", 3), 9: ("triangle6", 6), 10: ("quad9", 9), 11: ("tetra10", 10),
    12: ("hexahedron27", 27), 13: ("wedge18", 18), 14: ("pyramid14", 14), 15: ("vertex", 1), 16: ("quad8", 8),
    17: ("hexahedron20", 20), 18: ("wedge15", 15), 19: ("pyramid13", 13), 20: ("triangle9", 9),
    21: ("triangle10", 10), 22: ("triangle12", 12), 23: ("triangle15", 15), 24: ("triangle15i", 15),
    25: ("triangle21", 21), 26: ("line4", 4), 27: ("line5", 5), 28: ("line6", 6), 29: ("tetra20", 20),
    30: ("tetra35", 35), 31: ("tetra56", 56),
}  # fmt: skip


class _Section:
    """One section of the file; methods consume the numbers from the front."""

    def __init__(self, path: Path, data: bytes, name: str, begin: int, order: str, size: int) -> None:
        opening = re.compile(rb"^\$" + name.encode() + rb"[ \t]*\r?\n", re.MULTILINE).search(data, begin)
        if opening is None:
            raise MeshError(f"{path}: the section ${name} is missing: the file is cut short or no mesh")
        line = "" if order else f", line {data.count(10, 0, opening.start()) + 1}"
        self.where = f"{path}{line} (${name})"
        self.order = order  # "" for text, "<" or ">" for binary
        self._data, self._name, self._at = data, name, opening.end()
        self._dtypes = {"int": order + "i4", "size": f"{order}u{size}", "real": order + "f8"}
        if not order:
            self._end = data.find(b"$End" + name.encode(), self._at)
            if self._end < 0:
                raise MeshError(f"{self.where}: $End{name} is missing: the file is cut short")
            body = data[self._at : self._end]
            if not body.strip():
                raise MeshError(f"{self.where}: the section is empty")
            # Blank lines replace the text before the section, so that errors give the right line numbers.
            self.text = Text(path, b"\n" * data.count(10, 0, self._at) + body)
            self.values, self.line_start = self.text.numbers(np.arange(len(self.text)))
            self._at = 0

    def take(self, count: int, kind: str) -> FloatArray:
        """The next `count` numbers; `kind` is the binary type: "int", "size" or "real"."""
        if self.order:
            return self.records(count, self._dtypes[kind]).astype(np.float64)
        if count > len(self.values) - self._at:
            raise self.short()
        self._at += count
        return self.values[self._at - count : self._at]

    def records(self, count: int, dtype: npt.DTypeLike) -> AnyArray:
        """The next `count` records of a binary section."""
        if count * np.dtype(dtype).itemsize > len(self._data) - self._at:
            raise self.short()
        found: AnyArray = np.frombuffer(self._data, dtype, count, self._at)
        self._at += found.nbytes
        return found

    def counts(self, count: int, kind: str) -> list[int]:
        """The next `count` numbers, which must be nonnegative integers."""
        found = integers(self.take(count, kind), lambda _: self.where, "count").tolist()
        if min(found) < 0:
            raise MeshError(f"{self.where}: {min(found)} is no count: the file is damaged")
        return [int(number) for number in found]

    def total(self) -> int:
        """The count at the start of a section in version 2; it is text in binary files too."""
        if not self.order:
            if self.text.count[0] != 1:
                raise self.text.error(0, "expected a count, alone on its line")
            return self.counts(1, "int")[0]
        line = re.compile(rb"[ \t]*([0-9]{1,15})[ \t]*\r?\n").match(self._data, self._at)
        if line is None:
            raise MeshError(f"{self.where}: expected a count")
        self._at = line.end()
        return int(line[1])

    def tags(self, values: FloatArray) -> IntArray:
        """`values` as node numbers."""
        return integers(values.ravel(), lambda _: self.where, "node number").reshape(values.shape)

    def short(self) -> MeshError:
        return MeshError(f"{self.where}: fewer numbers than announced: the file is cut short, or its counts are wrong")

    def skip_text(self) -> None:
        """Skip the remaining numbers of a text section."""
        self._at = len(self.values)

    def close(self) -> int:
        """The end of the section in the file; raises MeshError if numbers are left."""
        if not self.order:
            if self._at < len(self.values):
                raise MeshError(f"{self.where}: {len(self.values) - self._at} more numbers than announced")
            return self._end
        closing = re.compile(rb"\s*\$End" + self._name.encode()).match(self._data, self._at)
        if closing is None:
            raise MeshError(f"{self.where}: $End{self._name} is not where the counts say: the file is damaged")
        return closing.end()


Blocks = list[tuple[str, IntArray]]


def _kind(section: _Section, number: int) -> tuple[str, int]:
    if number not in _ELEMENTS:
        raise MeshError(f"{section.where}: unknown element type {number}: the file is damaged, or of a newer version")
    return _ELEMENTS[number]


def _nodes_2(section: _Section) -> tuple[IntArray, FloatArray]:
    n = section.total()
    if section.order:
        rows = section.records(n, [("tag", section.order + "i4"), ("position", section.order + "f8", 3)])
        return rows["tag"].astype(np.int64), rows["position"].astype(np.float64)
    table = section.take(4 * n, "real").reshape(n, 4)
    return section.tags(table[:, 0]), table[:, 1:]


def _elements_2(section: _Section) -> Blocks:
    n = section.total()
    blocks: Blocks = []
    if section.order:
        while n > 0:
            number, k, n_tags = section.counts(3, "int")
            kind, n_nodes = _kind(section, number)
            rows = section.take(k * (1 + n_tags + n_nodes), "int").reshape(k, 1 + n_tags + n_nodes)
            blocks.append((kind, section.tags(rows[:, 1 + n_tags :])))
            n -= max(k, 1)
        return blocks
    # One element per line: number, type, number of tags, tags, nodes.
    text, start = section.text, section.line_start[1:]
    if len(start) != n:
        raise MeshError(f"{section.where}: {n} elements are announced, but {len(start)} lines follow")
    lines = np.arange(1, n + 1)
    if (text.count[lines] < 4).any():
        raise text.error(lines[np.argmax(text.count[lines] < 4)], "too few numbers for an element")
    types, n_tags_of = (integers(section.values[start + i], lambda i: text.where(lines[i]), "type") for i in (1, 2))
    for number in np.unique(types).tolist():
        kind, n_nodes = _kind(section, number)
        chosen = np.flatnonzero(types == number)
        wrong = text.count[lines[chosen]] != 3 + n_tags_of[chosen] + n_nodes
        wrong |= n_tags_of[chosen] < 0
        if wrong.any():
            raise text.error(lines[chosen[np.argmax(wrong)]], f"an element of kind {kind} has {n_nodes} nodes")
        at = (start + 3 + n_tags_of)[chosen]
        blocks.append((kind, section.tags(section.values[at[:, None] + np.arange(n_nodes)])))
    section.skip_text()
    return blocks


def _nodes_4(section: _Section) -> tuple[IntArray, FloatArray]:
    n_blocks, n, _, _ = section.counts(4, "size")
    tags: list[FloatArray] = [np.empty(0)]
    positions: list[FloatArray] = [np.empty((0, 3))]
    for _ in range(n_blocks):
        dimension, _, parametric = integers(section.take(3, "int"), lambda _: section.where, "entity").tolist()
        (k,) = section.counts(1, "size")
        tags.append(section.take(k, "size"))
        # Nodes of a parametrized entity have parameters after the position.
        width = 3 + (min(max(dimension, 0), 3) if parametric == 1 else 0)
        positions.append(section.take(k * width, "real").reshape(k, width)[:, :3])
    tag = section.tags(np.concatenate(tags))
    if len(tag) != n:
        raise MeshError(f"{section.where}: {n} nodes are announced, but the blocks hold {len(tag)}")
    return tag, np.concatenate(positions)


def _elements_4(section: _Section) -> Blocks:
    n_blocks, n, _, _ = section.counts(4, "size")
    blocks: Blocks = []
    for _ in range(n_blocks):
        number = int(integers(section.take(3, "int")[2:], lambda _: section.where, "element type")[0])
        kind, n_nodes = _kind(section, number)
        (k,) = section.counts(1, "size")
        blocks.append((kind, section.tags(section.take(k * (1 + n_nodes), "size").reshape(k, 1 + n_nodes)[:, 1:])))
    found = sum(len(rows) for _, rows in blocks)
    if found != n:
        raise MeshError(f"{section.where}: {n} elements are announced, but the blocks hold {found}")
    return blocks


def _positions(section: _Section, tag: IntArray, blocks: Blocks) -> Blocks:
    """Replace node numbers, which may have gaps and any order, by positions in the list of nodes."""
    order = np.argsort(tag, kind="stable")
    ascending = tag[order]
    twice = np.flatnonzero(ascending[1:] == ascending[:-1])
    if len(twice):
        raise MeshError(f"{section.where}: node {ascending[twice[0]]} is in $Nodes twice ({len(twice)} such nodes)")
    found = []
    for kind, rows in blocks:
        place = np.minimum(np.searchsorted(ascending, rows), len(tag) - 1)
        missing = ascending[place] != rows
        if missing.any():
            raise MeshError(
                f"{section.where}: there is no vertex {rows[missing][0]} in $Nodes, but an element has it "
                f"({int(missing.any(axis=1).sum())} such elements)"
            )
        found.append((kind, order[place]))
    return found


def read(path: Path, data: bytes) -> Contents:
    """Parse an MSH file."""
    header = re.match(
        rb"\s*(?:\$Comments.*?\$EndComments\s+)?\$MeshFormat\s+([0-9.]{1,9})\s+([01])\s+([48])[ \t]*\r?\n",
        data,
        re.DOTALL,
    )
    if header is None:
        raise MeshError(f"{path}, line 1: an MSH file starts with $MeshFormat, its version and its kind")
    version = header[1].decode()
    if not (version in ("2", "4", "4.1") or version.startswith("2.")):
        raise MeshError(f"{path}: MSH version {version} is not supported: save it as version 4.1 or 2.2 in Gmsh")
    order, begin, size = "", header.end(), int(header[3])
    if header[2] == b"1":
        one = data[begin : begin + 4]
        if one not in (b"\1\0\0\0", b"\0\0\0\1"):
            raise MeshError(f"{path}: the byte order mark of a binary file is 1, not '{one.hex()}'")
        order, begin = "<" if one[0] else ">", begin + 4
    read_nodes, read_elements = (_nodes_2, _elements_2) if version.startswith("2") else (_nodes_4, _elements_4)
    nodes = _Section(path, data, "Nodes", begin, order, size)
    tag, V = read_nodes(nodes)
    if not len(tag):
        raise MeshError(f"{nodes.where}: the file has no nodes")
    elements = _Section(path, data, "Elements", nodes.close(), order, size)
    blocks = read_elements(elements)
    elements.close()
    cells = select(path, _positions(elements, tag, blocks))

    def cell_at(i: int) -> str:
        begin = int(cells.degree[:i].sum())
        return f"{path}, element with nodes {tag[cells.corners[begin : begin + cells.degree[i]]].tolist()}"

    check(V, cells, lambda i: f"{path}, node {tag[i]}", cell_at, base=0)
    return Contents(V, cells, {})


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles or tetrahedra as text MSH, version 2.2, which most programs can read."""
    number = 4 if mesh.is_tetrahedral else 2
    vertices = np.column_stack([np.arange(1, mesh.n_vertices + 1), mesh.V])
    faces = np.column_stack([np.arange(1, mesh.n_faces + 1), mesh.F + 1])
    node = "%d " * mesh.F.shape[1]
    path.write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{mesh.n_vertices}\n"
        + format_rows("%d %r %r %r\n", vertices)
        + f"$EndNodes\n$Elements\n{mesh.n_faces}\n"
        + format_rows(f"%d {number} 2 0 0 {node}\n", faces)
        + "$EndElements\n"
    )
