"""PLY, text and binary of either byte order, with attributes per vertex.

meshio is not used: it rejects additional elements and the property name vertex_index, has no 16-bit types in binary
files, reads unsigned bytes as signed ones, reads the bytes after a list as the next list, and omits arrays (n, k).
The reader of libigl frees memory twice if properties have different types.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.io import ply_tables
from heat_igl.io.contents import Cells, Contents, check, integers, warn_if_cut
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray


def read(path: Path, data: bytes) -> Contents:
    """Parse a PLY file."""
    header, tables = ply_tables.parse(path, data, ("vertex", "face"))
    V, others = _vertices(path, tables)
    faces, n_faces = tables["face"][1], tables["face"][0].n
    name = "vertex_indices" if "vertex_indices" in faces else "vertex_index"
    if name not in faces or len(faces[name].length) != n_faces:
        raise MeshError(f"{path}: element face needs the list property vertex_indices (or vertex_index)")
    degree = faces[name].length

    def face_at(i: int) -> str:
        return f"{path}, face {i} (counted from 0)"

    if (degree < 3).any():
        i = int(np.argmax(degree < 3))
        raise MeshError(f"{face_at(i)}: {degree[i]} corners; a face needs three ({int((degree < 3).sum())} have fewer)")
    end = np.cumsum(degree)
    corners = integers(
        faces[name].values.astype(np.float64), lambda i: face_at(int(np.searchsorted(end, i, side="right")))
    )
    cells = Cells(corners, degree)
    check(V, cells, lambda i: f"{path}, vertex {i} (counted from 0)", face_at, base=0)
    if not header.order:
        warn_if_cut(path, data, int(cells.corners[-1]) or len(V), len(V))
    return Contents(V, cells, _gathered(others, header.vectors))


def read_vertices(path: Path, data: bytes) -> tuple[FloatArray, dict[str, AnyArray]]:
    """The vertices (n, 3) of a PLY file with or without faces, and their other scalar properties."""
    return _vertices(path, ply_tables.parse(path, data, ("vertex",))[1])


def _vertices(path: Path, tables: ply_tables.Tables) -> tuple[FloatArray, dict[str, AnyArray]]:
    element, columns = tables["vertex"]
    scalars = [prop for prop in element.properties if not prop.count_dtype]
    if not {"x", "y", "z"} <= {prop.name for prop in scalars}:
        raise MeshError(f"{path}: element vertex needs the properties x, y and z")
    V = np.stack([columns[axis].values.astype(np.float64) for axis in "xyz"], axis=1)
    others = {
        prop.name: columns[prop.name].values.astype(prop.dtype) for prop in scalars if prop.name not in ("x", "y", "z")
    }
    return V, others


def _gathered(columns: dict[str, AnyArray], vectors: dict[str, int]) -> dict[str, AnyArray]:
    """Combine the properties name_0, name_1, ... to an array (n, k)."""
    for name, k in vectors.items():
        parts = [f"{name}_{i}" for i in range(min(k, len(columns) + 1))]
        if parts and name not in columns and all(part in columns for part in parts):
            columns[name] = np.stack([columns.pop(part) for part in parts], axis=1)
    return columns


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
                raise MeshError(f"{path}: PLY would hold two properties named {part}: rename the attribute {name}")
            columns[part] = column
    faces = np.empty(mesh.n_faces, [("degree", "u1"), ("corners", "<i4", 3)])
    faces["degree"] = 3
    faces["corners"] = mesh.F
    _write(path, columns, comments, faces)


def write_vertices(path: Path, columns: Mapping[str, FloatArray]) -> None:
    """Write vertices without faces: properties of the same length by name, x, y and z among them."""
    _write(path, columns, [], None)


def _write(path: Path, columns: Mapping[str, FloatArray], comments: Sequence[str], faces: AnyArray | None) -> None:
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
