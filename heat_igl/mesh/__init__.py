"""What distance is measured on: meshes, images and point clouds, and points and curves on them."""

from heat_igl.mesh.cloud_normals import usable_normals
from heat_igl.mesh.cloud_orientation import is_oriented_manifold, two_sided_cover
from heat_igl.mesh.edge_curves import edge_curve
from heat_igl.mesh.exports import to_open3d, to_pyvista, to_trimesh
from heat_igl.mesh.heights import Terrain, terrain
from heat_igl.mesh.level_segments import Segments, crossings, joined_segments, level_segments
from heat_igl.mesh.mesh import Mesh, checked_faces, checked_positions
from heat_igl.mesh.objects import (
    MeshLike,
    as_mesh,
    as_simplices,
    one_sided,
    read_paths_with,
    tangent_surface,
    warn_of_seams,
)
from heat_igl.mesh.part import MeshPart
from heat_igl.mesh.pixel_domain import ImageDomain, image_domain
from heat_igl.mesh.point_cloud import PointCloud
from heat_igl.mesh.polygon_fans import PolygonFans
from heat_igl.mesh.polygons import PolygonMesh, which_repeat_a_vertex
from heat_igl.mesh.projection import ClosestPoints, closest_points
from heat_igl.mesh.regions import region_boundary
from heat_igl.mesh.report import DELAUNAY_TOLERANCE, CloudReport, MeshReport
from heat_igl.mesh.subdivision import split_long_edges
from heat_igl.mesh.surface_curves import curve_on
from heat_igl.mesh.surface_points import (
    ON_SIDE,
    ON_SIDE_COMPUTED,
    NestedCurves,
    SurfaceCurve,
    SurfacePoints,
    flat_curves,
    named_entries,
)

__all__ = [
    "ClosestPoints",
    "CloudReport",
    "DELAUNAY_TOLERANCE",
    "ImageDomain",
    "Mesh",
    "MeshLike",
    "MeshPart",
    "MeshReport",
    "NestedCurves",
    "ON_SIDE",
    "ON_SIDE_COMPUTED",
    "PointCloud",
    "PolygonFans",
    "PolygonMesh",
    "Segments",
    "SurfaceCurve",
    "SurfacePoints",
    "Terrain",
    "as_mesh",
    "as_simplices",
    "checked_faces",
    "checked_positions",
    "closest_points",
    "crossings",
    "curve_on",
    "edge_curve",
    "flat_curves",
    "image_domain",
    "is_oriented_manifold",
    "joined_segments",
    "level_segments",
    "one_sided",
    "named_entries",
    "read_paths_with",
    "region_boundary",
    "split_long_edges",
    "tangent_surface",
    "terrain",
    "to_open3d",
    "to_pyvista",
    "to_trimesh",
    "two_sided_cover",
    "usable_normals",
    "warn_of_seams",
    "which_repeat_a_vertex",
]
