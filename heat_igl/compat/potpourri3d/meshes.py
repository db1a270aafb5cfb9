"""Meshes and files: edges, areas and the cotangent Laplacian of arrays, and reading and writing."""

from __future__ import annotations

import os
from pathlib import Path

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl import io
from heat_igl.errors import require_choice
from heat_igl.io.contents import format_rows
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray


def proper(V: ArrayLike, F: ArrayLike) -> Mesh:
    """The mesh without the faces that repeat a vertex, which potpourri3d accepts: they have no area."""
    faces: AnyArray = np.asarray(F)
    if faces.ndim == 2 and faces.shape[1] == 3:
        repeats = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
        faces = faces[~repeats] if repeats.any() and not repeats.all() else faces
    return Mesh(V, faces)


def cotan_laplacian(V: ArrayLike, F: ArrayLike, denom_eps: float = 0.0) -> sp.csr_matrix:
    """The cotangent Laplacian (n, n), positive semidefinite as potpourri3d has it; `denom_eps` is added to twice the
    areas, by which cotangents are divided.
    """
    mesh = proper(V, F)
    half_cotangents = igl.cotmatrix_entries(mesh.V, mesh.F)  # opposite corners 0, 1, 2
    if denom_eps:
        double_area = 2 * mesh.measures
        half_cotangents *= (double_area / (double_area + denom_eps))[:, None]
    tail, head = np.roll(mesh.F, -1, axis=1).ravel(), np.roll(mesh.F, -2, axis=1).ravel()
    weights = sp.coo_array((half_cotangents.ravel(), (tail, head)), shape=(mesh.n_vertices, mesh.n_vertices))
    weights = weights + weights.T
    return sp.csr_matrix(sp.diags_array(weights.sum(axis=1)) - weights)


def face_areas(V: ArrayLike, F: ArrayLike) -> FloatArray:
    """The area (m,) of each triangle."""
    return np.asarray(igl.doublearea(np.asarray(V, np.float64), np.asarray(F, np.int64)) / 2)


def vertex_areas(V: ArrayLike, F: ArrayLike) -> FloatArray:
    """A third of the area of the triangles around each vertex, (n,)."""
    corners: IntArray = np.ravel(np.asarray(F, np.int64))
    return np.asarray(np.bincount(corners, np.repeat(face_areas(V, F) / 3, 3), minlength=len(np.asarray(V))))


def edges(V: ArrayLike, F: ArrayLike) -> IntArray:
    """The distinct edges (k, 2), each ascending, in lexicographic order."""
    return np.array(proper(V, F).edges)


def read_mesh(filename: str | os.PathLike[str]) -> tuple[FloatArray, IntArray]:
    """Positions (n, 3) and triangles (m, 3) of a file, see `heat_igl.read_mesh`."""
    mesh = io.read_mesh(filename)
    return np.array(mesh.V), np.array(mesh.F)


def read_polygon_mesh(filename: str | os.PathLike[str]) -> tuple[FloatArray, list[list[int]]]:
    """Positions (n, 3) and polygons of a file, see `heat_igl.read_polygon_mesh`."""
    mesh = io.read_polygon_mesh(filename)
    return np.array(mesh.V), [polygon.tolist() for polygon in mesh.polygons]


def write_mesh(
    V: ArrayLike,
    F: ArrayLike,
    filename: str | os.PathLike[str],
    UV_coords: ArrayLike | None = None,
    UV_type: str | None = None,
) -> None:
    """Write triangles to a file, see `heat_igl.write_mesh`; texture coordinates go to OBJ alone.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3).
    filename : path-like
        The extension selects the format.
    UV_coords : array_like, optional
        Texture coordinates: (n, 2), (m, 2) or (3 m, 2).
    UV_type : {"per-vertex", "per-face", "per-corner"}, optional
        Which of these they are.

    Raises
    ------
    ValueError
        If there are `UV_coords` and the file is no OBJ, or their shape does not fit `UV_type`.
    """
    mesh = Mesh(V, F)
    if UV_coords is None:
        io.write_mesh(filename, mesh)
        return
    path = Path(filename)
    if path.suffix.lower() != ".obj":
        raise ValueError(f"UV_coords are written to .obj files, not to {path}")
    m = mesh.n_faces
    rows_of_corners = {
        "per-vertex": (mesh.n_vertices, mesh.F),
        "per-face": (m, np.repeat(np.arange(m)[:, None], 3, axis=1)),
        "per-corner": (3 * m, np.arange(3 * m).reshape(-1, 3)),
    }
    require_choice("UV_type", UV_type, rows_of_corners)
    k, rows = rows_of_corners[str(UV_type)]
    coordinates = np.asarray(UV_coords, np.float64)
    if coordinates.shape != (k, 2):
        raise ValueError(f"UV_coords must have shape ({k}, 2), {UV_type}, not {coordinates.shape}")
    positions, textures = format_rows("v %r %r %r\n", mesh.V), format_rows("vt %r %r\n", coordinates)
    faces = format_rows("f %d/%d %d/%d %d/%d\n", np.stack([mesh.F, rows], axis=2) + 1)
    with io.complete_file(path) as temporary:
        temporary.write_text(positions + textures + faces)


def read_point_cloud(filename: str | os.PathLike[str]) -> FloatArray:
    """The points (n, 3) of a file, see `heat_igl.read_point_cloud`."""
    return np.array(io.read_point_cloud(filename).P)


def write_point_cloud(V: ArrayLike, filename: str | os.PathLike[str]) -> None:
    """Write points (n, 3) to a file, see `heat_igl.write_point_cloud`."""
    io.write_point_cloud(filename, PointCloud(V))
