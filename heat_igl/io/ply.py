"""PLY, text and binary of either byte order, with attributes per vertex.

meshio is not used: it rejects additional elements and the property name vertex_index, has no 16-bit types in binary
files, reads unsigned bytes as signed ones, reads the bytes after a list as the next list, and omits arrays (n, k).
The reader of libigl frees memory twice if properties have different types.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.io.contents import Cells, Contents, Text, check, integers, numbered, of_corner, ragged, warn_if_cut
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray, IntArray

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_STRUCT = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f", "f8": "d"}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class Property(NamedTuple):
    """A scalar property of an element, or a list, for which `count_dtype` is not empty."""

    name: str
    dtype: str
    count_dtype: str = ""


class Element(NamedTuple):
    """An element: n rows of the same properties."""

    name: str
    n: int
    properties: list[Property]


class Column(NamedTuple):
    """The values of one property in all rows; `length` is that of the list in each row, and empty for scalars."""

    values: AnyArray
    length: IntArray


class Header(NamedTuple):
    """The header of a PLY file.

    `order` is "" for text, and "<" or ">" for binary of low or high byte first; `vectors` the k of each attribute (n,
    k) that `heat_igl.io.ply.write` spread over k properties; `end` the first byte after the header of `n_lines` lines.
    """

    order: str
    elements: list[Element]
    vectors: dict[str, int]
    end: int
    n_lines: int


Tables = dict[str, tuple[Element, dict[str, Column]]]


def _header(path: Path, data: bytes) -> Header:
    end = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", data, re.MULTILINE) or re.search(rb"\rend_header[ \t]*\r", data)
    if not re.match(rb"ply[ \t]*[\r\n]", data):
        raise MeshError(f"{path}, line 1: a PLY file starts with 'ply'" if data else f"{path}: the file is empty")
    if not end:
        raise MeshError(f"{path}: the header has no 'end_header': the file is cut short or no PLY file")
    order: str | None = None
    elements: list[Element] = []
    vectors = {}
    lines = data[: end.end()].decode("latin-1").splitlines()
    for number, line in enumerate(lines, 1):
        match line.split():
            case ["format", name, _] if name in _FORMATS and order is None:
                order = _FORMATS[name]
            case ["element", name, n] if re.fullmatch("[0-9]{1,15}", n):
                elements.append(Element(name, int(n), []))
            case ["property", "list", count, item, name] if (
                elements and item in _TYPES and _TYPES.get(count, "f")[0] != "f"
            ):
                elements[-1].properties.append(Property(name, _TYPES[item], _TYPES[count]))
            case ["property", item, name] if elements and item in _TYPES:
                elements[-1].properties.append(Property(name, _TYPES[item]))
            case ["comment", "vector", name, k] if k.isdigit() and len(k) < 10:
                vectors[name] = int(k)
            case ["ply" | "end_header"] | ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise MeshError(f"{path}, line {number} ({line[:60]}): not understood in the header of a PLY file")
    if order is None:
        raise MeshError(f"{path}: the header does not say 'format ascii 1.0' or another format")
    for element in elements:
        names = [prop.name for prop in element.properties]
        if (element.n and not names) or len(set(names)) < len(names):
            raise MeshError(f"{path}: element {element.name} has no properties in the header, or one of them twice")
    return Header(order, elements, vectors, end.end(), len(lines))


def _binary(path: Path, data: bytes, header: Header) -> Iterator[tuple[Element, dict[str, Column]]]:
    at = header.end
    for element in header.elements:
        short = MeshError(
            f"{path}: the header announces {element.n} of element {element.name}, but the file ends before them: it is "
            "cut short, or its counts are wrong"
        )
        smallest = sum(np.dtype(prop.count_dtype or prop.dtype).itemsize for prop in element.properties)
        if element.n * smallest > len(data) - at:
            raise short
        try:
            read = _equal_rows(data, at, element, header.order) or _unequal_rows(data, at, element, header.order)
        except (struct.error, IndexError):
            raise short from None
        at, columns = read
        yield element, columns
    if data[at:].strip():
        raise MeshError(
            f"{path}: {len(data) - at} bytes follow what the header announces: its counts or types are wrong"
        )


def _equal_rows(data: bytes, at: int, element: Element, order: str) -> tuple[int, dict[str, Column]] | None:
    """As `_unequal_rows`, and much faster; None if lists differ in length."""
    if not element.n:
        return None
    _, first = _unequal_rows(data, at, element._replace(n=1), order)
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    lengths = {}
    for i, prop in enumerate(element.properties):
        if prop.count_dtype:
            lengths[f"n{i}"] = int(first[prop.name].length[0])
            fields += [(f"n{i}", order + prop.count_dtype), (f"p{i}", order + prop.dtype, (lengths[f"n{i}"],))]
        else:
            fields.append((f"p{i}", order + prop.dtype))
    dtype = np.dtype(fields)
    if element.n * dtype.itemsize > len(data) - at:
        return None
    rows = np.frombuffer(data, dtype, element.n, at)
    if not all((rows[name] == length).all() for name, length in lengths.items()):
        return None
    columns = {}
    for i, prop in enumerate(element.properties):
        values = rows[f"p{i}"]
        per_row = np.full(len(rows) if prop.count_dtype else 0, values.shape[-1], np.int64)
        columns[prop.name] = Column(values.astype(prop.dtype).ravel(), per_row)
    return at + rows.nbytes, columns


def _unequal_rows(data: bytes, at: int, element: Element, order: str) -> tuple[int, dict[str, Column]]:
    """The columns of an element whose lists differ in length, and the position after the last row."""
    steps: list[tuple[struct.Struct | None, int, list[int], list[int]]] = []
    for prop in element.properties:
        count = struct.Struct(order + _STRUCT[prop.count_dtype]) if prop.count_dtype else None
        steps.append((count, np.dtype(prop.dtype).itemsize, [], []))
    for _ in range(element.n):
        for count, size, places, lengths in steps:
            length = 1
            if count is not None:
                (length,) = count.unpack_from(data, at)
                at += count.size
                lengths.append(length)
            places.append(at)
            at += length * size
            if length < 0 or at > len(data):
                raise IndexError
    codes = np.frombuffer(data, np.uint8)
    columns = {}
    for prop, (_, size, places, lengths) in zip(element.properties, steps, strict=True):
        per_row = np.array(lengths, np.int64)
        spans = per_row * size if prop.count_dtype else np.full(element.n, size, np.int64)
        values = codes[ragged(np.array(places, np.int64), spans)].view(order + prop.dtype).astype(prop.dtype)
        columns[prop.name] = Column(values, per_row)
    return at, columns


def _ascii(text: Text, header: Header) -> Iterator[tuple[Element, dict[str, Column]]]:
    total = sum(element.n for element in header.elements)
    if total != len(text):
        raise MeshError(
            f"{text.path}: the header announces {total} lines of data, but {len(text)} follow: the file is cut short, "
            "or its counts are wrong"
        )
    begin = 0
    for element in header.elements:
        lines = np.arange(begin, begin + element.n)
        begin += element.n
        values, at = text.numbers(lines)
        end = at + text.count[lines]
        columns = {}
        for prop in element.properties:
            length: IntArray = np.ones(element.n, np.int64)
            if prop.count_dtype:
                text.refuse(lines, at >= end, "too few numbers for the properties in the header")
                length = integers(values[at], lambda i, lines=lines: text.where(lines[i]), "length of a list")  # type: ignore[misc]
                at = at + 1
            text.refuse(lines, (length < 0) | (at + length > end), "too few numbers for the properties in the header")
            columns[prop.name] = Column(values[ragged(at, length)], length if prop.count_dtype else length[:0])
            at = at + length
        text.refuse(lines, at < end, "more numbers than the header has properties")
        yield element, columns


def parse(path: Path, data: bytes, needed: tuple[str, ...]) -> tuple[Header, Tables]:
    """The header, and the columns of each element by the names of the properties.

    A MeshError if the file is not as the header says, or if an element that is `needed` is empty, missing or there
    twice.
    """
    header = _header(path, data)
    count = {element.name: element.n for element in header.elements}
    for name in needed:
        if not count.get(name) or sum(element.name == name for element in header.elements) > 1:
            remedy = " (triangle strips are not supported)" if "tristrips" in count else ""
            if name == "face" and not remedy and count.get("vertex"):
                remedy = ": read_point_cloud, or --points on the command line, reads points without faces"
            raise MeshError(f"{path}: the header announces no element '{name}', or announces it twice{remedy}")
    if header.order:
        found = _binary(path, data, header)
    else:
        # Blank lines replace the header, so that errors give the right line numbers.
        found = _ascii(Text(path, b"\n" * header.n_lines + data[header.end :]), header)
    return header, {element.name: (element, columns) for element, columns in found}


def read(path: Path, data: bytes) -> Contents:
    """Parse a PLY file."""
    header, tables = parse(path, data, ("vertex", "face"))
    V, others = _vertices(path, tables)
    faces, n_faces = tables["face"][1], tables["face"][0].n
    name = "vertex_indices" if "vertex_indices" in faces else "vertex_index"
    if name not in faces or len(faces[name].length) != n_faces:
        raise MeshError(f"{path}: element face needs the list property vertex_indices (or vertex_index)")
    degree = faces[name].length
    face_at = numbered(path, "face", 0)
    if (degree < 3).any():
        i = int(np.argmax(degree < 3))
        raise MeshError(f"{face_at(i)}: {degree[i]} corners; a face needs three ({int((degree < 3).sum())} have fewer)")
    cells = Cells(integers(faces[name].values.astype(np.float64), of_corner(degree, face_at)), degree)
    check(V, cells, numbered(path, "vertex", 0), face_at)
    if not header.order:
        warn_if_cut(path, data, int(cells.corners[-1]) or len(V), len(V))
    for vector, k in header.vectors.items():
        parts = [f"{vector}_{i}" for i in range(min(k, len(others) + 1))]
        if parts and vector not in others and all(part in others for part in parts):
            others[vector] = np.stack([others.pop(part) for part in parts], axis=1)
    return Contents(V, cells, others)


def read_vertices(path: Path, data: bytes) -> tuple[FloatArray, dict[str, AnyArray]]:
    """The vertices (n, 3) of a PLY file with or without faces, and their other scalar properties."""
    return _vertices(path, parse(path, data, ("vertex",))[1])


def _vertices(path: Path, tables: Tables) -> tuple[FloatArray, dict[str, AnyArray]]:
    element, columns = tables["vertex"]
    scalars = [prop for prop in element.properties if not prop.count_dtype]
    if not {"x", "y", "z"} <= {prop.name for prop in scalars}:
        raise MeshError(f"{path}: element vertex needs the properties x, y and z")
    V = np.stack([columns[axis].values.astype(np.float64) for axis in "xyz"], axis=1)
    others = {
        prop.name: columns[prop.name].values.astype(prop.dtype) for prop in scalars if prop.name not in ("x", "y", "z")
    }
    return V, others


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles as binary PLY with all real numbers in double precision.

    PLY has no vectors: an array (n, k) becomes the properties name_0 to name_(k-1), and a comment records k.
    """
    columns: dict[str, FloatArray] = dict(zip("xyz", mesh.V.T, strict=True))
    comments = []
    for name, values in attributes.items():
        if values.ndim == 1:
            parts = {name: values}
        else:
            parts = {f"{name}_{i}": column for i, column in enumerate(values.T)}
            comments.append(f"comment vector {name} {values.shape[1]}")
        for part, column in parts.items():
            if part in columns:
                raise MeshError(f"PLY would hold two properties named {part}: rename the attribute {name}")
            columns[part] = column
    faces = np.empty(mesh.n_faces, [("degree", "u1"), ("corners", "<i4", 3)])
    faces["degree"] = 3
    faces["corners"] = mesh.F
    write_columns(path, columns, comments, faces)


def write_columns(
    path: Path, columns: Mapping[str, FloatArray], comments: Sequence[str] = (), faces: AnyArray | None = None
) -> None:
    """Write vertices, with faces or without: properties of the same length by name, x, y and z among them."""
    rows = np.stack(list(columns.values()), axis=1).astype("<f8")
    header = ["ply", "format binary_little_endian 1.0", *comments, f"element vertex {len(rows)}"]
    header += [f"property double {name}" for name in columns]
    if faces is not None:
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    with path.open("wb") as file:
        file.write("\n".join([*header, "end_header", ""]).encode("ascii"))
        file.write(rows.tobytes())
        if faces is not None:
            file.write(faces.tobytes())
