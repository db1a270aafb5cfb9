"""Geodesic distance on meshes by the heat method, on libigl's operators."""

from heat_igl import baselines, closed_forms, metrics, reference, shapes
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
from heat_igl.mesh import Mesh, MeshReport
from heat_igl.projection import ClosestPoints, closest_points, curve_on, edge_curve
from heat_igl.refine import Refinement, unfolded_distance
from heat_igl.solution import Diagnostics, HeatSolution
from heat_igl.sources import OffsetSources
from heat_igl.subdivision import split_long_edges
from heat_igl.surface_points import SurfaceCurve, SurfacePoints
from heat_igl.validation import validate
from heat_igl.validation_report import ValidationReport, ValidationRow

__all__ = [
    "AccuracyWarning",
    "ClosestPoints",
    "Diagnostics",
    "FactorizationError",
    "HeatMethodSolver",
    "HeatSolution",
    "Mesh",
    "MeshError",
    "MeshReport",
    "MissingExtraError",
    "OffsetSources",
    "ReferenceSolverError",
    "Refinement",
    "SourceError",
    "SurfaceCurve",
    "SurfacePoints",
    "ValidationReport",
    "ValidationRow",
    "baselines",
    "closed_forms",
    "closest_points",
    "curve_on",
    "edge_curve",
    "heat_method_distance",
    "metrics",
    "read_attributes",
    "read_mesh",
    "reference",
    "shapes",
    "split_long_edges",
    "unfolded_distance",
    "validate",
    "write_mesh",
]

__version__ = "0.1.0"
