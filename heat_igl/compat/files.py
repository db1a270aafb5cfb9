"""potpourri3d's functions for files, by those of this package."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from heat_igl.io import complete_file
from heat_igl.io import read_mesh as _read_mesh
from heat_igl.io import read_point_cloud as _read_point_cloud
from heat_igl.io import read_polygon_mesh as _read_polygon_mesh
from heat_igl.io import write_mesh as _write_mesh
from heat_igl.io import write_point_cloud as _write_point_cloud
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.typing import ArrayLike, FloatArray, IntArray

__all__ = ["read_mesh", "read_point_cloud", "read_polygon_mesh", "write_mesh", "write_point_cloud"]


def read_mesh(filename: str | os.PathLike[str]) -> tuple[FloatArray, IntArray]:
    """Positions (n, 3) and triangles (m, 3) of a file, see `heat_igl.read_mesh`."""
    mesh = _read_mesh(filename)
    return np.array(mesh.V), np.array(mesh.F)


def read_polygon_mesh(filename: str | os.PathLike[str]) -> tuple[FloatArray, list[list[int]]]:
    """Positions (n, 3) and polygons of a file, see `heat_igl.read_polygon_mesh`."""
    mesh = _read_polygon_mesh(filename)
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
        _write_mesh(filename, mesh)
        return
    path = Path(filename)
    if path.suffix.lower() != ".obj":
        raise ValueError(f"UV_coords are written to .obj files, not to {path}")
    m = mesh.n_faces
    rows_of_corners: dict[str | None, tuple[int, IntArray]] = {
        "per-vertex": (mesh.n_vertices, mesh.F),
        "per-face": (m, np.repeat(np.arange(m)[:, None], 3, axis=1)),
        "per-corner": (3 * m, np.arange(3 * m).reshape(-1, 3)),
    }
    if UV_type not in rows_of_corners:
        raise ValueError(f"UV_type must be one of {', '.join(map(repr, rows_of_corners))}, not {UV_type!r}")
    k, rows = rows_of_corners[UV_type]
    coordinates = np.asarray(UV_coords, np.float64)
    if coordinates.shape != (k, 2):
        raise ValueError(f"UV_coords must have shape ({k}, 2), {UV_type}, not {coordinates.shape}")
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.V.tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in coordinates.tolist()]
    for corners in (np.stack([mesh.F, rows], axis=2) + 1).tolist():
        lines.append("f " + " ".join(f"{vertex}/{row}" for vertex, row in corners))
    with complete_file(path) as temporary:
        temporary.write_text("\n".join([*lines, ""]), encoding="utf8")


def read_point_cloud(filename: str | os.PathLike[str]) -> FloatArray:
    """The points (n, 3) of a file, see `heat_igl.read_point_cloud`."""
    return np.array(_read_point_cloud(filename).P)


def write_point_cloud(V: ArrayLike, filename: str | os.PathLike[str]) -> None:
    """Write points (n, 3) to a file, see `heat_igl.write_point_cloud`."""
    _write_point_cloud(filename, PointCloud(V))
