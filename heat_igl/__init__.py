"""Geodesic distance on meshes by the heat method, with operators from libigl."""

from heat_igl.runtime.lazy import attached as _attached

__version__ = "0.1.0"
# What other libraries and the literature call what is here.
_OTHER_WORDS = {
    "all_pairs": "distance_matrix",
    "compute_distance": "geodesic_distance",
    "dijkstra": "reference.edge_paths",
    "distance": "geodesic_distance",
    "exact_geodesic": "geodesic_distance, or compat.igl.exact_geodesic",
    "fps": "farthest_points",
    "geodesic_matrix": "distance_matrix",
    "heat_geodesic": "HeatMethodSolver, or compat.igl.heat_geodesic",
    "heat_method": "HeatMethodSolver",
    "MeshHeatMethodDistanceSolver": "HeatMethodSolver, or compat.potpourri3d",
    "parallel_transport": "VectorHeatSolver",
    "save_mesh": "write_mesh",
}
__all__, __getattr__, __dir__ = _attached(__name__, __file__, _OTHER_WORDS)
