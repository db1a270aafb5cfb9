"""Point clouds of other libraries as `PointCloud`: recognized by class name and attributes, so nothing is imported."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.mesh.point_cloud import PointCloud
from heat_igl.typing import AnyArray

# Classes of trimesh, open3d (two), pyvista and vedo; more objects than theirs have positions and no faces.
_CLASSES = ("PointCloud", "PointSet", "Points")
# Cells of points and lines, by the beginnings of their names in meshio and by their numbers in VTK.
_POINTS, _LINES = ("vertex", 1, 2), ("line", 3, 4, 21)


def cloud_of_points(mesh: Any) -> PointCloud | None:
    """The point clouds of trimesh, open3d and vedo, and pyvista's PointSet; None for anything else."""
    if type(mesh).__name__ not in _CLASSES:
        return None
    if hasattr(mesh, "point") and "positions" in mesh.point:  # open3d's cloud of tensors
        names = [name for name in ("positions", "normals") if name in mesh.point]
        return _cloud(*(mesh.point[name].cpu().numpy() for name in names))
    for name in ("points", "vertices"):
        P = getattr(mesh, name, None)
        if P is not None and not callable(P):
            normals = mesh.normals if hasattr(mesh, "has_normals") and mesh.has_normals() else _active_normals(mesh)
            return _cloud(P, normals)
    return None


def cloud_of_poly_data(mesh: Any) -> PointCloud | None:
    """PolyData of pyvista or vtk that holds nothing but points; None if there are cells of other kinds."""
    if hasattr(mesh, "GetPoints"):
        cells = mesh.GetNumberOfLines() + mesh.GetNumberOfPolys() + mesh.GetNumberOfStrips()
        if cells or mesh.GetPoints() is None:
            return None
        return _cloud(mesh.GetPoints().GetData(), mesh.GetPointData().GetNormals())
    return _cloud(mesh.points, _active_normals(mesh))


def cloud_of_cells(mesh: Any) -> PointCloud | None:
    """A mesh of meshio, or pyvista's UnstructuredGrid, that holds nothing but points; None if it holds lines."""
    if any(_is_one_of(kind, _LINES) for kind in mesh.cells_dict):
        return None
    return _cloud(mesh.points, _active_normals(mesh))


def refuse_other_cells(mesh: Any, understood: tuple[str | int, ...]) -> None:
    """A `MeshError` for cells neither understood nor points or lines: without them, the domain would have holes."""
    for kind, rows in mesh.cells_dict.items():
        if len(rows) and kind not in understood and not _is_one_of(kind, _POINTS + _LINES):
            name = kind if isinstance(kind, str) else f"{kind} of VTK"
            raise MeshError(
                f"the mesh holds {len(rows)} cells of kind {name}; distances are computed on triangles, polygons and "
                "four-node tetrahedra only: convert the cells, as .triangulate() of pyvista does"
            )


def _is_one_of(kind: Any, kinds: tuple[str | int, ...]) -> bool:
    """Whether a kind of cells is among `kinds`: "line3" is a line, too."""
    name = kind.rstrip("0123456789") if isinstance(kind, str) else kind
    return name in kinds


def _active_normals(mesh: Any) -> AnyArray | None:
    """The normals that pyvista would draw with."""
    return getattr(getattr(mesh, "point_data", None), "active_normals", None)


def _cloud(P: Any, normals: Any = None) -> PointCloud:
    from heat_igl.mesh.cloud_normals import usable_normals

    return PointCloud(np.asarray(P), None if normals is None else usable_normals(np.asarray(normals)))
