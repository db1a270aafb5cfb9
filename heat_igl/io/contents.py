"""The contents of a mesh file, and checks whose errors name the position in the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heat_igl.errors import AccuracyWarning, MeshError
from heat_igl.mesh import Mesh, which_repeat_a_vertex
from heat_igl.runtime import warn_caller
from heat_igl.typing import AnyArray, FloatArray, IntArray


class Cells(NamedTuple):
    """Polygons or tetrahedra: vertex indices from 0, cell after cell, and the number of corners of each cell (m,)."""

    corners: IntArray
    degree: IntArray
    tetrahedra: bool = False


class Contents(NamedTuple):
    """Positions (n, 3), polygons or tetrahedra, and arrays per vertex (n,) or (n, k) by name."""

    V: FloatArray
    cells: Cells
    attributes: dict[str, AnyArray]

    def mesh(self, path: Path) -> Mesh:
        """The mesh of the file; polygons are cut into triangles. A MeshError if the positions cannot be used."""
        corners, degree, tetrahedra = self.cells
        try:
            if tetrahedra:
                return Mesh(self.V, corners.reshape(-1, 4))
            return Mesh.of_polygons(self.V, corners, degree, lambda i: f"{path}, face {i} (counted from 0)")
        except MeshError as error:
            raise MeshError(f"{path}: {error}") from None


def integers(values: FloatArray, where: Callable[[int], str], what: str = "index") -> IntArray:
    """`values` as integers; `where(i)` is the position of the i-th value in the file, for errors."""
    bad = ~(np.abs(values) < 2.0**53) | (values != np.rint(values))
    if bad.any():
        i = int(np.argmax(bad))
        raise MeshError(f"{where(i)}: {values[i]:g} is no {what}, which must be a whole number below 2**53")
    return values.astype(np.int64)


def check(
    V: FloatArray, cells: Cells, vertex_at: Callable[[int], str], cell_at: Callable[[int], str], base: int
) -> None:
    """Check positions (n, 3) and indices from 0; `base` is the first index in the file format.

    `vertex_at` and `cell_at` say where a vertex or a cell stands in the file. A MeshError names the first place, and
    how many there are, where a position is not finite, an index is out of range, or a cell repeats a vertex.
    """
    corners, degree = cells.corners, cells.degree
    n = len(V)
    bad = ~np.isfinite(V).all(axis=1)
    if bad.any():
        where = vertex_at(int(np.argmax(bad)))
        raise MeshError(f"{where}: a coordinate is not finite ({int(bad.sum())} of {n} vertices): repair or remove it")
    end = np.cumsum(degree)
    bad = (corners < 0) | (corners >= n)
    if bad.any():
        first = int(np.argmax(bad))
        where = cell_at(int(np.searchsorted(end, first, side="right")))
        raise MeshError(
            f"{where}: there is no vertex {corners[first] + base}, the file has {n} vertices, counted from {base} "
            f"({int(bad.sum())} such indices): the file is damaged or written by another convention"
        )
    bad = which_repeat_a_vertex(corners, degree)
    if bad.any():
        where = cell_at(int(np.argmax(bad)))
        raise MeshError(
            f"{where}: a face repeats a vertex ({int(bad.sum())} of {len(degree)} faces do): "
            "remove these faces, they have no area"
        )


def warn_if_cut(path: Path, data: bytes, last: int, n: int) -> None:
    """Warn if the last line of a text file has no end, and may be the beginning of a longer line with another face.

    `last` is the last index in the file: with one more digit it may still be that of one of n vertices. It is 0 if the
    file has no counts, so that more may be lost than a digit.
    """
    if 10 * last <= n and not data.endswith((b"\n", b"\r")):
        line = data.rsplit(b"\n", 1)[-1].strip()[:60].decode("utf-8", "backslashreplace")
        warn_caller(
            f"{path}, last line ({line}): no line break ends it, so the file may be cut short there: add one if the "
            "line is complete",
            AccuracyWarning,
        )


_CORNERS = {"triangle": 3, "quad": 4, "tetra": 4}


def select(path: Path, blocks: list[tuple[str, IntArray]]) -> Cells:
    """Select the cells of the domain from blocks of cells, named as in meshio ("triangle", "tetra10", ...).

    If there are tetrahedra, they are the domain, since the triangles in such files are the boundary. Otherwise the
    domain consists of triangles, quadrilaterals and polygons. Points and lines are ignored. Cells of other kinds are a
    MeshError, since without them the domain would have holes.
    """
    blocks = [(kind, rows) for kind, rows in blocks if len(rows) and not kind.startswith(("vertex", "line"))]
    for kind, rows in blocks:
        if kind != "polygon" and kind not in _CORNERS:
            raise MeshError(
                f"{path}: {len(rows)} cells are of kind {kind}; distances are computed on triangles and "
                "four-node tetrahedra only: convert the cells (and lower their order) in the program that made them"
            )
    solid = [rows for kind, rows in blocks if kind == "tetra"]
    chosen = solid or [rows for _, rows in blocks]
    if not chosen:
        raise MeshError(f"{path}: the file holds neither triangles nor tetrahedra, so there is no domain to work on")
    corners = np.concatenate([rows.ravel() for rows in chosen]).astype(np.int64)
    degree = np.concatenate([np.full(len(rows), rows.shape[1], np.int64) for rows in chosen])
    return Cells(corners, degree, bool(solid))
