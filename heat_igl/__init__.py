"""Geodesic distance on meshes by the heat method, on libigl's operators."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heat_igl import sampling, shapes
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

if TYPE_CHECKING:
    from heat_igl import baselines, closed_forms, cluster, metrics, reference
    from heat_igl.validation import validate
    from heat_igl.validation.report import ValidationReport, ValidationRow

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

# What a distance does without is loaded on first use: the name, and the module that it is, or is in.
_LATER = {
    "ValidationReport": "validation.report",
    "ValidationRow": "validation.report",
    "baselines": "baselines",
    "closed_forms": "closed_forms",
    "cluster": "cluster",
    "metrics": "metrics",
    "reference": "reference",
    "validate": "validation",
}

if not TYPE_CHECKING:  # else any misspelt name would pass for one of these

    def __getattr__(name: str) -> Any:
        if name not in _LATER:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module = import_module(f"{__name__}.{_LATER[name]}")
        found = globals()[name] = module if _LATER[name] == name else getattr(module, name)
        return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
