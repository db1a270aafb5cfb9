"""Geodesic distance on meshes by the heat method, on libigl's operators."""

from heat_igl.errors import (
    AccuracyWarning,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
)
from heat_igl.mesh import Mesh, MeshReport

__all__ = [
    "AccuracyWarning",
    "FactorizationError",
    "Mesh",
    "MeshError",
    "MeshReport",
    "MissingExtraError",
    "ReferenceSolverError",
    "SourceError",
]

__version__ = "0.1.0"
