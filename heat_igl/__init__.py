"""Geodesic distance on meshes by the heat method, on libigl's operators."""

from heat_igl import baselines, closed_forms, metrics, reference, shapes
from heat_igl.curve_files import write_curves
from heat_igl.errors import (
    AccuracyWarning,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
)
from heat_igl.heat_method import HeatMethodSolver, heat_method_distance
from heat_igl.io import read_attributes, read_mesh, write_mesh
from heat_igl.isolines import enclosed_areas, isolines, offset_curves, sublevel_areas
from heat_igl.mesh import Mesh, MeshReport
from heat_igl.paths import shortest_paths
from heat_igl.refine import Refinement, unfolded_distance
from heat_igl.solution import Diagnostics, HeatSolution
from heat_igl.subdivision import split_long_edges
from heat_igl.surface_points import SurfaceCurve, SurfacePoints
from heat_igl.validation import validate
from heat_igl.validation_report import ValidationReport, ValidationRow

__all__ = [
    "AccuracyWarning",
    "Diagnostics",
    "FactorizationError",
    "HeatMethodSolver",
    "HeatSolution",
    "Mesh",
    "MeshError",
    "MeshReport",
    "MissingExtraError",
    "ReferenceSolverError",
    "Refinement",
    "SourceError",
    "SurfaceCurve",
    "SurfacePoints",
    "ValidationReport",
    "ValidationRow",
    "baselines",
    "closed_forms",
    "enclosed_areas",
    "heat_method_distance",
    "isolines",
    "metrics",
    "offset_curves",
    "read_attributes",
    "read_mesh",
    "reference",
    "shapes",
    "shortest_paths",
    "split_long_edges",
    "sublevel_areas",
    "unfolded_distance",
    "validate",
    "write_curves",
    "write_mesh",
]

__version__ = "0.1.0"
