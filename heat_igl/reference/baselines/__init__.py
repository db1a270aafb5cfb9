"""Other methods for geodesic distance that the paper discusses, for comparison, on meshes and on regular grids.

On meshes: Varadhan's formula (`varadhan`), the boundary problem BP (`boundary_problem`), the Schrodinger equation
(`schrodinger`), fast marching (`fast_marching`) and shortest paths along edges (`graph_distance`). By theorem 3.1
(`graph_limit`) the first three tend to distances along edges as t tends to 0. They take source vertices and return
distances (n,), which are 0 at the sources, ``inf`` at unreachable vertices, and never negative.

On grids: `schrodinger_grid`, `fast_marching_grid` and `fast_sweeping`. They take a boolean array that marks the sources
and return distances in an array of the same shape.

Examples
--------
>>> import heat_igl
>>> heat_igl.reference.baselines.graph_distance(heat_igl.shapes.strip(4, 3), 0)[[4, 15, 19]].tolist()
[4.0, 3.0, 7.0]
"""

from heat_igl.reference.baselines.fronts import fast_marching, fast_marching_grid, fast_sweeping
from heat_igl.reference.baselines.graph import graph_distance, graph_limit
from heat_igl.reference.baselines.linear import boundary_problem, log_heat_kernel, varadhan
from heat_igl.reference.baselines.schrodinger import schrodinger, schrodinger_grid

__all__ = [
    "boundary_problem",
    "fast_marching",
    "fast_marching_grid",
    "fast_sweeping",
    "graph_distance",
    "graph_limit",
    "log_heat_kernel",
    "schrodinger",
    "schrodinger_grid",
    "varadhan",
]
