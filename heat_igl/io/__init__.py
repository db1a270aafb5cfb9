"""Files: reading and writing meshes with vertex attributes and point clouds, and writing curves."""

from heat_igl.io.atomic import complete_file
from heat_igl.io.by_nibabel import MAP_SUFFIXES
from heat_igl.io.curves import CURVE_SUFFIXES, is_flat, write_curves, write_svg
from heat_igl.io.files import MESH_SUFFIXES, read_attributes, read_mesh, read_polygon_mesh, write_mesh
from heat_igl.io.point_clouds import (
    POINT_CLOUD_SUFFIXES,
    is_mesh_or_cloud_path,
    read_mesh_or_cloud,
    read_point_cloud,
    write_point_cloud,
)
from heat_igl.io.polylines import Polyline, read_polylines

__all__ = [
    "CURVE_SUFFIXES",
    "MAP_SUFFIXES",
    "MESH_SUFFIXES",
    "POINT_CLOUD_SUFFIXES",
    "Polyline",
    "complete_file",
    "is_flat",
    "is_mesh_or_cloud_path",
    "read_attributes",
    "read_mesh",
    "read_mesh_or_cloud",
    "read_point_cloud",
    "read_polygon_mesh",
    "read_polylines",
    "write_curves",
    "write_mesh",
    "write_point_cloud",
    "write_svg",
]
