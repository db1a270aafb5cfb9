"""Geodesic distance on meshes by the heat method, with operators from libigl."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heat_igl import sampling
from heat_igl.curves import (
    enclosed_areas,
    exp_map,
    isolines,
    log_map,
    offset_curves,
    shortest_paths,
    sublevel_areas,
    trace_geodesic,
)
from heat_igl.errors import (
    AccuracyWarning,
    BatchError,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
)
from heat_igl.heat_method import (
    Diagnostics,
    Directions,
    HeatMethodSolver,
    HeatSolution,
    LabelledDistance,
    VectorHeatSolver,
    geodesic_distance,
    heat_method_distance,
)
from heat_igl.intrinsic import TangentFrames, tangent_frames
from heat_igl.io import read_attributes, read_mesh, read_point_cloud, read_polygon_mesh, write_curves, write_mesh
from heat_igl.mesh import (
    ClosestPoints,
    ImageDomain,
    Mesh,
    MeshReport,
    PointCloud,
    PolygonMesh,
    SurfaceCurve,
    SurfacePoints,
    as_mesh,
    closest_points,
    curve_on,
    edge_curve,
    image_domain,
    split_long_edges,
)
from heat_igl.operators import (
    Operators,
    connection_laplacian,
    point_cloud_operators,
    polygon_operators,
    speed_operators,
)
from heat_igl.runtime.aliases import alias_modules
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
from heat_igl.sources import OffsetSources
from heat_igl.unfolding import Refinement, distances_within, nearest_vertices, pair_distances, unfolded_distance

if TYPE_CHECKING:
    from heat_igl import baselines, cluster, reference
    from heat_igl.drawing import plots
    from heat_igl.validation import ValidationReport, ValidationRow, closed_forms, metrics, shapes, validate
    from heat_igl.validation.samples import sample_mesh

__all__ = [
    "AccuracyWarning",
    "BatchError",
    "ClosestPoints",
    "Diagnostics",
    "Directions",
    "FactorizationError",
    "HeatMethodSolver",
    "HeatSolution",
    "ImageDomain",
    "LabelledDistance",
    "Mesh",
    "MeshError",
    "MeshReport",
    "MissingExtraError",
    "OffsetSources",
    "Operators",
    "PointCloud",
    "PolygonMesh",
    "ReferenceSolverError",
    "Refinement",
    "SourceError",
    "SurfaceCurve",
    "SurfacePoints",
    "TangentFrames",
    "ValidationReport",
    "ValidationRow",
    "VectorHeatSolver",
    "VoronoiCells",
    "as_mesh",
    "baselines",
    "closed_forms",
    "closest_points",
    "curve_on",
    "edge_curve",
    "cluster",
    "connection_laplacian",
    "diameter",
    "distance_matrix",
    "distances_within",
    "dual_triangulation",
    "enclosed_areas",
    "exp_map",
    "farthest_cells",
    "farthest_points",
    "geodesic_centre",
    "geodesic_distance",
    "heat_method_distance",
    "image_domain",
    "isolines",
    "log_map",
    "metrics",
    "nearest_vertices",
    "offset_curves",
    "pair_distances",
    "plots",
    "point_cloud_operators",
    "polygon_operators",
    "read_attributes",
    "read_mesh",
    "read_point_cloud",
    "read_polygon_mesh",
    "reference",
    "sample_mesh",
    "sampling",
    "shapes",
    "shortest_paths",
    "speed_operators",
    "split_long_edges",
    "sublevel_areas",
    "tangent_frames",
    "trace_geodesic",
    "unfolded_distance",
    "validate",
    "voronoi_cells",
    "write_curves",
    "write_mesh",
]

__version__ = "0.1.0"

# Lazy attribute -> submodule, imported on first use because a distance does not need it.
_LAZY = {
    "ValidationReport": "validation.report",
    "ValidationRow": "validation.report",
    "baselines": "baselines",
    "closed_forms": "validation.closed_forms",
    "cluster": "cluster",
    "metrics": "validation.metrics",
    "plots": "drawing.plots",
    "reference": "reference",
    "sample_mesh": "validation.samples",
    "shapes": "validation.shapes",
    "validate": "validation",
}

# Modules that users import by these names: earlier name -> the module in its room.
_EARLIER_NAMES = {
    "closed_forms": "validation.closed_forms",
    "demo": "cli.demo",
    "factorization": "linear",
    "metrics": "validation.metrics",
    "paths": "curves.paths",
    "plots": "drawing.plots",
    "polygons": "mesh.polygons",
    "projection": "mesh.projection",
    "refine": "unfolding",
    "shapes": "validation.shapes",
    "solution": "heat_method.solution",
    "speed": "operators.speed",
    "subdivision": "mesh.subdivision",
    "surface_points": "mesh.surface_points",
    "viewer": "drawing.viewer",
}
alias_modules({f"{__name__}.{name}": f"{__name__}.{target}" for name, target in _EARLIER_NAMES.items()})

if not TYPE_CHECKING:  # type checkers would otherwise accept any misspelt attribute

    def __getattr__(name: str) -> Any:
        if name not in _LAZY:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module = import_module(f"{__name__}.{_LAZY[name]}")
        found = globals()[name] = module if _LAZY[name].rpartition(".")[2] == name else getattr(module, name)
        return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
