"""`GeodesicSolver` and `geodesic_distance`: distance on every domain, by the engine that the plan names."""

from heat_igl.geodesic.choice import DistanceMethod, Solver, SolverChoice
from heat_igl.geodesic.distance import geodesic_distance
from heat_igl.geodesic.solver import GeodesicSolver

__all__ = ["DistanceMethod", "GeodesicSolver", "Solver", "SolverChoice", "geodesic_distance"]
