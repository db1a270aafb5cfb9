"""OFF: counts, one vertex per line, one polygon per line.

meshio is not used, since it reads neither colours nor polygons.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.io.contents import Cells, Contents, Text, check, format_rows, integers, of_corner, ragged, warn_if_cut
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray

# Texture coordinates (ST), colours (C) and normals (N) follow the position and are ignored. Some collections lack the
# space between the keyword and the first count.
_KEYWORD = re.compile(rb"(ST)?C?N?OFF(\d*)|(off)(\d*)")


def _counts(text: Text) -> tuple[int, int, int]:
    """Number of vertices, number of faces, and index of the line after the counts."""
    head = text.tokens(0)
    keyword = _KEYWORD.fullmatch(head[0])
    line = 0
    if keyword:
        glued = keyword.group(2) or keyword.group(4)
        head = ([glued] if glued else []) + head[1:]
        if not head and len(text) > 1:
            line = 1
            head = text.tokens(1)
    elif head[0].upper().endswith(b"OFF"):
        raise text.error(0, "this kind of OFF is not for points in space: convert it to plain OFF")
    elif not head[0].isdigit():
        raise text.error(0, "an OFF file starts with OFF or with its counts of vertices and faces")
    if len(head) < 2 or not all(token.isdigit() and len(token) < 16 for token in head[:2]):
        raise text.error(line, "expected the counts of vertices, faces and edges")
    n, m = int(head[0]), int(head[1])
    if n == 0 or m == 0:
        raise text.error(line, f"the counts announce {n} vertices and {m} faces: a mesh needs both")
    return n, m, line + 1


def read(path: Path, data: bytes) -> Contents:
    """Parse an OFF file."""
    if re.match(rb"\s*\S*OFF\s+BINARY\b", data):
        raise MeshError(f"{path}, line 1: binary OFF is not supported: convert it to ASCII OFF")
    text = Text(path, data, comment="#")
    n, m, begin = _counts(text)
    follow = len(text) - begin
    if n + m != follow:
        why = "cut short, or its counts are" if n + m > follow else "longer than announced, or its counts are"
        raise text.error(
            begin - 1, f"{n} vertices and {m} faces need {n + m} lines, but {follow} follow: the file is {why} wrong"
        )
    V = text.positions(np.arange(begin, begin + n))
    lines = np.arange(begin + n, begin + n + m)
    values, start = text.numbers(lines)
    degree = integers(values[start], lambda i: text.where(lines[i]), "number of corners")
    bad = (degree < 3) | (degree >= text.count[lines])
    found = f"{degree[np.argmax(bad)]} corners"
    text.refuse(lines, bad, f"a face of {found} needs at least three, and an index for each behind the number")
    corners = integers(values[ragged(start + 1, degree)], of_corner(degree, lambda i: text.where(lines[i])))
    cells = Cells(corners, degree)
    check(V, cells, lambda i: text.where(begin + i), lambda i: text.where(lines[i]), base=0)
    warn_if_cut(path, data, int(cells.corners[-1]) or n, n)
    return Contents(V, cells, {})


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles as OFF."""
    counts = f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0\n"
    path.write_text(counts + format_rows("%r %r %r\n", mesh.V) + format_rows("3 %d %d %d\n", mesh.F))
