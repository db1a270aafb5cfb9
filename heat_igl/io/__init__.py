"""Files: meshes in, meshes with attributes out, curves out."""

from heat_igl.io.curves import CURVE_SUFFIXES, write_curves
from heat_igl.io.files import MESH_SUFFIXES, read_attributes, read_mesh, read_polygon_mesh, replacing, write_mesh
from heat_igl.io.objects import MeshLike, as_mesh

__all__ = [
    "MeshLike",
    "as_mesh",
    "CURVE_SUFFIXES",
    "MESH_SUFFIXES",
    "read_attributes",
    "read_mesh",
    "read_polygon_mesh",
    "replacing",
    "write_curves",
    "write_mesh",
]
