"""Geodesic distance on meshes by the heat method, with operators from libigl."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heat_igl.runtime.aliases import alias_modules

if TYPE_CHECKING:
    from heat_igl import baselines, cluster, reference, sampling
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
    from heat_igl.drawing import plots
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

# Lazy attribute -> submodule, imported on first use: a call loads the rooms that it needs and no others.
_LAZY = {
    "AccuracyWarning": "errors",
    "BatchError": "errors",
    "ClosestPoints": "mesh",
    "Diagnostics": "heat_method",
    "Directions": "heat_method",
    "FactorizationError": "errors",
    "HeatMethodSolver": "heat_method",
    "HeatSolution": "heat_method",
    "ImageDomain": "mesh",
    "LabelledDistance": "heat_method",
    "Mesh": "mesh",
    "MeshError": "errors",
    "MeshReport": "mesh",
    "MissingExtraError": "errors",
    "OffsetSources": "sources",
    "Operators": "operators",
    "PointCloud": "mesh",
    "PolygonMesh": "mesh",
    "ReferenceSolverError": "errors",
    "Refinement": "unfolding",
    "SourceError": "errors",
    "SurfaceCurve": "mesh",
    "SurfacePoints": "mesh",
    "TangentFrames": "intrinsic",
    "ValidationReport": "validation.report",
    "ValidationRow": "validation.report",
    "VectorHeatSolver": "heat_method",
    "VoronoiCells": "sampling",
    "as_mesh": "mesh",
    "baselines": "baselines",
    "closed_forms": "validation.closed_forms",
    "closest_points": "mesh",
    "cluster": "cluster",
    "connection_laplacian": "operators",
    "curve_on": "mesh",
    "curves": "curves",
    "diameter": "sampling",
    "distance_matrix": "sampling",
    "distances_within": "unfolding",
    "dual_triangulation": "sampling",
    "edge_curve": "mesh",
    "enclosed_areas": "curves",
    "errors": "errors",
    "exp_map": "curves",
    "farthest_cells": "sampling",
    "farthest_points": "sampling",
    "geodesic_centre": "sampling",
    "geodesic_distance": "heat_method",
    "heat_method": "heat_method",
    "heat_method_distance": "heat_method",
    "image_domain": "mesh",
    "intrinsic": "intrinsic",
    "io": "io",
    "isolines": "curves",
    "linear": "linear",
    "log_map": "curves",
    "mesh": "mesh",
    "metrics": "validation.metrics",
    "nearest_vertices": "unfolding",
    "offset_curves": "curves",
    "operators": "operators",
    "pair_distances": "unfolding",
    "plots": "drawing.plots",
    "point_cloud_operators": "operators",
    "polygon_operators": "operators",
    "read_attributes": "io",
    "read_mesh": "io",
    "read_point_cloud": "io",
    "read_polygon_mesh": "io",
    "reference": "reference",
    "runtime": "runtime",
    "sample_mesh": "validation.samples",
    "sampling": "sampling",
    "shapes": "validation.shapes",
    "shortest_paths": "curves",
    "sources": "sources",
    "speed_operators": "operators",
    "split_long_edges": "mesh",
    "steps": "steps",
    "sublevel_areas": "curves",
    "tangent_frames": "intrinsic",
    "trace_geodesic": "curves",
    "typing": "typing",
    "unfolded_distance": "unfolding",
    "unfolding": "unfolding",
    "validate": "validation",
    "voronoi_cells": "sampling",
    "write_curves": "io",
    "write_mesh": "io",
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
        place = _LAZY.get(name) or _EARLIER_NAMES.get(name)
        if place is None:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module = import_module(f"{__name__}.{place}")
        is_module = place.rpartition(".")[2] == name or name in _EARLIER_NAMES
        found = globals()[name] = module if is_module else getattr(module, name)
        return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
