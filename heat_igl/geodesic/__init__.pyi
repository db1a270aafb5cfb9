from heat_igl.geodesic.choice import Solver as Solver
from heat_igl.geodesic.choice import SolverChoice as SolverChoice
from heat_igl.geodesic.solver import GeodesicSolver as GeodesicSolver
from heat_igl.geodesic.solver import geodesic_distance as geodesic_distance
from heat_igl.plan import DistanceMethod as DistanceMethod
