"""STL, MEDIT's MESH, Gmsh's MSH and VTK's VTU, by meshio (extra ``io``).

meshio takes a file that is cut short for a smaller mesh, a node 0 for the last node, and may print or end the program.
So each format has a function here that checks what meshio does not, and every failure arrives as one `MeshError`.
"""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError
from heat_igl.io.contents import Cells, Contents, Text, check, integers, numbered, ragged, select
from heat_igl.io.storage import form_suffix
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray, IntArray

_FACET = re.compile(
    rb"\s*facet\s+normal(?:[ \t]+\S+){3}\s+outer\s+loop(?:\s+vertex(?:[ \t]+\S+){3}[ \t\r]*\n){3}\s*endloop\s+endfacet"
)
_BINARY_STL = 84, 50  # bytes of the header, and of a triangle
# Number of nodes by type of element in Gmsh; cells of other types are refused by name.
_CORNERS = {15: 1, 1: 2, 8: 3, 2: 3, 3: 4, 4: 4}
# 800 MB in meshio's tables.
_LARGEST_NODE = 10**8
_DAMAGED = ": the file is cut short or damaged, or its counts are wrong"


def _stl(path: Path, data: bytes) -> bytes:
    header, size = _BINARY_STL
    n = int.from_bytes(data[header - 4 : header], "little") if len(data) >= header else -1
    if n >= 0 and len(data) == header + n * size:
        return data
    if not data[:256].lstrip().lower().startswith(b"solid") or b"\0" in data:
        announced = f"; its header announces {n} triangles, {header + n * size} bytes of {len(data)}" if n >= 0 else ""
        raise MeshError(
            f"{path}, line 1: neither text STL, which starts with 'solid', nor binary STL, or cut short{announced}"
        )
    data = data.lower().replace(b"\r\n", b"\n")
    rest = _FACET.sub(lambda facet: b"\n" * facet[0].count(b"\n"), data).rstrip().splitlines()
    for i, line in enumerate(rest, 1):
        if line.strip() and not re.match(rb"\s*(end)?solid\b", line):
            shown = line.strip()[:60].decode("utf-8", "backslashreplace")
            raise MeshError(f"{path}, line {i} ({shown}): this facet is damaged, or the file is cut short here")
    if not rest[-1].lstrip().startswith(b"endsolid"):
        raise MeshError(f"{path}, line {len(rest)}: the file is cut short: the last line of an STL file is 'endsolid'")
    return data


def _medit(path: Path, data: bytes) -> bytes:
    data = re.sub(rb"#[^\n]*", b"", data.replace(b"\r\n", b"\n"))
    if not re.match(rb"\s*MeshVersionFormatted\b", data):
        raise MeshError(f"{path}: a MESH file starts with MeshVersionFormatted")
    if not re.search(rb"^\s*End\s*\Z", data, re.MULTILINE):
        raise MeshError(
            f"{path}: the file is cut short: the last line of a MESH file is End (append it if all is there)"
        )
    # Version 1 says single precision, but libigl writes all digits. meshio wants counts in lines of their own.
    data = re.sub(rb"MeshVersionFormatted\s+[012]\b", b"MeshVersionFormatted 2", data)
    return re.sub(rb"^[ \t]*((?!MeshV)[A-Za-z]+)[ \t]+(\d+)[ \t]*$", rb"\1\n\2", data, flags=re.MULTILINE)


def _msh(path: Path, data: bytes) -> bytes:
    parts = []
    for name in (b"MeshFormat", b"Nodes", b"Elements"):
        part = re.search(rb"^\$%s[ \t]*\r?\n.*?^\$End%s[ \t]*\r?$" % (name, name), data, re.MULTILINE | re.DOTALL)
        if not part:
            raise MeshError(f"{path}: ${name.decode()} is missing or has no end: the file is cut short, or no MSH file")
        parts.append(part)
    form = re.match(rb"\$MeshFormat\s+(2|4)\S*\s+0\b", parts[0][0])
    for part in parts[1:] if form else ():
        # Line breaks replace what is above, so that errors give the right line numbers.
        text = Text(path, b"\n" * data.count(b"\n", 0, part.start()) + part[0])
        check_part = _check_version_2 if form and form[1] == b"2" else _check_version_4
        end = check_part(text, part is parts[1])
        if end < len(text) - 1:
            raise text.error(end, f"more lines than announced, from here on{_DAMAGED}")
    # Without data of nodes and elements, which are not used, and which meshio does not always read.
    return b"\n".join([*(part[0] for part in parts), b""])


def _announced(text: Text, first: int, n: int) -> IntArray:
    """The `n` lines from `first` on that a section announces; its last line is its end."""
    if not 0 <= n < len(text) - first:
        raise text.error(min(first, len(text) - 1), f"fewer lines follow than announced{_DAMAGED}")
    return np.arange(first, first + n)


def _whole(text: Text, lines: IntArray, width: int = 0) -> tuple[IntArray, IntArray]:
    """The whole numbers in some lines, `width` in each if that is given, and the index of the first of each line."""
    if width:
        text.refuse(lines, text.count[lines] != width, f"expected {width} numbers{_DAMAGED}")
    values, start = text.numbers(lines)
    owner = np.repeat(lines, text.count[lines])
    return integers(values, lambda i: text.where(owner[i]), "number"), start


def _check_nodes(text: Text, lines: IntArray, numbers: AnyArray) -> None:
    """Check a number of a node in each line: meshio takes 0 for the last one, and tables as long as the largest."""
    bad = ~((numbers > 0) & (numbers <= _LARGEST_NODE)) | (numbers != np.rint(numbers))
    found = f"{numbers[np.argmax(bad)]:.15g}" if bad.any() else ""
    text.refuse(
        lines, bad, f"node number {found}, but they run from 1 to {_LARGEST_NODE}: renumber them in Gmsh{_DAMAGED}"
    )


def _check_elements(text: Text, lines: IntArray, values: IntArray, nodes: IntArray, kinds: IntArray) -> None:
    """Check elements of some types, one in each line, whose nodes are the `values` from the index `nodes` (k,) on."""
    corners = np.cumsum(text.count[lines]) - nodes
    expected = [_CORNERS.get(kind, max(k, 1)) for kind, k in zip(kinds.tolist(), corners.tolist(), strict=True)]
    text.refuse(lines, corners != expected, f"too many or too few numbers for an element of this type{_DAMAGED}")
    _check_nodes(text, np.repeat(lines, corners), values[ragged(nodes, corners)])


def _check_version_2(text: Text, is_nodes: bool) -> int:
    """Check a section, and return the line after all that it announces."""
    lines = _announced(text, 2, int(_whole(text, np.array([1]), 1)[0][0]))
    if is_nodes:
        text.refuse(lines, text.count[lines] != 4, f"expected 4 numbers{_DAMAGED}")
        _check_nodes(text, lines, text.numbers(lines)[0][::4])
    else:
        values, start = _whole(text, lines)
        text.refuse(lines, text.count[lines] < 4, f"too few numbers for an element{_DAMAGED}")
        n_tags = np.maximum(values[start + 2], 0)
        _check_elements(text, lines, values, start + 3 + n_tags, values[start + 1])
    return 2 + len(lines)


def _check_version_4(text: Text, is_nodes: bool) -> int:
    """As `_check_version_2`, for lines in blocks."""
    n_blocks, announced, *_ = _whole(text, np.array([1]), 4)[0].tolist()
    at, found = 2, 0
    for _ in range(n_blocks):
        # The kind is that of the elements; of nodes, whether they have parameters.
        *_, kind, n = _whole(text, np.array([at]), 4)[0].tolist()
        lines = _announced(text, at + 1, n)
        found, at = found + n, at + 1 + n
        if is_nodes:
            _check_nodes(text, lines, _whole(text, lines, 1)[0])
            lines = _announced(text, at, n)
            at += n
            text.refuse(lines, (text.count[lines] != 3) & (not kind), f"expected 3 numbers{_DAMAGED}")
        else:
            values, start = _whole(text, lines)
            _check_elements(text, lines, values, start + 1, np.full(n, kind))
    if found != announced:
        raise text.error(1, f"{announced} rows are announced at the beginning, but {found} in the blocks{_DAMAGED}")
    return at


def _vtu(path: Path, data: bytes) -> bytes:
    pieces = len(re.findall(rb"<Piece\b", data))
    if pieces > 1:  # meshio keeps the cells of the last one only
        raise MeshError(f"{path}: the grid is in {pieces} pieces, and only one is supported: merge them before saving")
    return data


class _Form(NamedTuple):
    name: str  # of meshio's module
    checked: Callable[[Path, bytes], bytes]  # the file as meshio understands it
    base: int  # of indices in the file
    skipping: bool = False  # whether meshio says what it leaves out, without harm


_FORMS = {
    ".stl": _Form("stl", _stl, 0),
    ".mesh": _Form("medit", _medit, 1, skipping=True),
    ".msh": _Form("gmsh", _msh, 1, skipping=True),
    ".vtu": _Form("vtu", _vtu, 0),
}


def _meshio(purpose: str, suffix: str) -> Any:
    with MissingExtraError.guard(f"{purpose} {suffix} files", "meshio", "io"):
        import meshio
    return meshio


@contextlib.contextmanager
def _strict(path: Path, purpose: str, skipping: bool = False) -> Iterator[None]:
    """A context that turns every failure of meshio into a `MeshError`: exceptions, `sys.exit`, printed warnings."""
    printed = io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            warnings.simplefilter("ignore")
            yield
    except (Exception, SystemExit) as error:
        said = " ".join(f"{printed.getvalue()} {error}".split())[:300]
        raise MeshError(
            f"{path}: meshio cannot {purpose} this file ({type(error).__name__}: {said}): it is damaged, cut "
            "short, or uses a feature that meshio lacks"
        ) from error
    if printed.getvalue().strip() and not skipping:
        raise MeshError(f"{path}: meshio left something out: {' '.join(printed.getvalue().split())[:300]}")


def read(path: Path, data: bytes) -> Contents:
    """Parse a file in one of the formats."""
    suffix = form_suffix(path)
    form = _FORMS[suffix]
    if not data.strip():
        raise MeshError(f"{path}: the file is empty")
    meshio = _meshio("reading", suffix)
    checked = form.checked(path, data)
    # meshio.read would print the error and end the program, and its readers want a file.
    with tempfile.TemporaryDirectory() as folder, _strict(path, "read", form.skipping):
        plain = path
        if checked is not data or path.suffix.lower() != suffix:
            plain = Path(folder) / f"plain{suffix}"
            plain.write_bytes(checked)
        found = getattr(meshio, form.name).read(str(plain))
        points = np.asarray(found.points, np.float64)
        V: FloatArray = np.zeros((len(points), 3))
        V[:, : points.shape[1]] = points
        blocks = [(str(block.type), np.asarray(block.data, np.int64)) for block in found.cells]
        attributes = {str(name): np.asarray(values) for name, values in found.point_data.items()}
    announced = re.search(rb"<Piece\b[^>]*\bNumberOfPoints\s*=\s*[\"']([^\"']*)", data) if suffix == ".vtu" else None
    if announced and announced[1].strip() != str(len(V)).encode():
        raise MeshError(
            f"{path}: the header announces {announced[1].decode('latin-1')[:20]} points, but the file holds {len(V)}"
        )
    cells = select(path, blocks)
    if suffix == ".stl":
        # Triangles collapse when equal positions are merged.
        F = cells.corners.reshape(-1, 3)
        F = F[(np.roll(F, 1, axis=1) != F).all(axis=1)]
        if not len(F):
            raise MeshError(f"{path}: all {len(cells.degree)} triangles have two corners in one point, so none is left")
        used, corners = np.unique(F, return_inverse=True)
        V, cells = V[used], Cells(corners.ravel(), np.full(len(F), 3))
    kind = "tetrahedron" if cells.tetrahedra else "face"
    check(V, cells, numbered(path, "vertex", form.base), numbered(path, kind, form.base), form.base)
    return Contents(V, cells, attributes if suffix == ".vtu" else {})


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles or tetrahedra, in double precision: STL as text, MSH in version 4.1 and VTU in binary."""
    suffix = form_suffix(path)
    meshio = _meshio("writing", suffix)
    kind = "tetra" if mesh.is_tetrahedral else "triangle"
    with _strict(path, "write"):
        theirs = meshio.Mesh(mesh.V, [(kind, mesh.F)], point_data=dict(attributes))
        getattr(meshio, _FORMS[suffix].name).write(str(path), theirs)
