"""Geodesic distance on meshes by the heat method, on libigl's operators."""

from heat_igl import baselines, closed_forms, cluster, metrics, reference, sampling, shapes
from heat_igl.curve_files import write_curves
from heat_igl.errors import (
    AccuracyWarning,
    BatchError,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
)
from heat_igl.heat_method import HeatMethodSolver, heat_method_distance
from heat_igl.images import ImageDomain, image_domain
from heat_igl.io import read_attributes, read_mesh, read_polygon_mesh, write_mesh
from heat_igl.isolines import enclosed_areas, isolines, offset_curves, sublevel_areas
from heat_igl.mesh import Mesh, MeshReport
from heat_igl.paths import shortest_paths
from heat_igl.polygons import PolygonMesh, polygon_operators
from heat_igl.projection import ClosestPoints, closest_points, curve_on, edge_curve
from heat_igl.refine import Refinement, unfolded_distance
from heat_igl.sampling import (
    VoronoiCells,
    diameter,
    distance_matrix,
    dual_triangulation,
    farthest_cells,
    farthest_points,
    geodesic_centre,
    voronoi_cells,
)
from heat_igl.solution import Diagnostics, HeatSolution
from heat_igl.sources import OffsetSources
from heat_igl.speed import speed_operators
from heat_igl.subdivision import split_long_edges
from heat_igl.surface_points import SurfaceCurve, SurfacePoints
from heat_igl.validation import validate
from heat_igl.validation_report import ValidationReport, ValidationRow

__all__ = [
    "AccuracyWarning",
    "BatchError",
    "ClosestPoints",
    "Diagnostics",
    "FactorizationError",
    "HeatMethodSolver",
    "HeatSolution",
    "ImageDomain",
    "Mesh",
    "MeshError",
    "MeshReport",
    "MissingExtraError",
    "OffsetSources",
    "PolygonMesh",
    "ReferenceSolverError",
    "Refinement",
    "SourceError",
    "SurfaceCurve",
    "SurfacePoints",
    "ValidationReport",
    "ValidationRow",
    "VoronoiCells",
    "baselines",
    "closed_forms",
    "closest_points",
    "curve_on",
    "edge_curve",
    "cluster",
    "diameter",
    "distance_matrix",
    "dual_triangulation",
    "enclosed_areas",
    "farthest_cells",
    "farthest_points",
    "geodesic_centre",
    "heat_method_distance",
    "image_domain",
    "isolines",
    "metrics",
    "offset_curves",
    "polygon_operators",
    "read_attributes",
    "read_mesh",
    "read_polygon_mesh",
    "reference",
    "sampling",
    "shapes",
    "shortest_paths",
    "speed_operators",
    "split_long_edges",
    "sublevel_areas",
    "unfolded_distance",
    "validate",
    "voronoi_cells",
    "write_curves",
    "write_mesh",
]

__version__ = "0.1.0"
