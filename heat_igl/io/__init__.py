"""Files: reading meshes and point clouds, writing meshes with vertex attributes, and writing curves."""

from heat_igl.io.atomic import complete_file
from heat_igl.io.curves import CURVE_SUFFIXES, write_curves
from heat_igl.io.files import MESH_SUFFIXES, read_attributes, read_mesh, read_polygon_mesh, write_mesh
from heat_igl.io.point_clouds import POINT_CLOUD_SUFFIXES, read_point_cloud
from heat_igl.io.polylines import Polyline, read_polylines

__all__ = [
    "CURVE_SUFFIXES",
    "MESH_SUFFIXES",
    "POINT_CLOUD_SUFFIXES",
    "Polyline",
    "complete_file",
    "read_attributes",
    "read_mesh",
    "read_point_cloud",
    "read_polygon_mesh",
    "read_polylines",
    "write_curves",
    "write_mesh",
]
