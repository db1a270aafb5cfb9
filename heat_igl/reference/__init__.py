"""Distances to compare with: exact ones, those of other people's solvers, bounds, and the paper's other methods.

Every native solver runs in a child process. `docs/references.md` says how far each one can be trusted. Closed forms are
in `heat_igl.validation.closed_forms`; the other methods that the paper discusses are in `heat_igl.reference.baselines`.

Examples
--------
>>> import heat_igl
>>> heat_igl.reference.exact(heat_igl.shapes.strip(4, 3), 0)[[4, 15, 19]].round(6).tolist()
[4.0, 3.0, 5.0]
"""

from heat_igl.reference import baselines
from heat_igl.reference.bounds import edge_paths, straight_lines
from heat_igl.reference.exact_distance import exact
from heat_igl.reference.guarded import MEMORY, TIMEOUT, close
from heat_igl.reference.heat_methods import igl_heat, potpourri3d_heat
from heat_igl.reference.measurement import EXACT_SOLVERS, Measured, exact_solver, measured
from heat_igl.reference.meshlab_filters import meshlab, meshlab_border, meshlab_heat

__all__ = [
    "EXACT_SOLVERS",
    "MEMORY",
    "Measured",
    "TIMEOUT",
    "baselines",
    "close",
    "edge_paths",
    "exact",
    "exact_solver",
    "igl_heat",
    "measured",
    "meshlab",
    "meshlab_border",
    "meshlab_heat",
    "potpourri3d_heat",
    "straight_lines",
]
