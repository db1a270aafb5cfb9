"""Geodesic distance on meshes by the heat method, on libigl's operators."""

from heat_igl import baselines, shapes
from heat_igl.errors import (
    AccuracyWarning,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
)
from heat_igl.heat_method import HeatMethodSolver, HeatSolution, heat_method_distance
from heat_igl.io import read_attributes, read_mesh, write_mesh
from heat_igl.mesh import Mesh, MeshReport

__all__ = [
    "AccuracyWarning",
    "FactorizationError",
    "HeatMethodSolver",
    "HeatSolution",
    "Mesh",
    "MeshError",
    "MeshReport",
    "MissingExtraError",
    "ReferenceSolverError",
    "SourceError",
    "baselines",
    "heat_method_distance",
    "read_attributes",
    "read_mesh",
    "shapes",
    "write_mesh",
]

__version__ = "0.1.0"
