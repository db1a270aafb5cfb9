"""`GeodesicSolver` and `geodesic_distance`: distance and its derivatives, by the engine that the plan names."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
