"""STL: triangles without shared vertices, text or binary.

meshio is not used, since it accepts truncated text files and facets with four corners, keeps collapsed triangles, and
needs 2 s for 90 000 vertices.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.io.contents import Cells, Contents
from heat_igl.io.text import Text, format_rows
from heat_igl.mesh import Mesh
from heat_igl.mesh.connectivity import unique_rows
from heat_igl.typing import FloatArray, IntArray

__all__ = ["read", "write"]

_FACET = np.array([b"facet", b"outer", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet"])
_HEADER = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read(path: Path, data: bytes) -> Contents:
    """Parse an STL file. Equal vertices are merged, and triangles that collapse by this are removed."""
    # Binary files may also start with "solid", so the size decides.
    n = int.from_bytes(data[_HEADER - 4 : _HEADER], "little") if len(data) >= _HEADER else -1
    if n >= 0 and len(data) == _HEADER + n * _TRIANGLE.itemsize:
        corners = np.frombuffer(data, _TRIANGLE, offset=_HEADER)["corners"].astype(np.float64)
    elif data[:256].lstrip().lower().startswith(b"solid") and b"\0" not in data:
        corners = _corners(path, data)
    elif n >= 0 and b"\0" in data:
        raise MeshError(
            f"{path}: the header announces {n} triangles, which makes {_HEADER + n * _TRIANGLE.itemsize} bytes, but "
            f"the file has {len(data)}: it is cut short or no STL file"
        )
    else:
        raise MeshError(f"{path}, line 1: neither text STL, which starts with 'solid', nor binary STL")
    if not len(corners):
        raise MeshError(f"{path}: the file holds no triangles")
    bad = ~np.isfinite(corners).all(axis=(1, 2))
    if bad.any():
        raise MeshError(
            f"{path}, triangle {int(np.argmax(bad))} (counted from 0): a coordinate is not finite "
            f"({int(bad.sum())} of {len(corners)} triangles): repair or remove it"
        )
    V, F = _merged(corners.reshape(-1, 3))
    if not len(F):
        raise MeshError(f"{path}: all {len(corners)} triangles have two corners in one point, so none is left")
    return Contents(V, Cells(F.ravel(), np.full(len(F), 3)), {})


def _corners(path: Path, data: bytes) -> FloatArray:
    text = Text(path, data)
    word = np.char.lower(text.words(9))
    inside = np.flatnonzero((word != b"solid") & (word != b"endsolid"))
    whole = len(inside) // 7 * 7
    wrong = word[inside[:whole]] != np.tile(_FACET, whole // 7)
    wrong[word[inside[:whole]] == b"vertex"] |= text.count[inside[:whole]][word[inside[:whole]] == b"vertex"] != 4
    if wrong.any():
        at = int(np.argmax(wrong))
        raise text.error(
            inside[at], f"expected '{_FACET[at % 7].decode()}'" + (" and three numbers" if 2 <= at % 7 <= 4 else "")
        )
    if whole < len(inside) or word[-1] != b"endsolid":
        raise text.error(len(text) - 1, "the file is cut short: the last line of an STL file is 'endsolid'")
    lines = inside[np.isin(np.arange(whole) % 7, [2, 3, 4])]
    corners = text.numbers(lines, skip=1)[0].reshape(-1, 3)
    bad = ~np.isfinite(corners).all(axis=1)
    if bad.any():
        raise text.error(
            lines[np.argmax(bad)],
            f"a coordinate is not finite ({int(bad.sum())} of {len(corners)}): repair or remove it",
        )
    return corners.reshape(-1, 3, 3)


def _merged(points: FloatArray) -> tuple[FloatArray, IntArray]:
    """The distinct vertices in the order of first occurrence, and the triangles with three distinct vertices."""
    rank = np.stack([np.unique(column, return_inverse=True)[1].ravel() for column in points.T], axis=1)
    first, label, _ = unique_rows(rank, int(rank.max()) + 1)
    order = np.argsort(first)
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    F = number[label].reshape(-1, 3)
    whole = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
    F = F[whole]
    used, F_flat = np.unique(F, return_inverse=True)
    return points[first[order]][used], F_flat.reshape(-1, 3)


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles as text STL, because the binary form has no room for double precision."""
    corners = mesh.V[mesh.F]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    facet = "facet normal %r %r %r\nouter loop\n" + "vertex %r %r %r\n" * 3 + "endloop\nendfacet\n"
    rows = np.concatenate([normal[:, None], corners], axis=1).reshape(-1, 12)
    path.write_text("solid mesh\n" + format_rows(facet, rows) + "endsolid mesh\n")
