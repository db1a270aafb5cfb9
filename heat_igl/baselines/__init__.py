"""The paper's other ways to a distance, to compare with: each usable alone, on meshes or on regular grids.

On meshes: Varadhan's formula (`varadhan`), the boundary problem BP (`boundary_problem`), the Schrodinger equation
(`schrodinger`), fast marching (`fast_marching`), and paths along edges (`graph_distance`) with theorem 3.1
(`graph_limit`), which says that as t tends to 0 the first three end there. They take sources as the rest of the
package does and return a distance (n,): 0 at the sources, ``inf`` where none is reached, nothing negative.

On grids: `schrodinger_grid`, `fast_marching_grid` and `fast_sweeping`. They take a boolean array that marks the sources
and return an array of its shape.
"""

from heat_igl.baselines.fronts import fast_marching, fast_marching_grid, fast_sweeping
from heat_igl.baselines.graph import graph_distance, graph_limit
from heat_igl.baselines.linear import boundary_problem, log_heat_kernel, varadhan
from heat_igl.baselines.schrodinger import schrodinger, schrodinger_grid

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
