"""VTP, the XML format of VTK for polygons: vertex attributes, text or binary, compressed or not.

meshio has no reader for it. Arrays are in the file itself: numbers as text, or bytes in base64, or appended behind the
XML; bytes may be compressed in blocks by zlib or lzma.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.io.contents import Cells, Contents, check
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["read", "write"]

_TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8",
    "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
_DECOMPRESSORS: dict[str, Callable[[bytes], bytes]] = {
    "vtkZLibDataCompressor": zlib.decompress,
    "vtkLZMADataCompressor": lzma.decompress,
}
# Bytes of a block that is compressed at a time.
_BLOCK = 1 << 15
_APPENDED = re.compile(rb"<AppendedData[^>]*encoding\s*=\s*[\"'](raw|base64)[\"'][^>]*>\s*_", re.DOTALL)


class _File:
    """The XML of a file, and how its arrays are stored."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path = path
        self.appended, self.encoding = b"", ""
        begin = _APPENDED.search(data)
        if begin:
            # Raw bytes are no XML: they are cut out.
            end = data.rfind(b"</AppendedData>")
            self.appended, self.encoding = data[begin.end() : end], begin[1].decode()
            data = data[: begin.end()] + data[end:]
        try:
            self.root = ElementTree.fromstring(data)
        except ElementTree.ParseError as error:
            raise MeshError(f"{path}: not valid XML ({error}): the file is damaged or cut short") from error
        if self.root.tag != "VTKFile" or self.root.get("type") != "PolyData":
            raise MeshError(f"{path}: the file holds {self.root.get('type', 'no VTK data')}, not PolyData")
        self.order = "<" if self.root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
        self.header = np.dtype(self.order + _TYPES[self.root.get("header_type", "UInt32")])
        compressor = self.root.get("compressor")
        if compressor is not None and compressor not in _DECOMPRESSORS:
            raise MeshError(f"{path}: arrays are compressed by {compressor}: save the file with zlib or uncompressed")
        self.decompress = None if compressor is None else _DECOMPRESSORS[compressor]

    def array(self, element: ElementTree.Element) -> AnyArray:
        """The values of a DataArray, (k,) or (k, components)."""
        name, kind, form = (element.get(key, "") for key in ("Name", "type", "format"))
        if kind not in _TYPES:
            raise MeshError(f"{self.path}: array '{name}' is of type {kind or 'none'}, not of numbers")
        dtype = np.dtype(self.order + _TYPES[kind])
        try:
            if form == "ascii":
                values = np.array((element.text or "").split(), dtype.newbyteorder("="))
            else:
                values = np.frombuffer(self._bytes(element, form), dtype).astype(dtype.newbyteorder("="))
        except (ValueError, IndexError, binascii.Error, zlib.error, lzma.LZMAError) as error:
            raise MeshError(f"{self.path}: array '{name}' is damaged or cut short ({error})") from error
        components = int(element.get("NumberOfComponents", 1))
        # VTK has no arrays (k, 1): the name of the component tells them apart.
        return values.reshape(-1, components) if components > 1 or element.get("ComponentName0") else values

    def _bytes(self, element: ElementTree.Element, form: str) -> bytes:
        """The uncompressed bytes of an array."""
        if form == "binary":
            return self._unpacked("".join((element.text or "").split()).encode(), base64.b64decode, _base64_length)
        if form == "appended" and self.encoding:
            stored = self.appended[int(element.get("offset", 0)) :]
            if self.encoding == "raw":
                return self._unpacked(stored, bytes, lambda length: length)
            return self._unpacked(stored, base64.b64decode, _base64_length)
        raise ValueError(f"there is no format {form!r}")

    def _unpacked(self, stored: bytes, decode: Callable[[bytes], bytes], size: Callable[[int], int]) -> bytes:
        """The bytes behind a header; `size` is the length of so many bytes once they are stored."""
        word = self.header.itemsize
        if self.decompress is None:
            length = int(np.frombuffer(decode(stored[: size(word)])[:word], self.header)[0])
            # In base64, header and bytes are one run.
            return _exactly(decode(stored[: size(word + length)])[word:], length)
        n_blocks = int(np.frombuffer(decode(stored[: size(word)])[:word], self.header)[0])
        length = (3 + n_blocks) * word
        header = np.frombuffer(decode(stored[: size(length)])[:length], self.header).astype(np.int64)
        ends = np.cumsum(header[3:])
        packed = decode(stored[size(length) : size(length) + size(int(ends[-1]) if n_blocks else 0)])
        return b"".join(self.decompress(packed[end - n : end]) for end, n in zip(ends, header[3:], strict=True))


def _base64_length(n: int) -> int:
    return -(-n // 3) * 4


def _exactly(data: bytes, length: int) -> bytes:
    if len(data) < length:
        raise ValueError(f"{length} bytes are announced, but {len(data)} follow")
    return data[:length]


def read(path: Path, data: bytes) -> Contents:
    """Parse a VTP file."""
    if not data.strip():
        raise MeshError(f"{path}: the file is empty")
    file = _File(path, data)
    pieces = file.root.findall("PolyData/Piece")
    if len(pieces) != 1:
        raise MeshError(f"{path}: the surface is in {len(pieces)} pieces, and only one is supported: merge them")
    piece = pieces[0]
    if int(piece.get("NumberOfStrips", 0)):
        raise MeshError(f"{path}: triangle strips are not supported: save the surface as triangles")
    points, polygons = piece.find("Points/DataArray"), piece.find("Polys")
    if points is None or polygons is None or not int(piece.get("NumberOfPolys", 0)):
        raise MeshError(f"{path}: the file has no polygons, so it is no mesh")
    V = np.asarray(file.array(points), np.float64).reshape(-1, 3)
    if len(V) != int(piece.get("NumberOfPoints", 0)):
        raise MeshError(
            f"{path}: the header announces {piece.get('NumberOfPoints')} points, but the file holds {len(V)}"
        )
    cells = _cells(file, polygons, int(piece.get("NumberOfPolys", 0)))
    check(
        V, cells, lambda i: f"{path}, point {i} (counted from 0)", lambda i: f"{path}, polygon {i} (counted from 0)", 0
    )
    attributes: dict[str, AnyArray] = {}
    for element in piece.findall("PointData/DataArray"):
        values = file.array(element)
        if len(values) == len(V):
            attributes[element.get("Name", f"array_{len(attributes)}")] = values
    return Contents(V, cells, attributes)


def _cells(file: _File, polygons: ElementTree.Element, n: int) -> Cells:
    named = {element.get("Name"): element for element in polygons.findall("DataArray")}
    if not {"connectivity", "offsets"} <= named.keys():
        raise MeshError(f"{file.path}: Polys needs the arrays connectivity and offsets")
    corners, ends = (file.array(named[name]).astype(np.int64) for name in ("connectivity", "offsets"))
    degree: IntArray = np.diff(ends, prepend=0)
    if len(ends) != n or (degree < 3).any() or ends[-1] != len(corners):
        raise MeshError(
            f"{file.path}: the offsets do not divide {len(corners)} corners into {n} polygons of three or more: the "
            "file is damaged"
        )
    return Cells(corners, degree)


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles, their arrays as compressed binary in double precision."""
    ends = 3 * np.arange(1, mesh.n_faces + 1)
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor">',
        "<PolyData>",
        f'<Piece NumberOfPoints="{mesh.n_vertices}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" '
        f'NumberOfPolys="{mesh.n_faces}">',
        "<PointData>",
        *(_data_array(name, values) for name, values in attributes.items()),
        "</PointData>",
        "<Points>",
        _data_array("Points", mesh.V),
        "</Points>",
        "<Polys>",
        _data_array("connectivity", mesh.F.ravel()),
        _data_array("offsets", ends),
        "</Polys>",
        "</Piece>",
        "</PolyData>",
        "</VTKFile>",
        "",
    ]
    path.write_text("\n".join(lines), encoding="ascii")


def _data_array(name: str, values: AnyArray) -> str:
    kind = "Float64" if values.dtype.kind == "f" else "Int64"
    data = np.ascontiguousarray(values, "<f8" if kind == "Float64" else "<i8").tobytes()
    blocks = [data[begin : begin + _BLOCK] for begin in range(0, len(data), _BLOCK)]
    packed = [zlib.compress(block) for block in blocks]
    # Number of blocks, bytes of a full one, bytes of the last if it is not full, bytes of each once compressed.
    header = np.array([len(blocks), _BLOCK, len(data) % _BLOCK, *map(len, packed)], "<u8").tobytes()
    text = (base64.b64encode(header) + base64.b64encode(b"".join(packed))).decode("ascii")
    components = values.shape[1] if values.ndim > 1 else 1
    given = f'type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary"'
    if values.ndim > 1 and components == 1:
        given += ' ComponentName0="0"'
    return f"<DataArray {given}>{text}</DataArray>"
