"""Meshes as objects of other libraries, with values at their vertices and faces."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.errors import MeshError, as_array
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_simplices
from heat_igl.typing import AnyArray, ArrayLike


def to_trimesh(mesh: MeshLike, **attributes: ArrayLike) -> Any:
    """A mesh of triangles as a ``trimesh.Trimesh``; vertices keep their numbers.

    Parameters
    ----------
    mesh : mesh
        Triangles on n vertices, m faces: whatever `as_mesh` takes.
    **attributes : (n,) or (n, d), or (m,) or (m, d) array_like
        Values that become ``vertex_attributes``, or ``face_attributes``. Where n is m, of vertices.

    Returns
    -------
    trimesh.Trimesh

    Raises
    ------
    MeshError
        If the mesh cannot be used, or holds tetrahedra.
    ValueError
        If values have neither n nor m rows.
    ImportError
        If trimesh is not installed; no extra of this package installs it.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(2)
    >>> surface = heat_igl.to_trimesh(mesh, distance=heat_igl.geodesic_distance(mesh, 0))
    >>> surface.vertex_attributes["distance"].shape
    (162,)
    """
    triangles = _triangles(mesh)
    import trimesh  # type: ignore[import-not-found]

    of_vertices, of_faces = _attributes(triangles, attributes)
    return trimesh.Trimesh(
        triangles.vertices, triangles.faces, vertex_attributes=of_vertices, face_attributes=of_faces, process=False
    )


def to_pyvista(mesh: MeshLike, **attributes: ArrayLike) -> Any:
    """A mesh of triangles as a ``pyvista.PolyData``, values as ``point_data`` or ``cell_data``.

    Parameters, result and errors are those of `to_trimesh`, for pyvista.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(2)
    >>> surface = heat_igl.to_pyvista(mesh, distance=heat_igl.geodesic_distance(mesh, 0))
    >>> surface.point_data["distance"].shape
    (162,)
    """
    triangles = _triangles(mesh)
    import pyvista  # type: ignore[import-not-found]

    of_vertices, of_faces = _attributes(triangles, attributes)
    surface = pyvista.PolyData.from_regular_faces(triangles.vertices, triangles.faces)
    surface.point_data.update(of_vertices)
    surface.cell_data.update(of_faces)
    return surface


def to_open3d(mesh: MeshLike, **attributes: ArrayLike) -> Any:
    """A mesh of triangles as an ``open3d.t.geometry.TriangleMesh``, values as ``.vertex`` or ``.triangle``.

    Parameters, result and errors are those of `to_trimesh`, for open3d; the older mesh of open3d, which has no
    attributes, is ``to_open3d(mesh).to_legacy()``. In open3d, values have two dimensions: (n,) becomes (n, 1).

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(2)
    >>> surface = heat_igl.to_open3d(mesh, distance=heat_igl.geodesic_distance(mesh, 0))
    >>> surface.vertex["distance"].shape
    SizeVector[162, 1]
    """
    triangles = _triangles(mesh)
    import open3d  # type: ignore[import-not-found]

    surface = open3d.t.geometry.TriangleMesh(
        open3d.core.Tensor(triangles.vertices), open3d.core.Tensor(triangles.faces)
    )
    for there, found in zip((surface.vertex, surface.triangle), _attributes(triangles, attributes), strict=True):
        for name, values in found.items():
            there[name] = open3d.core.Tensor(np.ascontiguousarray(values.reshape(len(values), -1)))
    return surface


def _triangles(mesh: MeshLike) -> Mesh:
    triangles = as_simplices(mesh)
    if triangles.is_tetrahedral:
        raise MeshError("a surface of triangles is wanted, and the mesh holds tetrahedra")
    return triangles


def _attributes(mesh: Mesh, attributes: dict[str, ArrayLike]) -> tuple[dict[str, AnyArray], dict[str, AnyArray]]:
    """Copies of the values at vertices, and of those at faces."""
    of_vertices, of_faces = {}, {}
    for name, given in attributes.items():
        values = as_array(name, given).copy()
        if values.ndim and len(values) == mesh.n_vertices:
            of_vertices[name] = values
        elif values.ndim and len(values) == mesh.n_faces:
            of_faces[name] = values
        else:
            raise ValueError(
                f"{name} must have a row for each of {mesh.n_vertices} vertices or {mesh.n_faces} faces, not shape "
                f"{values.shape}"
            )
    return of_vertices, of_faces
